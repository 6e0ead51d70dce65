// Parallel HDF5 files behind a few typed calls. Handles close themselves, every failure becomes an IoError that names
// file and object, and every call is collective: after it all ranks succeeded or all throw the same error.
// One failure cannot be handed on: after data could not be written, HDF5 1.10 hangs or crashes in whatever closes the
// file, MPI_Finalize included. The rank it happens to then removes the file and ends the program on all ranks with one
// line on stderr and the exit code of an IoError. Reserve the space first, so that a full disk is found in time.
#pragma once

#include <hdf5.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "mpi/comm.hpp"

namespace breccia::io::h5 {

/// An HDF5 identifier, closed at the end of its scope.
class Handle {
 public:
  using Closer = herr_t (*)(hid_t);
  Handle() = default;
  Handle(hid_t id, Closer closer) : id_(id), closer_(closer) {}
  ~Handle() { close(); }
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)), closer_(other.closer_) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(closer_, other.closer_);
    return *this;
  }
  [[nodiscard]] hid_t get() const { return id_; }
  [[nodiscard]] bool valid() const { return id_ >= 0; }
  /// Closes now; negative if that failed.
  herr_t close() { return id_ >= 0 ? closer_(std::exchange(id_, H5I_INVALID_HID)) : 0; }

 private:
  hid_t id_ = H5I_INVALID_HID;
  Closer closer_ = nullptr;
};

/// Memory and file type of T.
template <class T>
hid_t type_of();
template <>
hid_t type_of<double>();
template <>
hid_t type_of<std::int64_t>();
template <>
hid_t type_of<std::uint64_t>();
template <>
hid_t type_of<std::uint32_t>();
template <>
hid_t type_of<std::uint8_t>();

/// The rows first .. first + count - 1 of a dataset, those of this rank.
struct Rows {
  std::uint64_t first = 0;
  std::uint64_t count = 0;
};

/// Shape and storage of a dataset of `rows` rows; (rows) for one component, (rows, components) for more.
struct Layout {
  std::uint64_t rows = 0;
  std::uint64_t components = 1;
  std::uint64_t chunk_rows = 0;  ///< rows of a chunk, shuffled and compressed (gzip 1); 0: contiguous, plain
};

/// One file open on all ranks of a communicator.
class File {
 public:
  /// A new file, replacing an old one of this name.
  static File create(const std::filesystem::path& path, const mpi::Comm& comm);
  /// An existing file, to be read: by each rank for itself, without MPI.
  static File open(const std::filesystem::path& path, const mpi::Comm& comm);

  /// Flushes all ranks' data to storage and closes.
  void close();

  [[nodiscard]] bool exists(const std::string& object) const;
  /// Extents of a dataset.
  [[nodiscard]] std::vector<std::uint64_t> shape(const std::string& dataset) const;
  /// Bytes of an element of a dataset.
  [[nodiscard]] std::size_t element_bytes(const std::string& dataset) const;
  void create_group(const std::string& group);
  /// A second name of an object (hard link).
  void link(const std::string& object, const std::string& name);

  /// Scalar or 1-D attribute of a group or dataset; T as in type_of.
  template <class T>
  void write_attribute(const std::string& object, const std::string& name, T value) {
    write_attribute_values(object, name, type_of<T>(), &value, std::nullopt);
  }
  template <class T>
  void write_attribute_array(const std::string& object, const std::string& name, std::span<const T> values) {
    write_attribute_values(object, name, type_of<T>(), values.data(), values.size());
  }
  /// Fixed-length string of exactly the text's length, ASCII unless the text is not.
  void write_attribute(const std::string& object, const std::string& name, const std::string& text);
  /// 1-D array of fixed-length strings, as long as the longest.
  void write_attribute(const std::string& object, const std::string& name, const std::vector<std::string>& texts);

  /// The attribute's value (of an array: the first `values.size()` ones); false if there is none. Types are converted.
  template <class T>
  bool read_attribute_array(const std::string& object, const std::string& name, std::span<T> values) const {
    return read_attribute_values(object, name, type_of<T>(), values.data(), values.size());
  }
  template <class T>
  bool read_attribute(const std::string& object, const std::string& name, T& value) const {
    return read_attribute_array(object, name, std::span<T>(&value, 1));
  }
  /// Of a fixed- or variable-length string; an array's strings one after the other.
  [[nodiscard]] std::vector<std::string> read_attribute_texts(const std::string& object, const std::string& name) const;

  /// A new dataset, each rank writing its rows; values.size() = rows.count * layout.components.
  template <class T>
  void write_rows(const std::string& dataset, const Layout& layout, Rows rows, std::span<const T> values) {
    write_rows_of(dataset, layout, rows, type_of<T>(), values.data());
  }
  /// Rows of a dataset of shape (N) or (N, components), converted to T.
  template <class T>
  [[nodiscard]] std::vector<T> read_rows(const std::string& dataset, Rows rows, std::uint64_t components = 1) const {
    std::vector<T> values(rows.count * components);
    read_rows_of(dataset, rows, components, type_of<T>(), values.data());
    return values;
  }
  /// A dataset of one long text, the same on all ranks.
  void write_text(const std::string& dataset, const std::string& text);
  [[nodiscard]] std::string read_text(const std::string& dataset) const;

 private:
  File(std::filesystem::path path, const mpi::Comm& comm) : path_(std::move(path)), comm_(comm) {}
  void stage(const std::string& object, const char* what, const std::function<void()>& body) const;
  void write_or_end(const std::string& object, const char* what, const std::function<void()>& body) const;
  [[nodiscard]] std::string failure_text(const std::string& object, const char* what, const char* reason) const;
  [[nodiscard]] Handle open_object(const std::string& object) const;
  void write_attribute_values(const std::string& object, const std::string& name, hid_t type, const void* values,
                              std::optional<std::uint64_t> count);
  bool read_attribute_values(const std::string& object, const std::string& name, hid_t type, void* values,
                             std::uint64_t count) const;
  void write_rows_of(const std::string& dataset, const Layout& layout, Rows rows, hid_t type, const void* values);
  void read_rows_of(const std::string& dataset, Rows rows, std::uint64_t components, hid_t type, void* values) const;

  std::filesystem::path path_;
  mpi::Comm comm_;
  Handle file_;
};

}  // namespace breccia::io::h5

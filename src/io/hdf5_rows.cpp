#include <algorithm>
#include <array>

#include "io/hdf5.hpp"
#include "io/hdf5_checks.hpp"

namespace breccia::io::h5 {

namespace {

using Extents = std::array<hsize_t, 2>;

// Without the time of writing: equal results make equal files.
Handle timeless() {
  Handle properties = checked(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  check(H5Pset_obj_track_times(properties.get(), false));
  return properties;
}

Handle creation_properties(const Layout& layout, int rank) {
  Handle properties = timeless();
  // Every element is written once: filling first would only double the work.
  check(H5Pset_fill_time(properties.get(), H5D_FILL_TIME_NEVER));
  if (layout.chunk_rows == 0 || layout.rows == 0) return properties;
  const Extents chunk{std::min(layout.chunk_rows, layout.rows), layout.components};
  check(H5Pset_chunk(properties.get(), rank, chunk.data()));
  check(H5Pset_shuffle(properties.get()));
  check(H5Pset_deflate(properties.get(), 1));
  return properties;
}

Handle collective_transfer() {
  Handle transfer = checked(H5Pcreate(H5P_DATASET_XFER), H5Pclose);
  check(H5Pset_dxpl_mpio(transfer.get(), H5FD_MPIO_COLLECTIVE));
  return transfer;
}

// Selects `rows` of a file space and returns the matching memory space.
Handle select_rows(const Handle& file_space, int rank, Rows rows, std::uint64_t components) {
  const Extents start{rows.first, 0};
  const Extents count{rows.count, components};
  Handle memory_space = checked(H5Screate_simple(rank, count.data(), nullptr), H5Sclose);
  if (rows.count == 0) {
    check(H5Sselect_none(file_space.get()));
    check(H5Sselect_none(memory_space.get()));
  } else {
    check(H5Sselect_hyperslab(file_space.get(), H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr));
  }
  return memory_space;
}

int rank_of(std::uint64_t components) { return components == 1 ? 1 : 2; }

}  // namespace

void File::write_rows_of(const std::string& dataset, const Layout& layout, Rows rows, hid_t type, const void* values) {
  const int rank = rank_of(layout.components);
  Handle set;
  Handle space;
  stage(dataset, "create the dataset", [&] {
    const Extents extents{layout.rows, layout.components};
    space = checked(H5Screate_simple(rank, extents.data(), nullptr), H5Sclose);
    const Handle properties = creation_properties(layout, rank);
    set =
        checked(H5Dcreate2(file_.get(), dataset.c_str(), type, space.get(), H5P_DEFAULT, properties.get(), H5P_DEFAULT),
                H5Dclose);
  });
  if (layout.rows == 0) return;
  write_or_end(dataset, "write", [&] {
    const Handle memory_space = select_rows(space, rank, rows, layout.components);
    check(H5Dwrite(set.get(), type, memory_space.get(), space.get(), collective_transfer().get(), values));
  });
}

void File::read_rows_of(const std::string& dataset, Rows rows, std::uint64_t components, hid_t type,
                        void* values) const {
  stage(dataset, "read", [&] {
    const Handle set = checked(H5Dopen2(file_.get(), dataset.c_str(), H5P_DEFAULT), H5Dclose);
    const Handle space = checked(H5Dget_space(set.get()), H5Sclose);
    if (H5Sget_simple_extent_npoints(space.get()) == 0) return;
    const Handle memory_space = select_rows(space, rank_of(components), rows, components);
    check(H5Dread(set.get(), type, memory_space.get(), space.get(), H5P_DEFAULT, values));
  });
}

void File::write_text(const std::string& dataset, const std::string& text) {
  write_or_end(dataset, "write", [&] {
    const Handle type = text_type(text.size(), false);
    const Handle space = checked(H5Screate(H5S_SCALAR), H5Sclose);
    const Handle properties = timeless();
    const Handle set = checked(
        H5Dcreate2(file_.get(), dataset.c_str(), type.get(), space.get(), H5P_DEFAULT, properties.get(), H5P_DEFAULT),
        H5Dclose);
    // The same value on every rank: one writes it.
    const Handle memory_space = checked(H5Screate(H5S_SCALAR), H5Sclose);
    if (!comm_.is_root()) {
      check(H5Sselect_none(space.get()));
      check(H5Sselect_none(memory_space.get()));
    }
    check(H5Dwrite(set.get(), type.get(), memory_space.get(), space.get(), collective_transfer().get(), text.c_str()));
  });
}

std::string File::read_text(const std::string& dataset) const {
  std::string text;
  stage(dataset, "read", [&] {
    const Handle set = checked(H5Dopen2(file_.get(), dataset.c_str(), H5P_DEFAULT), H5Dclose);
    const Handle type = checked(H5Dget_type(set.get()), H5Tclose);
    text.resize(H5Tget_size(type.get()));
    check(H5Dread(set.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data()));
  });
  text.resize(text.find_last_not_of('\0') + 1);
  return text;
}

}  // namespace breccia::io::h5

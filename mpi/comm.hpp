// A communicator with the few typed collectives the project uses. Works the same on one rank without mpirun.
#pragma once

#include <mpi.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

namespace breccia::mpi {

/// Starts MPI for the lifetime of main.
class Environment {
 public:
  Environment(int* argc, char*** argv);
  ~Environment();
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;
};

template <class T>
MPI_Datatype datatype();
template <>
MPI_Datatype datatype<double>();
template <>
MPI_Datatype datatype<float>();
template <>
MPI_Datatype datatype<std::int32_t>();
template <>
MPI_Datatype datatype<std::int64_t>();
template <>
MPI_Datatype datatype<std::uint64_t>();
template <>
MPI_Datatype datatype<std::uint32_t>();

/// View of a communicator; copies share it.
class Comm {
 public:
  explicit Comm(MPI_Comm handle = MPI_COMM_WORLD);

  [[nodiscard]] int rank() const { return rank_; }
  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] bool is_root() const { return rank_ == 0; }
  [[nodiscard]] MPI_Comm handle() const { return handle_; }
  void barrier() const;

  /// Element-wise reduction over the ranks, result on all.
  template <class T>
  void sum(std::span<T> values) const {
    MPI_Allreduce(MPI_IN_PLACE, values.data(), static_cast<int>(values.size()), datatype<T>(), MPI_SUM, handle_);
  }
  template <class T>
  void max(std::span<T> values) const {
    MPI_Allreduce(MPI_IN_PLACE, values.data(), static_cast<int>(values.size()), datatype<T>(), MPI_MAX, handle_);
  }
  template <class T>
  [[nodiscard]] T sum(T value) const {
    return reduce(value, MPI_SUM);
  }
  template <class T>
  [[nodiscard]] T max(T value) const {
    return reduce(value, MPI_MAX);
  }
  template <class T>
  [[nodiscard]] T min(T value) const {
    return reduce(value, MPI_MIN);
  }
  /// Sum over the ranks before this one (0 on rank 0).
  [[nodiscard]] std::uint64_t exclusive_scan(std::uint64_t value) const;
  [[nodiscard]] bool any(bool value) const { return max<std::int32_t>(value ? 1 : 0) != 0; }

  /// One value of each rank, in rank order, on all ranks.
  template <class T>
  [[nodiscard]] std::vector<T> allgather(const T& value) const {
    static_assert(std::is_trivially_copyable_v<T>);
    std::vector<T> all(static_cast<std::size_t>(size_));
    MPI_Allgather(&value, sizeof(T), MPI_BYTE, all.data(), sizeof(T), MPI_BYTE, handle_);
    return all;
  }
  /// Arrays of different length of all ranks, one after the other in rank order, on all ranks.
  template <class T>
  [[nodiscard]] std::vector<T> allgather_arrays(std::span<const T> mine) const {
    static_assert(std::is_trivially_copyable_v<T>);
    std::vector<std::byte> raw = allgather_bytes(std::as_bytes(mine));
    std::vector<T> all(raw.size() / sizeof(T));
    std::copy_n(raw.data(), raw.size(), reinterpret_cast<std::byte*>(all.data()));
    return all;
  }
  /// to[r] goes to rank r; returns what came from each rank, in rank order.
  template <class T>
  [[nodiscard]] std::vector<std::vector<T>> alltoall(const std::vector<std::vector<T>>& to) const {
    static_assert(std::is_trivially_copyable_v<T>);
    std::vector<std::vector<std::byte>> raw(to.size());
    for (std::size_t r = 0; r < to.size(); ++r) {
      const auto bytes = std::as_bytes(std::span<const T>(to[r]));
      raw[r].assign(bytes.begin(), bytes.end());
    }
    const auto received = alltoall_bytes(raw);
    std::vector<std::vector<T>> from(received.size());
    for (std::size_t r = 0; r < received.size(); ++r) {
      from[r].resize(received[r].size() / sizeof(T));
      std::copy_n(received[r].data(), received[r].size(), reinterpret_cast<std::byte*>(from[r].data()));
    }
    return from;
  }
  /// The bytes of `value` on the root become those of all ranks.
  void broadcast(std::vector<std::byte>& value, int root = 0) const;

 private:
  template <class T>
  [[nodiscard]] T reduce(T value, MPI_Op op) const {
    T result{};
    MPI_Allreduce(&value, &result, 1, datatype<T>(), op, handle_);
    return result;
  }
  [[nodiscard]] std::vector<std::byte> allgather_bytes(std::span<const std::byte> mine) const;
  [[nodiscard]] std::vector<std::vector<std::byte>> alltoall_bytes(const std::vector<std::vector<std::byte>>& to) const;

  MPI_Comm handle_;
  int rank_ = 0;
  int size_ = 1;
};

}  // namespace breccia::mpi

#include "mpi/comm.hpp"

#include <numeric>

namespace breccia::mpi {

template <>
MPI_Datatype datatype<double>() {
  return MPI_DOUBLE;
}
template <>
MPI_Datatype datatype<float>() {
  return MPI_FLOAT;
}
template <>
MPI_Datatype datatype<std::int32_t>() {
  return MPI_INT32_T;
}
template <>
MPI_Datatype datatype<std::int64_t>() {
  return MPI_INT64_T;
}
template <>
MPI_Datatype datatype<std::uint64_t>() {
  return MPI_UINT64_T;
}
template <>
MPI_Datatype datatype<std::uint32_t>() {
  return MPI_UINT32_T;
}

Comm::Comm(MPI_Comm handle) : handle_(handle) {
  MPI_Comm_rank(handle_, &rank_);
  MPI_Comm_size(handle_, &size_);
}

void Comm::barrier() const { MPI_Barrier(handle_); }

std::uint64_t Comm::exclusive_scan(std::uint64_t value) const {
  std::uint64_t result = 0;
  MPI_Exscan(&value, &result, 1, MPI_UINT64_T, MPI_SUM, handle_);
  return rank_ == 0 ? 0 : result;
}

namespace {

// Displacements of consecutive blocks of these lengths, and their total.
std::vector<int> displacements(const std::vector<int>& counts) {
  std::vector<int> at(counts.size(), 0);
  std::exclusive_scan(counts.begin(), counts.end(), at.begin(), 0);
  return at;
}

}  // namespace

std::vector<std::byte> Comm::allgather_bytes(std::span<const std::byte> mine) const {
  const std::vector<int> counts = allgather(static_cast<int>(mine.size()));
  const std::vector<int> at = displacements(counts);
  std::vector<std::byte> all(static_cast<std::size_t>(at.back() + counts.back()));
  MPI_Allgatherv(mine.data(), static_cast<int>(mine.size()), MPI_BYTE, all.data(), counts.data(), at.data(), MPI_BYTE,
                 handle_);
  return all;
}

std::vector<std::vector<std::byte>> Comm::alltoall_bytes(const std::vector<std::vector<std::byte>>& to) const {
  std::vector<int> send_counts(to.size());
  std::vector<int> receive_counts(to.size());
  for (std::size_t r = 0; r < to.size(); ++r) send_counts[r] = static_cast<int>(to[r].size());
  MPI_Alltoall(send_counts.data(), 1, MPI_INT, receive_counts.data(), 1, MPI_INT, handle_);

  std::vector<std::vector<std::byte>> from(to.size());
  std::vector<MPI_Request> requests;
  for (std::size_t r = 0; r < to.size(); ++r) {
    from[r].resize(static_cast<std::size_t>(receive_counts[r]));
    if (from[r].empty()) continue;
    requests.emplace_back();
    MPI_Irecv(from[r].data(), receive_counts[r], MPI_BYTE, static_cast<int>(r), 0, handle_, &requests.back());
  }
  for (std::size_t r = 0; r < to.size(); ++r) {
    if (to[r].empty()) continue;
    requests.emplace_back();
    MPI_Isend(to[r].data(), send_counts[r], MPI_BYTE, static_cast<int>(r), 0, handle_, &requests.back());
  }
  MPI_Waitall(static_cast<int>(requests.size()), requests.data(), MPI_STATUSES_IGNORE);
  return from;
}

void Comm::broadcast(std::vector<std::byte>& value, int root) const {
  std::uint64_t size = value.size();
  MPI_Bcast(&size, 1, MPI_UINT64_T, root, handle_);
  value.resize(size);
  MPI_Bcast(value.data(), static_cast<int>(size), MPI_BYTE, root, handle_);
}

}  // namespace breccia::mpi

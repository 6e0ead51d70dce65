#include "gravity/mesh/planes.hpp"

#include <algorithm>

namespace breccia::gravity {
namespace {

PlaneRange overlap(PlaneRange a, PlaneRange b) {
  const int begin = std::max(a.begin, b.begin);
  return {begin, std::max(begin, std::min(a.end, b.end))};
}

// First value of plane x.
template <class Real>
Real* at(PlaneStack<Real> stack, int x, std::size_t plane) {
  return stack.values + static_cast<std::size_t>(x - stack.range.begin) * plane;
}

std::size_t values_in(PlaneRange range, std::size_t plane) { return static_cast<std::size_t>(range.count()) * plane; }

// The planes of `mine` that each rank wants.
template <class Real>
std::vector<std::vector<Real>> packed(PlaneStack<const Real> mine, std::span<const PlaneRange> wanted,
                                      std::size_t plane) {
  std::vector<std::vector<Real>> to(wanted.size());
  for (std::size_t r = 0; r < wanted.size(); ++r) {
    const PlaneRange common = overlap(mine.range, wanted[r]);
    if (common.count() == 0) continue;
    const Real* from = at(mine, common.begin, plane);
    to[r].assign(from, from + values_in(common, plane));
  }
  return to;
}

template <class Real>
double bytes_to_others(const std::vector<std::vector<Real>>& to, const mpi::Comm& comm) {
  double bytes = 0.0;
  for (std::size_t r = 0; r < to.size(); ++r) {
    if (static_cast<int>(r) != comm.rank()) bytes += static_cast<double>(to[r].size() * sizeof(Real));
  }
  return bytes;
}

}  // namespace

template <class Real>
double add_to_owners(PlaneStack<const Real> mine, std::span<const PlaneRange> owners, PlaneStack<Real> owned,
                     std::size_t plane, const mpi::Comm& comm) {
  const std::vector<PlaneRange> senders = comm.allgather(mine.range);
  const auto to = packed(mine, owners, plane);
  const auto from = comm.alltoall(to);
  std::fill_n(owned.values, values_in(owned.range, plane), Real(0));
  for (std::size_t r = 0; r < senders.size(); ++r) {
    if (from[r].empty()) continue;
    Real* sum = at(owned, overlap(senders[r], owned.range).begin, plane);
    for (std::size_t i = 0; i < from[r].size(); ++i) sum[i] += from[r][i];
  }
  return bytes_to_others(to, comm);
}

template <class Real>
double fetch_from_owners(PlaneStack<const Real> owned, std::span<const PlaneRange> owners, PlaneStack<Real> mine,
                         std::size_t plane, const mpi::Comm& comm) {
  const bool here = overlap(mine.range, owned.range).count() == mine.range.count();
  if (here && mine.range.count() > 0)
    std::copy_n(at(owned, mine.range.begin, plane), values_in(mine.range, plane), mine.values);
  const std::vector<PlaneRange> wanted = comm.allgather(here ? PlaneRange{} : mine.range);
  const auto to = packed(owned, wanted, plane);
  const auto from = comm.alltoall(to);
  for (std::size_t r = 0; r < from.size(); ++r) {
    if (from[r].empty()) continue;
    std::copy_n(from[r].data(), from[r].size(), at(mine, overlap(owners[r], mine.range).begin, plane));
  }
  return bytes_to_others(to, comm);
}

template double add_to_owners(PlaneStack<const float>, std::span<const PlaneRange>, PlaneStack<float>, std::size_t,
                              const mpi::Comm&);
template double add_to_owners(PlaneStack<const double>, std::span<const PlaneRange>, PlaneStack<double>, std::size_t,
                              const mpi::Comm&);
template double fetch_from_owners(PlaneStack<const float>, std::span<const PlaneRange>, PlaneStack<float>, std::size_t,
                                  const mpi::Comm&);
template double fetch_from_owners(PlaneStack<const double>, std::span<const PlaneRange>, PlaneStack<double>,
                                  std::size_t, const mpi::Comm&);

}  // namespace breccia::gravity

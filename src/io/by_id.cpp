#include "io/by_id.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "breccia/error.hpp"
#include "io/collectively.hpp"

namespace breccia::io {

h5::Rows share_of(int rank, int ranks, std::uint64_t total, std::uint64_t block_rows) {
  const std::uint64_t blocks = (total + block_rows - 1) / block_rows;
  const auto bound = [&](int r) {
    const std::uint64_t block = blocks * static_cast<std::uint64_t>(r) / static_cast<std::uint64_t>(ranks);
    return std::min(total, block * block_rows);
  };
  return {bound(rank), bound(rank + 1) - bound(rank)};
}

ById::ById(std::span<const std::uint64_t> ids, std::uint64_t block_rows, const mpi::Comm& comm)
    : comm_(comm), total_(comm.sum<std::uint64_t>(ids.size())) {
  rows_ = share_of(comm.rank(), comm.size(), total_, block_rows);
  std::vector<std::uint64_t> ends;
  for (int r = 0; r < comm.size(); ++r) {
    const h5::Rows share = share_of(r, comm.size(), total_, block_rows);
    ends.push_back(share.first + share.count);
  }
  destination_.reserve(ids.size());
  collectively(comm, [&] {
    for (const std::uint64_t id : ids) {
      if (id >= total_)
        throw NumericsError(fmt::format("particle id {} among {} particles: ids must be 0 to N-1", id, total_));
      destination_.push_back(static_cast<std::int32_t>(std::ranges::upper_bound(ends, id) - ends.begin()));
    }
  });
  learn_places(ids);
}

void ById::learn_places(std::span<const std::uint64_t> ids) {
  const std::uint64_t rounds = comm_.max<std::uint64_t>((ids.size() + kRound - 1) / kRound);
  std::vector<bool> seen(rows_.count, false);
  collectively(comm_, [&] {
    std::optional<Error> error;
    for (std::uint64_t round = 0; round < rounds; ++round) {
      places_.push_back(comm_.alltoall(parcels(ids, round)));
      for (std::vector<std::uint64_t>& places : places_.back()) {
        for (std::uint64_t& place : places) {
          place -= rows_.first;
          if (seen[place]) error = NumericsError(fmt::format("particle id {} occurs twice", place + rows_.first));
          seen[place] = true;
        }
      }
    }
    if (error) throw Error(*error);
  });
}

}  // namespace breccia::io

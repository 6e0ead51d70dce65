// Friends-of-friends groups over all ranks (physics.md 7).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "analysis/local_friends.hpp"
#include "breccia/linalg.hpp"
#include "mpi/comm.hpp"

namespace breccia::analysis {

/// Groups of particles connected by steps shorter than `link` [m]: for each particle of this rank the smallest id of
/// its group, the same on any number of ranks. `id` are unique over the ranks. Collective; a rank may be empty.
/// `cost`, if not null, receives what this rank did. Throws UsageError for a link length that is not positive and
/// NumericsError for positions that are not finite, the same on all ranks.
std::vector<std::uint64_t> find_groups(std::span<const Vec3d> position, std::span<const std::uint64_t> id, double link,
                                       const mpi::Comm& comm, FriendsCost* cost = nullptr);

}  // namespace breccia::analysis

// Which particles are behind a sum that went wrong.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "breccia/particle_arrays.hpp"
#include "mpi/comm.hpp"

namespace breccia::sim {

/// The ids below `total` that are on no rank, lowest first and a few at most: "3, 17, 18 and 40 others". `ids` are
/// those of this rank. Collective.
[[nodiscard]] std::string missing_ids(std::span<const std::uint64_t> ids, std::uint64_t total, const mpi::Comm& comm);

/// The lowest id of a particle with a value that is not finite; none if there is no such. Collective.
[[nodiscard]] std::optional<std::uint64_t> not_finite(const ParticleOutput& particles, const mpi::Comm& comm);

}  // namespace breccia::sim

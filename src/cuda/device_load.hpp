// What the particles of a rank will take of a device's grid, known before they are there.
#pragma once

#include "breccia/engine_state.hpp"
#include "cuda/device_memory.hpp"
#include "cuda/sort_kernels.hpp"
#include "grid/layout.hpp"
#include "mpi/slabs.hpp"

namespace breccia::cuda {

/// The planes of blocks that are a rank's.
OwnPlanes planes_of_rank(const mpi::Slabs& slabs, int rank);

/// Tiles and blocks as DeviceGrid::sort() will find them: a tile for each block of particles that are not alone, and
/// the blocks that those particles can reach.
Load count_load(const EngineState& state, std::uint64_t flaws, const grid::Periodicity& periodicity,
                bool lone_without_grid, const OwnPlanes& planes);

}  // namespace breccia::cuda

// How much memory of a device a rank takes, and whether there is as much.
#pragma once

#include <cstdint>
#include <string>

#include "breccia/precision.hpp"
#include "mpi/comm.hpp"

namespace breccia::cuda {

/// What a rank holds.
struct Load {
  std::uint64_t particles = 0;
  std::uint64_t lone = 0;  ///< of them, without a tile
  std::uint64_t tiles = 0;
  std::uint64_t blocks = 0;
  std::uint64_t shared = 0;  ///< sums of blocks that go to other ranks, at most
  std::uint64_t flaws = 0;
};

/// All arrays of the engine, those of sortings, outputs and of the exchange between ranks included [bytes]. `record`:
/// bytes of a particle's fields.
template <class P>
std::uint64_t bytes_needed(std::size_t record, const Load& load);

/// Throws UsageError on all ranks if the ranks that share a device need more than it has free, with both figures and
/// `what` it is for. Collective.
void require_memory(std::uint64_t needed, const std::string& what, const mpi::Comm& comm);

/// Ranks that use the device of this one. Collective.
int ranks_on_device(const mpi::Comm& comm);

}  // namespace breccia::cuda

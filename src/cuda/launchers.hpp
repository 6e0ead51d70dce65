// The kernels as the engine calls them, from files that no CUDA compiler reads. All of them only enqueue.
#pragma once

#include <string>

#include "cuda/device_runtime.hpp"
#include "cuda/step_arguments.hpp"

namespace breccia::cuda {

inline constexpr int kPassThreads = 128;
/// Thread blocks of the tile pass that shall fit a multiprocessor at a time, by shared memory and registers.
template <class Real>
inline constexpr int kPassBlocks = sizeof(Real) == 4 ? 4 : 2;

constexpr unsigned blocks_for(unsigned items, unsigned threads) { return (items + threads - 1) / threads; }

/// Allows the shared memory of the tile pass; why the current device cannot run it, or nothing.
template <class Real>
std::string why_no_tile_pass();
/// The same, once for an engine. Throws UsageError with the reason. This and the next two load their kernels.
template <class Real>
void prepare_tile_pass();
template <class Real>
void prepare_lone_pass();
template <class Real>
void prepare_node_update();
/// The whole pass over the particles in tiles (tile_pass.cuh), or over some of them; no tiles: nothing.
template <class Real>
void launch_tile_pass(const PassArguments<Real>& a, cudaStream_t stream);
/// The whole pass over lone particles (lone_pass.cuh).
template <class Real>
void launch_lone_pass(const PassArguments<Real>& a, cudaStream_t stream);
/// to[n][kSums][64] := sums of this rank's tiles at the nodes of blocks[n].
template <class Real>
void launch_collect_shared(const GridView<Real>& grid, const unsigned* blocks, unsigned count, Real* to,
                           cudaStream_t stream);
/// v^{n+1/2} = v^{n-1/2} + kick f/m at every node of every block, walls included.
template <class Real>
void launch_node_update(const NodeArguments<Real>& a, cudaStream_t stream);

}  // namespace breccia::cuda

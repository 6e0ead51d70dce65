// Works and moves of the threads of a block, added in a fixed order.
#pragma once

#include "cuda/device_runtime.hpp"
#include "cuda/launchers.hpp"
#include "cuda/particle_update.hpp"

namespace breccia::cuda {

struct ThreadWork {
  double plastic = 0;  ///< [J]
  double viscous = 0;  ///< [J]
  double moved = 0;    ///< [cells]

  template <class Real>
  BRECCIA_HD void add(const Found<Real>& f) {
    plastic += static_cast<double>(f.plastic_work);
    viscous += static_cast<double>(f.viscous_work);
    moved = max(moved, static_cast<double>(f.moved));
  }
};

/// Called by the first warp of the block, whose threads number kPassThreads.
__device__ inline void add_work(const ThreadWork* of_thread, int lane, PassSums& sums) {
  ThreadWork w;
  for (int n = lane; n < kPassThreads; n += 32) {
    w.plastic += of_thread[n].plastic;
    w.viscous += of_thread[n].viscous;
    w.moved = max(w.moved, of_thread[n].moved);
  }
  for (unsigned half = 16; half > 0; half /= 2) {
    w.plastic += __shfl_down_sync(0xffffffffU, w.plastic, half);
    w.viscous += __shfl_down_sync(0xffffffffU, w.viscous, half);
    w.moved = max(w.moved, __shfl_down_sync(0xffffffffU, w.moved, half));
  }
  if (lane != 0) return;
  sums.plastic_work += w.plastic;
  sums.viscous_work += w.viscous;
  sums.largest_move = w.moved;
}

}  // namespace breccia::cuda

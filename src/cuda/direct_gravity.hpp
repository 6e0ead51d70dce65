// Every pair, summed on the device.
#pragma once

#include "cuda/device_array.hpp"
#include "cuda/gravity_kernels.hpp"
#include "cuda/launchers.hpp"

namespace breccia::cuda {

/// How sources are shared out among thread blocks: `count` slices of `tiles` tiles each.
struct DirectSlices {
  unsigned tiles = 0, count = 0;
};
constexpr DirectSlices direct_slices(unsigned targets, unsigned sources) {
  constexpr unsigned wanted = 1024;  // thread blocks that fill any device
  if (targets == 0 || sources == 0) return {};
  const unsigned all = blocks_for(sources, kTileSources);
  const unsigned shares = blocks_for(wanted, blocks_for(targets, kTileSources));
  const unsigned tiles = blocks_for(all, shares < all ? shares : all);
  return {tiles, blocks_for(all, tiles)};
}

/// Targets are the sources [first, first + targets).
struct DirectArguments {
  BodyArrays sources;
  unsigned first = 0;
  unsigned targets = 0;
  double mass_unit = 1;  ///< [kg]
  double softening = 0;  ///< [m]
};

/// acceleration[3][targets] [m/s2] by Newton's law softened after Plummer, with Real arithmetic on
/// coordinates from places near the sources, exact where these are far apart. `scratch` is working memory.
template <class Real>
void launch_direct_sum(const DirectArguments& a, double* acceleration, DeviceArray<double>& scratch,
                       cudaStream_t stream);

}  // namespace breccia::cuda

// Every pair, summed on the device.
#pragma once

#include "cuda/device_array.hpp"
#include "cuda/gravity_kernels.hpp"

namespace breccia::cuda {

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

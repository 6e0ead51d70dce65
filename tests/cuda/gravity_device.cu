// The short-range law of the particle mesh compiled for CUDA threads, one target a thread.
#include "breccia/linalg.hpp"
#include "gravity/mesh/split.hpp"

namespace breccia::gravity {

template <class R>
__global__ void sum_short_range(const Vec3<R>* sources, const R* masses, int count, const Vec3<R>* targets,
                                ShortRange<R> law, Vec3<R>* acceleration) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  const ShortRangePair<8, R, R> pair(law);
  Vec3<R> sum{};
  for (int j = 0; j < count; ++j) {
    const Vec3<R> d = sources[j] - targets[i];
    const R rho2 = dot(d, d) + law.softening_squared;
    if (rho2 < law.cutoff_squared) sum += (masses[j] * pair.force(rho2, R(1) / std::sqrt(rho2))) * d;
  }
  acceleration[i] = sum;
}
template __global__ void sum_short_range<float>(const Vec3<float>*, const float*, int, const Vec3<float>*,
                                                ShortRange<float>, Vec3<float>*);
template __global__ void sum_short_range<double>(const Vec3<double>*, const double*, int, const Vec3<double>*,
                                                 ShortRange<double>, Vec3<double>*);

}  // namespace breccia::gravity

// Gravity's interactions compiled for CUDA threads, one target a thread: particle with particle (whole and
// short-range), particle with cell, cell with cell, and the rule of when a cell is opened.
#include "gravity/mesh/split.hpp"
#include "gravity/pair_law.hpp"
#include "gravity/tree/multipole.hpp"
#include "gravity/tree/opening.hpp"

namespace breccia::gravity {

template <class R>
struct Source {
  Vec3<R> position;
  Moments<R> moments;
};

template <class R>
__device__ R inverse_distance(Vec3<R> d, R softening_squared) {
  return R(1) / std::sqrt(dot(d, d) + softening_squared);
}

template <class R>
__global__ void sum_sources(const Source<R>* sources, int count, const Vec3<R>* targets, R softening_squared,
                            Vec3<R>* acceleration) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  Vec3<R> sum{};
  for (int j = 0; j < count; ++j) {
    const Vec3<R> d = sources[j].position - targets[i];
    const R q = inverse_distance(d, softening_squared);
    if (sources[j].moments.second.xx == R(0)) {
      sum += (sources[j].moments.mass * newton_pair(q).force) * d;
    } else {
      sum += field_of(sources[j].moments, targets[i] - sources[j].position, q).gradient;
    }
  }
  acceleration[i] = sum;
}

template <class R>
__global__ void sum_short_range(const Source<R>* sources, int count, const Vec3<R>* targets, ShortRange<R> law,
                                Vec3<R>* acceleration) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  const ShortRangePair<8, R, R> pair(law);
  Vec3<R> sum{};
  for (int j = 0; j < count; ++j) {
    const Vec3<R> d = sources[j].position - targets[i];
    const R rho2 = dot(d, d) + law.softening_squared;
    if (rho2 < law.cutoff_squared) sum += (sources[j].moments.mass * pair.force(rho2, R(1) / std::sqrt(rho2))) * d;
  }
  acceleration[i] = sum;
}

// One expansion from all sources that may be expanded, passed on and evaluated.
template <class R>
__global__ void expand(const Cell* cells, int count, const Cell* targets, double allowed, R softening_squared,
                       Vec3<R> r, Vec3<R>* acceleration) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  LocalExpansion<R> l{};
  for (int j = 0; j < count; ++j) {
    if (opening(cells[j], targets[i], allowed) != Opening::kExpand) continue;
    const Vec3d d = targets[i].centre - cells[j].centre;
    const Vec3<R> x{static_cast<R>(d.x), static_cast<R>(d.y), static_cast<R>(d.z)};
    const Sym3<double>& s = cells[j].moments.second;
    const Moments<R> source{static_cast<R>(cells[j].moments.mass),
                            {static_cast<R>(s.xx), static_cast<R>(s.yy), static_cast<R>(s.zz), static_cast<R>(s.xy),
                             static_cast<R>(s.xz), static_cast<R>(s.yz)}};
    add_field_of(source, x, inverse_distance(x, softening_squared), l);
  }
  acceleration[i] = evaluate(shifted(l, R(0.5) * r), R(0.5) * r).gradient;
}

#define BRECCIA_INSTANTIATE(R)                                                                                 \
  template __global__ void sum_sources<R>(const Source<R>*, int, const Vec3<R>*, R, Vec3<R>*);                 \
  template __global__ void sum_short_range<R>(const Source<R>*, int, const Vec3<R>*, ShortRange<R>, Vec3<R>*); \
  template __global__ void expand<R>(const Cell*, int, const Cell*, double, R, Vec3<R>, Vec3<R>*);
BRECCIA_INSTANTIATE(float)
BRECCIA_INSTANTIATE(double)
#undef BRECCIA_INSTANTIATE

}  // namespace breccia::gravity

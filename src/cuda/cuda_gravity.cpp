#include "cuda/cuda_gravity.hpp"

#include <array>
#include <cmath>
#include <utility>

#include "cuda/direct_gravity.hpp"
#include "gravity/evaluation.hpp"

namespace breccia::cuda {

using gravity::Phase;

template <class Real>
CudaGravity<Real>::CudaGravity(GravityMethod method, const gravity::Parameters& parameters, Particles particles,
                               const mpi::Comm& comm, cudaStream_t stream)
    : method_(method),
      parameters_(parameters),
      particles_(std::move(particles)),
      comm_(comm),
      stream_(stream),
      bodies_(comm, stream) {}

template <class Real>
bool CudaGravity<Real>::has(GravityMethod method) {
  return method == GravityMethod::kDirect;
}

template <class Real>
void CudaGravity<Real>::choose_method() {
  stats_ = {.method = method_};
}

template <class Real>
void CudaGravity<Real>::evaluate_and_hold(double time) {
  const PredictArguments<Real> own = particles_(time);
  choose_method();
  const gravity::Stopwatch watch(stats_.seconds);
  stats_.phases.time(Phase::kExchange, [&] { bodies_.gather(own); });
  stats_.bytes_sent = bodies_.bytes_sent();
  const Extremes extremes = bodies_.extremes();
  const double mass_unit = extremes.of[6] > 0.0 ? extremes.of[6] : 1.0;

  acceleration_.reserve(3 * std::size_t{own.count});
  stats_.phases.time(Phase::kPairs, [&] { sum_directly(mass_unit); });
  const Vec3d net = net_force(own);
  launch_hold(acceleration_.data(), net, own.particles, own.count, stream_);
}

template <class Real>
void CudaGravity<Real>::sum_directly(double mass_unit) {
  const BodyArrays all = bodies_.all();
  launch_direct_sum<Real>({all, bodies_.first(), bodies_.own(), mass_unit, parameters_.softening}, acceleration_.data(),
                          scratch_, stream_);
  stats_.pairs = static_cast<double>(bodies_.own()) * static_cast<double>(all.count);
}

// Books the momentum error; returns what is to be taken off each particle, as a share of its |a|.
template <class Real>
Vec3d CudaGravity<Real>::net_force(const PredictArguments<Real>& own) {
  net_forces_.reserve(kReducers);
  launch_net_force(acceleration_.data(), own.particles.mass, own.count, net_forces_.data(), stream_);
  std::array<double, 4> sums{};
  for (const NetForce& part : net_forces_.download(kReducers, stream_)) {
    for (std::size_t k = 0; k < 4; ++k) sums[k] += part.of[k];
  }
  comm_.sum(std::span<double>(sums));
  const Vec3d net{sums[0], sums[1], sums[2]};
  if (!(sums[3] > 0.0)) return {};
  stats_.momentum_error = std::sqrt(dot(net, net)) / sums[3];
  if (stats_.method == GravityMethod::kDirect) return {};  // pairwise: what there is of it is rounding
  stats_.net_force_removed = net;
  return (1.0 / sums[3]) * net;
}

template class CudaGravity<float>;
template class CudaGravity<double>;

}  // namespace breccia::cuda

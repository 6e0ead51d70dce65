#include "cuda/cuda_gravity.hpp"

#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "breccia/constants.hpp"
#include "cuda/device_memory.hpp"
#include "cuda/direct_gravity.hpp"
#include "cuda/gravity_choice.hpp"
#include "cuda/gravity_memory.hpp"
#include "gravity/evaluation.hpp"
#include "gravity/mesh/layout.hpp"
#include "gravity/mesh/settings.hpp"
#include "gravity/method.hpp"
#include "gravity/tree/tolerance.hpp"
#include "gravity/tree/tree.hpp"

namespace breccia::cuda {

using gravity::Phase;

namespace {

double mass_unit_of(const Extremes& extremes) { return extremes.of[6] > 0.0 ? extremes.of[6] : 1.0; }

}  // namespace

template <class Real>
CudaGravity<Real>::CudaGravity(GravityMethod method, const gravity::Parameters& parameters, Particles particles,
                               const mpi::Comm& comm, cudaStream_t stream)
    : method_(method),
      parameters_(method == GravityMethod::kTreePm || method == GravityMethod::kAuto
                      ? gravity::with_checked_mesh(parameters)
                      : parameters),
      particles_(std::move(particles)),
      comm_(comm),
      stream_(stream),
      bodies_(comm, stream),
      census_(stream),
      sets_(stream),
      unsplit_(comm, stream) {}

// By the host, from what the device counts.
template <class Real>
gravity::Layout CudaGravity<Real>::lay_boxes(double heaviest) {
  gravity::Layout layout;
  stats_.phases.time(Phase::kBoxes, [&] {
    census_.take(bodies_.own_bodies(), heaviest);
    layout = gravity::lay_boxes(census_, parameters_.mesh, comm_);
  });
  return layout;
}

template <class Real>
bool CudaGravity<Real>::needs_boxes(std::uint64_t particles) const {
  if (method_ != GravityMethod::kAuto) return method_ == GravityMethod::kTreePm;
  return choice_needs_boxes(particles, parameters_, kDeviceRates<Real>, comm_.size());
}

template <class Real>
gravity::MethodChoice CudaGravity<Real>::choose_method(std::uint64_t particles, double heaviest,
                                                       gravity::Layout& layout) {
  const bool with_boxes = needs_boxes(particles);
  if (with_boxes) layout = lay_boxes(heaviest);
  if (method_ != GravityMethod::kAuto) return {method_, ""};
  const gravity::Matter matter = with_boxes ? gravity::matter_of(layout) : gravity::Matter{.particles = particles};
  return cheapest_on_device(matter, parameters_, kDeviceRates<Real>, comm_.size());
}

template <class Real>
void CudaGravity<Real>::require_memory() {
  const PredictArguments<Real> own = particles_(0.0);
  const std::uint64_t all = comm_.sum(std::uint64_t{own.count});
  const bool seeks_boxes = needs_boxes(all);
  double heaviest = 1.0;
  if (seeks_boxes) {
    bodies_.gather(own);
    heaviest = mass_unit_of(bodies_.extremes());
  }
  gravity::Layout layout;
  const GravityMethod method = choose_method(all, heaviest, layout).method;
  GravityLoad load{.own = own.count,
                   .all = all,
                   .ranks = comm_.size(),
                   .seeks_boxes = seeks_boxes,
                   .opening = gravity::opening_for(parameters_, static_cast<double>(all))};
  for (std::size_t k = 0; k < layout.boxes.size(); ++k) {
    load.boxes.push_back({layout.count[k + 1], gravity::MeshGeometry(layout.boxes[k], layout.cell).size});
  }
  bodies_.forget();  // they are counted
  census_.forget();
  cuda::require_memory(bytes_for_gravity<Real>(method, load), "gravity beside the particles", comm_);
}

template <class Real>
void CudaGravity<Real>::evaluate_and_hold(double time) {
  const PredictArguments<Real> own = particles_(time);
  stats_ = {};
  const gravity::Stopwatch watch(stats_.seconds);
  stats_.phases.time(Phase::kExchange, [&] { bodies_.gather(own); });
  stats_.bytes_sent = bodies_.bytes_sent();
  const Extremes extremes = bodies_.extremes();
  const double mass_unit = mass_unit_of(extremes);

  acceleration_.reserve(3 * std::size_t{own.count});
  gravity::Layout layout;
  const gravity::MethodChoice choice = choose_method(bodies_.all().count, mass_unit, layout);
  if (layout.spacing > 0.0) parameters_.mesh.particle_spacing = layout.spacing;
  stats_.method = choice.method;
  stats_.reason = choice.reason;
  if (stats_.method == GravityMethod::kDirect) {
    stats_.phases.time(Phase::kPairs, [&] { sum_directly(mass_unit); });
  } else {
    acceleration_.fill_bytes(0, stream_);
    const BodyArrays all = bodies_.all();
    if (stats_.method == GravityMethod::kTree) {
      sum_unsplit({&all, 1}, extremes, mass_unit);
    } else {
      sum_by_mesh(layout, extremes, mass_unit);
    }
  }
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

template <class Real>
void CudaGravity<Real>::sum_unsplit(std::span<const BodyArrays> sets, const Extremes& extremes, double mass_unit) {
  if (bodies_.all().count == 0) return;
  const double(&e)[7] = extremes.of;
  unsplit_.add_field(sets,
                     {.root = gravity::random_root({-e[3], -e[4], -e[5]}, {e[0], e[1], e[2]}),
                      .mass_unit = mass_unit,
                      .softening = parameters_.softening,
                      .tolerance = gravity::opening_for(parameters_, static_cast<double>(bodies_.all().count)),
                      .first = bodies_.first(),
                      .own = bodies_.own()},
                     acceleration_.data(), stats_);
}

template <class Real>
void CudaGravity<Real>::sum_by_mesh(const gravity::Layout& layout, const Extremes& extremes, double mass_unit) {
  stats_.phases.time(Phase::kBoxes, [&] { sets_.divide(bodies_.all(), layout.boxes); });
  const std::span<const BodyArrays> sets = sets_.sets();
  stats_.boxes = static_cast<int>(layout.boxes.size());
  while (boxes_.size() < layout.boxes.size()) boxes_.push_back(std::make_unique<BoxGravity<Real>>(comm_, stream_));
  for (std::size_t k = 0; k < layout.boxes.size(); ++k) {
    boxes_[k]->add_field(sets[k + 1],
                         {.box = layout.boxes[k],
                          .cell = layout.cell,
                          .spacing = layout.spacing,
                          .split = gravity::split_of_box(parameters_, layout.cell, layout.count[k + 1]),
                          .mass_unit = mass_unit},
                         bodies_.first(), bodies_.own(), acceleration_.data(), stats_);
  }
  const bool all_in_one = stats_.boxes == 1 && sets[0].count == 0;
  if (!all_in_one) sum_unsplit(sets, extremes, mass_unit);
  stats_.bytes_sent += stats_.phases.bytes_sent;
}

// Books the momentum error; returns what is to be taken off each particle, as a share of its |a|.
template <class Real>
Vec3d CudaGravity<Real>::net_force(const PredictArguments<Real>& own) {
  net_forces_.reserve(reducers(own.count));
  launch_net_force(acceleration_.data(), own.particles.mass, own.count, net_forces_.data(), stream_);
  std::array<double, 4> sums{};
  for (const NetForce& part : net_forces_.download(reducers(own.count), stream_)) {
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

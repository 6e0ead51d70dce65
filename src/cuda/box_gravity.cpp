#include "cuda/box_gravity.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "breccia/constants.hpp"

namespace breccia::cuda {
namespace {

using gravity::Phase;

MeshNodes nodes_of(const gravity::MeshGeometry& geometry, double spacing) {
  // A cluster as wide as high.
  const double wanted = std::cbrt(static_cast<double>(kClusterBodies)) * spacing / geometry.spacing;
  MeshNodes nodes;
  nodes.origin = geometry.origin;
  nodes.per_cell = 1.0 / geometry.spacing;
  nodes.column = static_cast<int>(std::clamp(std::round(wanted), 1.0, 32.0));
  std::copy(std::begin(geometry.size.nodes), std::end(geometry.size.nodes), nodes.nodes);
  for (int axis = 0; axis < 2; ++axis) nodes.columns[axis] = (nodes.nodes[axis] + nodes.column - 1) / nodes.column;
  const double keys = 1.0 * nodes.columns[0] * nodes.columns[1] * nodes.nodes[2] * nodes.column * nodes.column;
  if (keys > 0.5 * std::numeric_limits<unsigned>::max()) {
    throw UsageError("gravity.mesh: " + std::to_string(keys) + " mesh cells are more than a device can number; use a " +
                     "larger gravity.mesh, or --device host");
  }
  return nodes;
}

}  // namespace

template <class Real>
void BoxGravity<Real>::add_field(const BodyArrays& all, const gravity::BoxSettings& settings, unsigned first,
                                 unsigned own, double* acceleration, gravity::Stats& stats) {
  const gravity::MeshGeometry geometry(settings.box, settings.cell);
  nodes_ = nodes_of(geometry, settings.spacing);
  stats.phases.time(Phase::kTransform, [&] { prepare_mesh(geometry.size, settings.split); });
  stats.phases.time(Phase::kSort, [&] { sort(all, settings, first, own); });
  const double unit = kGravitationalConstant * settings.mass_unit / (settings.cell * settings.cell);
  add_mesh_field(unit, own, acceleration, stats.phases);
  stats.phases.time(Phase::kPairs, [&] { add_near_field(unit, own, acceleration, stats); });
}

template <class Real>
void BoxGravity<Real>::prepare_mesh(const gravity::MeshSize& size, const gravity::GaussianSplit& split) {
  if (convolution_ && size_ == size && split_ == split) return;
  convolution_.reset();
  const double doubled = 1.0 * size.padded[0] * size.padded[1] * size.padded[2];
  const bool replicated = doubled <= gravity::MeshSharing{}.replicated_nodes;
  const mpi::Comm sharing = replicated ? mpi::Comm(MPI_COMM_SELF) : comm_;
  convolution_ = std::make_unique<DeviceConvolution<Real>>(size, gravity::mesh_kernel(split), sharing, stream_);
  law_ = gravity::fit_short_range<Real>(split);
  size_ = size;
  split_ = split;
}

template <class Real>
void BoxGravity<Real>::sort(const BodyArrays& all, const gravity::BoxSettings& settings, unsigned first, unsigned own) {
  count_ = all.count;
  keys_.reserve(count_);
  order_.reserve(count_);
  target_.reserve(count_);
  sorted_.reserve(4 * std::size_t{count_});
  first_.reserve(std::size_t{nodes_.key_count()} + 1);
  launch_mesh_keys(all, nodes_, keys_.data(), order_.data(), stream_);
  radix_sort(keys_, order_, count_, 0, std::bit_width(nodes_.key_count()), scratch_, stream_);
  first_of_keys(keys_.data(), count_, nodes_.key_count(), first_.data(), stream_);
  launch_arrange_in_mesh(all, nodes_, settings.mass_unit, first, own, order_.data(), bodies(), stream_);

  most_clusters_ = count_ / kClusterBodies + nodes_.column_count();
  cluster_first_.reserve(std::size_t{nodes_.column_count()} + 1);
  clusters_.reserve(most_clusters_);
  launch_count_clusters(nodes_, bodies(), clusters(), stream_);
  exclusive_scan(cluster_first_.data(), nodes_.column_count() + 1, scratch_, stream_);
  launch_bound_clusters(nodes_, bodies(), clusters(), stream_);
}

template <class Real>
void BoxGravity<Real>::add_mesh_field(double unit, unsigned own, double* acceleration, gravity::Phases& phases) {
  phases.time(Phase::kAssign, [&] { launch_assign_masses(nodes_, bodies(), convolution_->masses(), stream_); });
  phases.time(Phase::kTransform, [&] { convolution_->apply(); });
  phases.bytes_sent += convolution_->bytes_sent();
  phases.time(Phase::kInterpolate, [&] {
    field_.reserve(static_cast<std::size_t>(nodes_.nodes[0]) * static_cast<std::size_t>(nodes_.nodes[1]) *
                   static_cast<std::size_t>(nodes_.nodes[2]));
    launch_differences(nodes_, convolution_->potential(), field_.data(), stream_);
    launch_interpolate(nodes_, bodies(), field_.data(), unit, acceleration, own, stream_);
  });
}

template <class Real>
void BoxGravity<Real>::add_near_field(double unit, unsigned own, double* acceleration, gravity::Stats& stats) {
  pairs_.reserve(1);
  pairs_.fill_bytes(0, stream_);
  launch_sum_near<Real>({.nodes = nodes_,
                         .bodies = bodies(),
                         .clusters = clusters(),
                         .law = law_,
                         .unit = unit,
                         .acceleration = acceleration,
                         .own = own,
                         .pairs = pairs_.data()},
                        stream_);
  stats.pairs += static_cast<double>(pairs_.download(1, stream_)[0]);
}

template <class Real>
Clusters<Real> BoxGravity<Real>::clusters() const {
  return {cluster_first_.data(), clusters_.data(), most_clusters_};
}

template <class Real>
MeshBodies BoxGravity<Real>::bodies() const {
  const std::size_t n = count_;
  double* x = sorted_.data();
  return {{x, x + n, x + 2 * n}, x + 3 * n, target_.data(), count_, first_.data()};
}

template class BoxGravity<float>;
template class BoxGravity<double>;

}  // namespace breccia::cuda

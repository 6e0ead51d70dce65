#include "gravity/mesh/box_mesh.hpp"

#include <algorithm>
#include <cmath>

#include "gravity/mesh/mesh_kernels.hpp"
#include "gravity/mesh/planes.hpp"

namespace breccia::gravity {
namespace {

// TSC assignment and interpolation each smear by a cloud of variance 1/4 per axis: together as exp(-k^2/4). Dividing by
// the window in Fourier space is as accurate but rings around the kink where the periodic images of the kernel meet.
constexpr double kTscSmearing = 0.25;

// Columns in rows of x so wide that the nodes of every other row are disjoint: TSC reaches 1.5 cells to either side.
constexpr double kLeastRowWidth = 3.01;

// Groups of clusters that threads work off.
constexpr std::int64_t kClusterGroup = 32;

template <class Real>
PlaneRange touched_planes(const ClusterArrays<Real>& particles) {
  if (particles.count == 0) return {};
  Real low = particles.centre[0][0];
  Real high = low;
  for (std::int64_t c = 0; c < particles.count; ++c) {
    low = std::min(low, particles.centre[0][c] - particles.half[0][c]);
    high = std::max(high, particles.centre[0][c] + particles.half[0][c]);
  }
  return {static_cast<int>(std::lround(low)) - 1, static_cast<int>(std::lround(high)) + 2};
}

}  // namespace

Kernel mesh_kernel(const GaussianSplit& split) {
  return [split](int x, int y, int z) {
    return unsmeared_long_range_potential(split, kTscSmearing, std::sqrt(1.0 * x * x + 1.0 * y * y + 1.0 * z * z));
  };
}

template <class Real>
BoxMesh<Real>::BoxMesh(const MeshSize& size, const GaussianSplit& split, const mpi::Comm& comm, int threads,
                       const MeshSharing& sharing)
    : size_(size), comm_(comm), threads_(threads) {
  const double doubled = 1.0 * size.padded[0] * size.padded[1] * size.padded[2];
  const bool replicated = comm.size() == 1 || doubled <= sharing.replicated_nodes;
  const int active = replicated ? 1 : std::clamp(size.nodes[0] / sharing.least_planes, 1, comm.size());
  if (replicated) {
    MPI_Comm_dup(MPI_COMM_SELF, &transformers_);
    owners_.assign(static_cast<std::size_t>(comm.size()), PlaneRange{0, size.nodes[0]});
  } else {
    MPI_Comm_split(comm.handle(), comm.rank() < active ? 0 : MPI_UNDEFINED, comm.rank(), &transformers_);
    owners_.assign(static_cast<std::size_t>(comm.size()), PlaneRange{});
    for (int r = 0; r < active; ++r) {
      owners_[static_cast<std::size_t>(r)] = share_of_planes(size.nodes[0], active, r);
    }
  }
  if (transformers_ == MPI_COMM_NULL) return;
  convolution_ = std::make_unique<Convolution<Real>>(size, mesh_kernel(split), mpi::Comm(transformers_), threads);
}

template <class Real>
BoxMesh<Real>::~BoxMesh() {
  if (transformers_ != MPI_COMM_NULL) MPI_Comm_free(&transformers_);
}

template <class Real>
void BoxMesh<Real>::add_field(const Clusters<Real>& own, SlotField<Real>& field, Phases& phases) {
  phases.time(Phase::kAssign, [&] { assign(own); });
  phases.time(Phase::kTransform, [&] { exchange_and_convolve(phases); });
  phases.time(Phase::kInterpolate, [&] { interpolate_to(own, field); });
}

// Rows of columns are worked off in two sweeps, every other row at once: no two threads add to one node, and the order
// in which a node collects its masses does not depend on their number.
template <class Real>
void BoxMesh<Real>::assign(const Clusters<Real>& own) {
  const ClusterArrays<Real> particles = own.arrays();
  touched_ = touched_planes(particles);
  mass_.assign(static_cast<std::size_t>(touched_.count()) * plane() + 4, Real(0));
  const ClusterColumns columns = own.columns();
  const int columns_per_row = static_cast<int>(std::ceil(kLeastRowWidth / columns.width));
  const int rows = (columns.nx + columns_per_row - 1) / columns_per_row;
  for (int sweep = 0; sweep < 2; ++sweep) {
#pragma omp parallel for num_threads(threads_) schedule(dynamic, 1)
    for (int row = sweep; row < rows; row += 2) {
      const auto first_cluster = [&](int r) {
        return columns.first[std::min(r * columns_per_row, columns.nx) * columns.ny];
      };
      assign_masses(AssignTask<Real>{particles, first_cluster(row), first_cluster(row + 1), mass_.data(),
                                     touched_.begin, size_.nodes[1], size_.nodes[2]});
    }
  }
}

template <class Real>
void BoxMesh<Real>::exchange_and_convolve(Phases& phases) {
  const PlaneRange own = owners_[static_cast<std::size_t>(comm_.rank())];
  owned_.resize(static_cast<std::size_t>(own.count()) * plane());
  phases.bytes_sent += add_to_owners<Real>({touched_, mass_.data()}, owners_, {own, owned_.data()}, plane(), comm_);
  if (convolution_) {
    convolution_->apply(owned_.data());
    phases.bytes_sent += convolution_->bytes_sent();
  }
  const PlaneRange wanted = touched_.count() > 0 ? PlaneRange{touched_.begin - 3, touched_.end + 3} : PlaneRange{};
  potential_.resize(static_cast<std::size_t>(wanted.count()) * plane());
  phases.bytes_sent +=
      fetch_from_owners<Real>({own, owned_.data()}, owners_, {wanted, potential_.data()}, plane(), comm_);
}

template <class Real>
void BoxMesh<Real>::interpolate_to(const Clusters<Real>& own, SlotField<Real>& field) {
  nodes_.resize(4 * (static_cast<std::size_t>(touched_.count()) * plane() + 1));
#pragma omp parallel for num_threads(threads_) schedule(static)
  for (int x = 0; x < touched_.count(); ++x) {
    take_differences(DifferenceTask<Real>{potential_.data(), nodes_.data(), x, x + 1, size_.nodes[1], size_.nodes[2]});
  }
  const ClusterArrays<Real> particles = own.arrays();
#pragma omp parallel for num_threads(threads_) schedule(static)
  for (std::int64_t begin = 0; begin < particles.count; begin += kClusterGroup) {
    interpolate(InterpolateTask<Real>{particles,
                                      begin,
                                      std::min(begin + kClusterGroup, particles.count),
                                      nodes_.data(),
                                      touched_.begin,
                                      size_.nodes[1],
                                      size_.nodes[2],
                                      {field[0].data(), field[1].data(), field[2].data(), field[3].data()}});
  }
}

template class BoxMesh<float>;
template class BoxMesh<double>;

}  // namespace breccia::gravity

#include "gravity/evaluation.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "breccia/error.hpp"

namespace breccia::gravity {

void check_sizes(ParticlesView particles, std::span<const Vec3d> acceleration, std::span<const double> potential) {
  const std::size_t n = particles.position.size();
  if (particles.mass.size() != n || acceleration.size() != n || (!potential.empty() && potential.size() != n)) {
    throw UsageError("gravity: positions, masses, accelerations and potentials must be equally many");
  }
}

double heaviest(std::span<const double> mass, const mpi::Comm& comm) {
  const double mine = mass.empty() ? 0.0 : *std::max_element(mass.begin(), mass.end());
  const double all = comm.max(mine);
  return all > 0.0 ? all : 1.0;
}

namespace {

struct NetForce {
  Vec3d sum{};                ///< sum(m a)
  double sum_of_sizes = 0.0;  ///< sum(m |a|)
};

NetForce net_force(ParticlesView particles, std::span<const Vec3d> acceleration, const mpi::Comm& comm) {
  std::array<double, 4> sums{};
  for (std::size_t i = 0; i < acceleration.size(); ++i) {
    const Vec3d f = particles.mass[i] * acceleration[i];
    sums[0] += f.x;
    sums[1] += f.y;
    sums[2] += f.z;
    sums[3] += std::sqrt(dot(f, f));
  }
  comm.sum(std::span<double>(sums));
  return {{sums[0], sums[1], sums[2]}, sums[3]};
}

void book(const NetForce& net, Stats& stats) {
  stats.momentum_error = net.sum_of_sizes > 0.0 ? std::sqrt(dot(net.sum, net.sum)) / net.sum_of_sizes : 0.0;
}

}  // namespace

void book_momentum(ParticlesView particles, std::span<const Vec3d> acceleration, const mpi::Comm& comm, Stats& stats) {
  book(net_force(particles, acceleration, comm), stats);
}

void remove_net_force(ParticlesView particles, std::span<Vec3d> acceleration, const mpi::Comm& comm, Stats& stats) {
  const NetForce net = net_force(particles, acceleration, comm);
  book(net, stats);
  if (!(net.sum_of_sizes > 0.0)) return;
  stats.net_force_removed = net.sum;
  const Vec3d share = (1.0 / net.sum_of_sizes) * net.sum;
  for (Vec3d& a : acceleration) a -= std::sqrt(dot(a, a)) * share;
}

}  // namespace breccia::gravity

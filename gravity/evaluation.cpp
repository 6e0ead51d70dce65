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

Vec3d book_momentum(ParticlesView particles, std::span<const Vec3d> acceleration, const mpi::Comm& comm, Stats& stats) {
  std::array<double, 5> sums{};
  for (std::size_t i = 0; i < acceleration.size(); ++i) {
    const Vec3d f = particles.mass[i] * acceleration[i];
    sums[0] += f.x;
    sums[1] += f.y;
    sums[2] += f.z;
    sums[3] += std::sqrt(dot(f, f));
    sums[4] += particles.mass[i];
  }
  comm.sum(std::span<double>(sums));
  stats.momentum_error = sums[3] > 0.0 ? std::hypot(sums[0], sums[1], sums[2]) / sums[3] : 0.0;
  return sums[4] > 0.0 ? (1.0 / sums[4]) * Vec3d{sums[0], sums[1], sums[2]} : Vec3d{};
}

void remove_net_force(ParticlesView particles, std::span<Vec3d> acceleration, const mpi::Comm& comm, Stats& stats) {
  const Vec3d net = book_momentum(particles, acceleration, comm, stats);
  double mass = 0.0;
  for (const double m : particles.mass) mass += m;
  stats.net_force_removed = comm.sum(mass) * net;
  for (Vec3d& a : acceleration) a -= net;
}

}  // namespace breccia::gravity

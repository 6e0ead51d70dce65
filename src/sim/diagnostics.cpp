#include "sim/diagnostics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "breccia/error.hpp"
#include "grid/setup_choices.hpp"
#include "sim/compensated_sums.hpp"
#include "sim/suspects.hpp"

namespace breccia::sim {
namespace {

double length(Vec3d v) { return std::sqrt(dot(v, v)); }

double squared_norm(const Mat3<double>& c) {
  return c.xx * c.xx + c.xy * c.xy + c.xz * c.xz + c.yx * c.yx + c.yy * c.yy + c.yz * c.yz + c.zx * c.zx + c.zy * c.zy +
         c.zz * c.zz;
}

// Sums over the particles of one rank; a plain array for one reduction.
enum Sum {
  kMass,
  kPx,
  kPy,
  kPz,
  kLx,
  kLy,
  kLz,
  kKinetic,
  kAffine,
  kInternal,
  kElastic,
  kPlastic,
  kViscous,
  kClamped,
  kGravity,
  kDamaged,
  kMomentumScale,
  kAngularScale,
  kParticles,
  kBlocks,
  kSums
};

// P2G spreads v + C (x_i - x_p), so that the nodes have the particle's momentum and, as sum w (x_i - x_p)^2 = dx^2/4
// along each axis, angular momentum m dx^2/4 (C_zy - C_yz, ...) and energy m dx^2/4 C:C / 2 besides. G2P gives
// particles the share 1 - alpha of the nodes' velocity and alpha of what their own has changed by: without forces the
// angular momentum with that share of C's stays, and the energy with that share never grows.
double affine_moment(const Scene& scene) {
  const grid::TransferParameters transfer = grid::transfer_for(scene.numerics);
  return transfer.affine ? (1.0 - transfer.alpha) * 0.25 * scene.cell * scene.cell : 0.0;
}

}  // namespace

Budget::Budget(gravity::Solver* solver, const Scene& scene, const mpi::Comm& comm)
    : solver_(solver),
      uniform_gravity_(scene.gravity.uniform),
      affine_moment_(affine_moment(scene)),
      comm_(comm),
      energy_gain_(scene.numerics.energy_gain) {}

std::vector<double> Budget::potential(const ParticleOutput& p) const {
  if (solver_ == nullptr) return {};
  std::vector<Vec3d> acceleration(p.size());
  std::vector<double> potential(p.size());
  solver_->evaluate({p.position, p.mass}, acceleration, potential);
  return potential;
}

io::DiagnosticsRow Budget::row(const grid::Engine& engine, const ParticleOutput& p, const LostWork& lost) {
  CompensatedSums<kSums> s;
  double max_speed = 0.0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Vec3d momentum = p.mass[i] * p.velocity[i];
    const Mat3<double>& c = p.gradient[i];
    const Vec3d spin{c.zy - c.yz, c.xz - c.zx, c.yx - c.xy};
    const Vec3d angular = cross(p.position[i], momentum) + (p.mass[i] * affine_moment_) * spin;
    const double speed = length(p.velocity[i]);
    s.add(kMass, p.mass[i]);
    s.add(kPx, momentum.x);
    s.add(kPy, momentum.y);
    s.add(kPz, momentum.z);
    s.add(kLx, angular.x);
    s.add(kLy, angular.y);
    s.add(kLz, angular.z);
    s.add(kKinetic, 0.5 * p.mass[i] * speed * speed);
    s.add(kAffine, 0.5 * p.mass[i] * affine_moment_ * squared_norm(c));
    if (!p.internal_energy.empty()) s.add(kInternal, p.mass[i] * p.internal_energy[i]);
    s.add(kGravity, -(p.mass[i] * dot(uniform_gravity_, p.position[i])));
    s.add(kDamaged, p.mass[i] * p.damage[i]);
    s.add(kMomentumScale, p.mass[i] * speed);
    s.add(kAngularScale, length(angular));
    max_speed = std::max(max_speed, speed);
  }
  const std::vector<double> self_gravity = potential(p);
  for (std::size_t i = 0; i < self_gravity.size(); ++i) s.add(kGravity, 0.5 * p.mass[i] * self_gravity[i]);
  s.add(kGravity, -(lost.periods + engine.work_beyond_period()));
  s.add(kElastic, engine.elastic_energy());
  s.add(kPlastic, lost.plastic);
  s.add(kViscous, lost.viscous);
  s.add(kClamped, static_cast<double>(lost.clamped));
  s.add(kParticles, static_cast<double>(p.size()));
  s.add(kBlocks, static_cast<double>(engine.stats().blocks));
  comm_.sum(std::span<double>(s.parts()));

  const std::vector<double> ratios = engine.volume_ratios();
  const auto [low, high] = std::minmax_element(ratios.begin(), ratios.end());
  io::DiagnosticsRow row;
  row.particles = static_cast<std::uint64_t>(s[kParticles]);
  row.mass = s[kMass];
  row.momentum_x = s[kPx];
  row.momentum_y = s[kPy];
  row.momentum_z = s[kPz];
  row.angular_momentum_x = s[kLx];
  row.angular_momentum_y = s[kLy];
  row.angular_momentum_z = s[kLz];
  row.kinetic_energy = s[kKinetic];
  row.affine_energy = s[kAffine];
  row.internal_energy = s[kInternal];
  row.elastic_energy = s[kElastic];
  row.plastic_energy = s[kPlastic];
  row.viscous_energy = s[kViscous];
  row.clamped_volumes = static_cast<std::uint64_t>(s[kClamped]);
  row.gravitational_energy = s[kGravity];
  row.max_speed = comm_.max(max_speed);
  row.min_J = comm_.min(ratios.empty() ? HUGE_VAL : *low);
  row.max_J = comm_.max(ratios.empty() ? -HUGE_VAL : *high);
  row.damaged_fraction = s[kDamaged] / s[kMass];
  row.active_blocks = static_cast<std::uint64_t>(s[kBlocks]);
  row.particles_per_rank_min = comm_.min(static_cast<std::uint64_t>(p.size()));
  row.particles_per_rank_max = comm_.max(static_cast<std::uint64_t>(p.size()));
  if (!state_.started) {
    state_.first = row;
    state_.started = true;
  }
  const auto total = [](const io::DiagnosticsRow& r) {
    return r.kinetic_energy + r.affine_energy + r.internal_energy + r.gravitational_energy;
  };
  row.energy_residual = total(row) - total(state_.first);
  require_sums(row, p);
  follow(row, s[kMomentumScale], s[kAngularScale]);
  require_no_gain(row);
  return row;
}

void Budget::require_sums(const io::DiagnosticsRow& row, const ParticleOutput& p) const {
  if (!std::isfinite(row.kinetic_energy + row.affine_energy + row.internal_energy + row.elastic_energy + row.min_J +
                     row.max_J)) {
    const std::optional<std::uint64_t> id = not_finite(p, comm_);
    throw NumericsError(
        fmt::format("{} is not finite any more: the run is unstable; try a smaller time.step or time.cfl",
                    id ? fmt::format("particle {}", *id) : "a particle"));
  }
  if (row.particles != state_.first.particles) {
    const std::string missing = missing_ids(p.id, state_.first.particles, comm_);
    throw NumericsError(fmt::format("{} particles, but {} at the start{}{}", row.particles, state_.first.particles,
                                    missing.empty() ? "" : "; missing are the ids ", missing));
  }
  // Compensated sums are alike to the last bits, but checkpoints of earlier versions hold plain ones.
  const double rounding = 1e-12 + std::numeric_limits<double>::epsilon() * static_cast<double>(row.particles);
  if (std::abs(row.mass - state_.first.mass) > rounding * state_.first.mass) {
    throw NumericsError(fmt::format("total mass {:.17g} kg, but {:.17g} kg at the start", row.mass, state_.first.mass));
  }
}

void Budget::require_no_gain(const io::DiagnosticsRow& row) const {
  // Bodies at rest have no scale but this one: a few mm/s of noise.
  constexpr double kNoise = 1e-5;  // [J/kg]
  const double scale = state_.energy_scale + kNoise * row.mass;
  // Motion that grows on an internal energy far below zero is a gain as well.
  const double gain = std::max(row.energy_residual, state_.first.internal_energy - row.internal_energy);
  if (gain <= energy_gain_ * scale) return;
  const char* const what = gain == row.energy_residual ? "the total energy rose" : "motion took internal energy away";
  throw NumericsError(fmt::format(
      "{} by {:.6g} J since the start, {:.3g} of the largest kinetic + |potential| energy (allowed: {:.3g}, "
      "numerics.energy_gain); kinetic {:.6g} J, internal {:.6g} J, gravitational {:.6g} J; the run is "
      "unstable: try a smaller time.step or time.cfl",
      what, gain, gain / scale, energy_gain_, row.kinetic_energy, row.internal_energy, row.gravitational_energy));
}

void Budget::follow(const io::DiagnosticsRow& row, double momentum_scale, double angular_scale) {
  const auto grow = [](double& drift, double change, double scale) {
    if (scale > 0.0) drift = std::max(drift, change / scale);
  };
  // Scales are the largest so far: bodies that come to rest must not make an old drift look larger.
  state_.momentum_scale = std::max(state_.momentum_scale, momentum_scale);
  state_.angular_scale = std::max(state_.angular_scale, angular_scale);
  state_.energy_scale =
      std::max(state_.energy_scale, row.kinetic_energy + row.affine_energy + std::abs(row.gravitational_energy));
  grow(state_.drift.mass, std::abs(row.mass - state_.first.mass), state_.first.mass);
  grow(state_.drift.momentum,
       length({row.momentum_x - state_.first.momentum_x, row.momentum_y - state_.first.momentum_y,
               row.momentum_z - state_.first.momentum_z}),
       state_.momentum_scale);
  grow(state_.drift.angular_momentum,
       length({row.angular_momentum_x - state_.first.angular_momentum_x,
               row.angular_momentum_y - state_.first.angular_momentum_y,
               row.angular_momentum_z - state_.first.angular_momentum_z}),
       state_.angular_scale);
  grow(state_.drift.energy, std::abs(row.energy_residual), state_.energy_scale);
}

}  // namespace breccia::sim

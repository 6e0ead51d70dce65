#include "sim/guard.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "breccia/error.hpp"
#include "sim/suspects.hpp"

namespace breccia::sim {
namespace {

std::string text_of(Vec3d v) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", v.x, v.y, v.z); }

std::string text_of(const grid::ParticleValues& p) {
  return fmt::format("v = {} m/s, J = {:.6g}, e = {:.6g} J/kg, J P = {:.6g} Pa, D = {:.6g}", text_of(p.velocity),
                     p.volume_ratio, p.energy, p.pressure, p.damage);
}

constexpr const char* kAdvice = "the run is unstable: try a smaller time.step or time.cfl";

std::string describe(const GuardedFault& fault) {
  const grid::ParticleFault& p = fault.particle;
  return fmt::format("particle {} {} in step {} (from t = {:.6g} s): before at {} m with {}; after {}; {}", p.before.id,
                     p.finite ? "moved more than a cell" : "is not finite any more", fault.step, fault.time,
                     text_of(p.before.position), text_of(p.before.values), text_of(p.after), kAdvice);
}

double largest_component(Vec3d v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

}  // namespace

Guard::Guard(const Scene& scene, double step_at_rest, const mpi::Comm& comm)
    : step_at_rest_(step_at_rest), comm_(comm) {
  for (const BodyParameters& body : scene.bodies) particles_ += body.particles;
}

void Guard::note(const grid::PassReport& report, std::uint64_t step, double time) {
  if (fault_ || !report.fault) return;
  fault_ = GuardedFault{step, time, comm_.rank(), *report.fault};
}

void Guard::check(const grid::Engine& engine) {
  std::array<double, 3> sums{fault_ ? 1.0 : 0.0, engine.strayed() ? 1.0 : 0.0,
                             static_cast<double>(engine.stats().particles)};
  comm_.sum(std::span<double>(sums));
  if (sums[0] > 0.0) {
    share_fault();
    throw NumericsError(describe(*fault_));
  }
  if (sums[1] > 0.0) {
    const grid::ParticleSample p = fastest(engine);
    throw NumericsError(fmt::format(
        "particles moved more than a cell between two sortings, among them particle {} at {} m with {}; {}, "
        "or a shorter numerics.sort_interval",
        p.id, text_of(p.position), text_of(p.values), kAdvice));
  }
  if (sums[2] != static_cast<double>(particles_)) {
    const std::string missing = missing_ids(engine.inspect().id, particles_, comm_);
    throw NumericsError(fmt::format("{} particles are left of {}{}{}", sums[2], particles_,
                                    missing.empty() ? "" : ", without those of the ids ", missing));
  }
}

void Guard::check_step(double dt, const grid::Engine& engine) {
  if (dt >= kCollapse * step_at_rest_ && std::isfinite(dt)) return;
  const grid::ParticleSample p = fastest(engine);
  throw NumericsError(fmt::format(
      "the stable time step has fallen to {:.6g} s, from {:.6g} s at rest; the fastest particle is {} at {} "
      "m with {}; {}",
      dt, step_at_rest_, p.id, text_of(p.position), text_of(p.values), kAdvice));
}

// The earliest one, of several the one of the lowest rank.
void Guard::share_fault() {
  const GuardedFault none{UINT64_MAX, 0.0, 0, {}};
  std::optional<GuardedFault> first;
  for (const GuardedFault& fault : comm_.allgather(fault_.value_or(none))) {
    if (fault.step != UINT64_MAX && (!first || fault.step < first->step)) first = fault;
  }
  fault_ = first;
}

grid::ParticleSample Guard::fastest(const grid::Engine& engine) const {
  struct Candidate {
    bool is_there, strayed;
    grid::ParticleSample particle;
  };
  const auto mine = engine.fastest();
  Candidate worst{};
  for (const Candidate& c :
       comm_.allgather(Candidate{mine.has_value(), engine.strayed(), mine.value_or(grid::ParticleSample{})})) {
    if (!c.is_there) continue;
    const bool faster =
        largest_component(c.particle.values.velocity) > largest_component(worst.particle.values.velocity);
    if (!worst.is_there || c.strayed > worst.strayed || (c.strayed == worst.strayed && faster)) worst = c;
  }
  return worst.particle;
}

}  // namespace breccia::sim

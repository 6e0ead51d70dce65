#include "sim/step_size.hpp"

#include <algorithm>
#include <cmath>

namespace breccia::sim {

StepSize stable_step(const Scene& scene, const grid::SignalSpeeds& speeds, bool viscosity) {
  if (scene.time.step) return {*scene.time.step, "fixed by the scene"};
  double viscous_speed = 0.0;
  for (const MaterialParameters& m : scene.materials) {
    const double c0 = std::sqrt(m.eos.A / m.eos.rho0);
    viscous_speed =
        std::max(viscous_speed, m.viscosity_linear * c0 + m.viscosity_quadratic * scene.cell * speeds.compression_rate);
  }
  const double k = viscosity ? viscous_speed / speeds.sound : 0.0;
  const double acoustic = scene.cell / speeds.sound * (std::sqrt(1.0 + k * k) - k);
  const double crossing = speeds.particle > 0.0 ? scene.cell / speeds.particle : INFINITY;
  const double step = scene.time.cfl * std::min(acoustic, crossing);
  if (acoustic > crossing) return {step, "particle speed"};
  return {step, viscosity ? "sound speed with artificial viscosity" : "sound speed"};
}

grid::SignalSpeeds initial_speeds(const Scene& scene, bool shear) {
  grid::SignalSpeeds speeds;
  for (const MaterialParameters& m : scene.materials) {
    const double shear_part = shear ? 4.0 / 3.0 * m.shear_modulus : 0.0;
    speeds.sound = std::max(speeds.sound, std::sqrt((m.eos.A + shear_part) / m.eos.rho0));
  }
  for (const BodyParameters& b : scene.bodies) {
    const double extent = std::max({b.semi_axes.x, b.semi_axes.y, b.semi_axes.z});
    const double v = std::sqrt(dot(b.velocity, b.velocity)) + extent * std::sqrt(dot(b.spin, b.spin));
    speeds.particle = std::max(speeds.particle, v);
  }
  return speeds;
}

}  // namespace breccia::sim

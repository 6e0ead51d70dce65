#include "grid/observation.hpp"

#include <cmath>

#include "material/hencky.hpp"

namespace breccia::grid {

double hencky_norm(const Dev3<double>& strain) {
  const auto powers = material::traceless_powers(strain);
  return 0.5 * std::sqrt(material::squared_norm(material::deviatoric_log(strain, powers)));
}

void append(ParticleOutput& out, const ObservedParticle& p, const EngineSetup& setup) {
  const material::RuntimeEffects& fx = setup.effects;
  const std::uint32_t material = p.body_material >> 16;
  const MaterialParameters& parameters = setup.materials[material];
  const double ratio = 1.0 + p.volume_change;
  out.id.push_back(p.id);
  out.position.push_back(p.position);
  out.velocity.push_back(p.velocity);
  out.mass.push_back(p.mass);
  out.body.push_back(p.body_material & 0xffffU);
  out.material.push_back(material);
  out.density.push_back(parameters.eos.rho0 / ratio);
  out.grid_density.push_back(p.node_mass / (setup.cell * setup.cell * setup.cell));
  out.gradient.push_back(p.gradient);
  out.pressure.push_back(p.kirchhoff_pressure / ratio);
  out.damage.push_back(fx.fully_damaged ? 1.0 : p.damage_root * p.damage_root * p.damage_root);
  if (fx.energy) out.internal_energy.push_back(p.energy);
  if (fx.shear) out.shear_stress.push_back(2.0 * parameters.shear_modulus * p.hencky_norm / (std::sqrt(2.0) * ratio));
}

}  // namespace breccia::grid

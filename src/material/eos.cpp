#include "material/eos.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "breccia/error.hpp"
#include "material/tillotson.hpp"

namespace breccia::material {
namespace {

EosBranch branch_of(const TillotsonParameters& p, double density, double energy) {
  if (density >= p.rho0) return EosBranch::kCompressed;
  if (energy <= p.Eiv) return EosBranch::kCold;
  return energy < p.Ecv ? EosBranch::kMixed : EosBranch::kHot;
}

}  // namespace

const char* eos_branch_name(EosBranch branch) {
  switch (branch) {
    case EosBranch::kCompressed:
      return "comp";
    case EosBranch::kCold:
      return "cold";
    case EosBranch::kMixed:
      return "mix";
    case EosBranch::kHot:
      break;
  }
  return "hot";
}

EosPoint evaluate_eos(const TillotsonParameters& parameters, double density, double energy) {
  if (!(density > 0.0) || !std::isfinite(density))
    throw UsageError("eos: density must be a positive number of kg/m3, not " + std::to_string(density));
  if (!std::isfinite(energy)) throw UsageError("eos: energy must be a finite number of J/kg");

  const auto k = make_tillotson_constants<double>(parameters);
  const double rho0 = parameters.rho0;
  const double rho = std::max(density, kLeastEta * rho0);
  const Compression<double> c{rho / rho0, (rho - rho0) / rho0, (rho0 - rho) / rho};

  EosPoint point;
  point.pressure = tillotson(k, c, energy).pressure;
  point.sound_speed_squared = tillotson_sound_speed_squared(k, c, energy);
  point.sound_speed = std::sqrt(std::max(point.sound_speed_squared, parameters.A / rho0));
  point.branch = branch_of(parameters, density, energy);
  return point;
}

}  // namespace breccia::material

// One material point driven through the two constitutive calls in the order of a time step.
#pragma once

#include <type_traits>

#include "material/constitutive.hpp"
#include "random_tensors.hpp"

namespace breccia::test {

inline constexpr double kCell = 2500.0;            // [m]
inline constexpr double kStep = 1.0e5 / 819200.0;  // [s], a float too

/// T is float or double.
template <class T, class Fx = material::RockEffects>
struct MaterialPoint {
  material::Constants<T> constants = material::make_constants<T>(MaterialParameters{}, LiteralSwitches{}, kCell);
  Fx fx{};
  material::State<T> state{};
  material::Dissipation<T> dissipation{};

  /// Strain with `gradient` [1/s] over one step, then the stress at its end. Energy is complete at that time.
  Sym3<T> advance(const Mat3<T>& gradient, T step = T(kStep)) {
    material::update_strain(fx, constants, state, gradient, step);
    return material::update_stress(fx, constants, state, gradient, T(0.5) * step, dissipation);
  }
  Sym3<T> advance(const Eigen::Matrix3d& gradient, double step = kStep) {
    return advance(to_mat3<T>(gradient), T(step));
  }
  [[nodiscard]] double volume_ratio() const {
    if constexpr (std::is_same_v<T, float>)
      return 1.0 + double(state.volume.high) + double(state.volume.low);
    else
      return 1.0 + state.volume.high;
  }
};

}  // namespace breccia::test

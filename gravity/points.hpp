// Point masses as the pair kernels read them: one array per component, coordinates as a sum of two Reals where Real is
// float. The difference (a.high - b.high) + (a.low - b.low) is then right to a few float roundings of itself wherever
// the two particles are and in whatever order they come, and changes only its sign when a and b swap roles.
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "gravity/pair_kernel.hpp"
#include "gravity/solver.hpp"

namespace breccia::gravity {

/// Reals per point: x, y, z, mass, and the low parts of the coordinates for float.
template <class Real>
inline constexpr std::size_t kPointComponents = std::is_same_v<Real, float> ? 7 : 4;

/// Targets are worked off in groups of this many; a multiple of every lane count.
inline constexpr std::int64_t kTargetGroup = 64;

/// Smallest multiple of kTargetGroup that holds `count` points.
inline std::int64_t padded(std::int64_t count) { return (count + kTargetGroup - 1) / kTargetGroup * kTargetGroup; }

/// Component arrays one after the other, each padded with zeros; the memory is reused from one evaluation to the next.
template <class Real>
class Points {
 public:
  void resize(std::int64_t count) {
    count_ = count;
    data_.assign(kPointComponents<Real> * static_cast<std::size_t>(padded(count)), Real(0));
  }

  /// Copies the particles; masses in units of `mass_unit` [kg].
  void fill(ParticlesView particles, double mass_unit) {
    resize(static_cast<std::int64_t>(particles.position.size()));
    const auto stride = static_cast<std::size_t>(padded(count_));
    for (std::size_t i = 0; i < particles.position.size(); ++i) {
      const Vec3d p = particles.position[i];
      const double coordinates[3] = {p.x, p.y, p.z};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const Real high = static_cast<Real>(coordinates[axis]);
        data_[axis * stride + i] = high;
        if constexpr (kPointComponents<Real> == 7) {
          data_[(4 + axis) * stride + i] = static_cast<Real>(coordinates[axis] - static_cast<double>(high));
        }
      }
      data_[3 * stride + i] = static_cast<Real>(particles.mass[i] / mass_unit);
    }
  }

  [[nodiscard]] PointArrays<Real> arrays() const {
    const std::int64_t stride = padded(count_);
    const auto component = [&](int c) { return data_.data() + c * stride; };
    constexpr int kLow = kPointComponents<Real> == 7 ? 4 : 0;
    return {{component(0), component(1), component(2)},
            {component(kLow), component(kLow + 1), component(kLow + 2)},
            component(3),
            count_};
  }
  [[nodiscard]] std::vector<Real>& data() { return data_; }

 private:
  std::int64_t count_ = 0;
  std::vector<Real> data_;
};

}  // namespace breccia::gravity

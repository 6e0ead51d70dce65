// Particles in device memory: one array for each field of grid/particles.hpp, component after component, so that
// neighbouring threads read neighbouring words. Arrays of effects that are off are null.
#pragma once

#include <cstdint>

#include "breccia/macros.hpp"

namespace breccia::cuda {

/// Position inside the cell as in the precision policies: 2^-32 cells (float) or a double in cells.
template <class Real>
struct OffsetOf;
template <>
struct OffsetOf<float> {
  using type = std::int32_t;
};
template <>
struct OffsetOf<double> {
  using type = double;
};

template <class Real>
struct ParticleView {
  using Offset = typename OffsetOf<Real>::type;
  /// Words of a sum without loss (Accumulator).
  static constexpr unsigned kSum = sizeof(Real) == 4 ? 2 : 1;

  unsigned stride = 0;  ///< slots of a component

  Offset* offset = nullptr;
  std::int32_t* node = nullptr;
  Real* velocity = nullptr;
  Real* mass = nullptr;
  Real* volume_change = nullptr;
  Real* kirchhoff_pressure = nullptr;
  Real* elastic_strain = nullptr;
  Real* internal_energy = nullptr;
  Real* damage_root = nullptr;
  Real* total_strain = nullptr;
  Real* next_threshold = nullptr;
  std::int32_t* flaw_first = nullptr;
  std::int32_t* flaw_count = nullptr;
  Real* gravity = nullptr;
  std::int32_t* id_low = nullptr;
  std::int32_t* id_high = nullptr;
  std::int32_t* body_material = nullptr;
  Real* velocity_gradient = nullptr;

  /// Place of a component of a slot. 32 bits hold nine components of 4e8 particles: more than a device has memory for.
  [[nodiscard]] BRECCIA_HD unsigned at(unsigned component, unsigned slot) const { return component * stride + slot; }
};

}  // namespace breccia::cuda

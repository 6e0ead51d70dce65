// Thresholds of flaws in 16 bits. A particle of a million has 14 of them: as floats they would be a quarter of all it
// holds.
#pragma once

#include <cstdint>

#include "breccia/macros.hpp"

namespace breccia::material {

/// The upper bits of the threshold's float: exponent and 11 bits of the mantissa, counted from kWeakestFlaw. Codes
/// ascend as thresholds do.
using FlawCode = std::uint16_t;

/// Below it no flaw is told from a weaker one, above 16 none ever grows: strains that intact rock does not know.
inline constexpr float kWeakestFlaw = 0x1p-28F;
inline constexpr FlawCode kNeverGrows = 0xffff;

namespace detail {
inline constexpr int kDroppedBits = 12;
inline constexpr std::int32_t kFirstCode = __builtin_bit_cast(std::int32_t, kWeakestFlaw) >> kDroppedBits;
}  // namespace detail

/// The bits of the float that a code stands for, kNeverGrows for nearly 16; a number or a pack of them.
template <class Integer>
BRECCIA_HD Integer threshold_bits(Integer code) {
  return (code + Integer(detail::kFirstCode)) << detail::kDroppedBits;
}

BRECCIA_HD float threshold_of(FlawCode code) {
  if (code == kNeverGrows) return 1e30F;
  return __builtin_bit_cast(float, threshold_bits(static_cast<std::int32_t>(code)));
}

/// The code next to a threshold > 0: within 2^-12 of it.
BRECCIA_HD FlawCode flaw_code(float threshold) {
  constexpr std::int32_t kHalf = 1 << (detail::kDroppedBits - 1);
  const std::int32_t code =
      ((__builtin_bit_cast(std::int32_t, threshold) + kHalf) >> detail::kDroppedBits) - detail::kFirstCode;
  if (code < 0) return 0;
  return code < kNeverGrows ? static_cast<FlawCode>(code) : kNeverGrows;
}

}  // namespace breccia::material

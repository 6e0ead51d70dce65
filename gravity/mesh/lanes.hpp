// Lane masks as bits, and packing of the lanes a mask names, for packs one register wide.
#pragma once

#include <immintrin.h>

#include <type_traits>

#include "breccia/pack.hpp"

namespace breccia::gravity::BRECCIA_ISA {

/// Bit l is set where lane l of the mask is.
template <class I, int W>
BRECCIA_HD unsigned bits(PackMask<I, W> mask) {
#if defined(__AVX512F__)
  if constexpr (W == 16) {
    return _mm512_movepi32_mask(__builtin_bit_cast(__m512i, mask.v));
  } else {
    return _mm512_movepi64_mask(__builtin_bit_cast(__m512i, mask.v));
  }
#elif defined(__AVX2__)
  if constexpr (W == 8) {
    return static_cast<unsigned>(_mm256_movemask_ps(__builtin_bit_cast(__m256, mask.v)));
  } else {
    return static_cast<unsigned>(_mm256_movemask_pd(__builtin_bit_cast(__m256d, mask.v)));
  }
#else
  if constexpr (W == 4) {
    return static_cast<unsigned>(_mm_movemask_ps(__builtin_bit_cast(__m128, mask.v)));
  } else {
    return static_cast<unsigned>(_mm_movemask_pd(__builtin_bit_cast(__m128d, mask.v)));
  }
#endif
}

/// Writes the lanes whose bits are set one after the other; may write garbage up to a whole pack from `to` on.
template <class V>
BRECCIA_HD void store_selected(unsigned selected, V value, typename V::Scalar* to) {
#if defined(__AVX512F__)
  // Compressed in a register, then stored whole: compressing stores are slow on some processors.
  if constexpr (std::is_same_v<typename V::Scalar, float>) {
    _mm512_storeu_ps(to,
                     _mm512_maskz_compress_ps(static_cast<__mmask16>(selected), __builtin_bit_cast(__m512, value.v)));
  } else {
    _mm512_storeu_pd(to,
                     _mm512_maskz_compress_pd(static_cast<__mmask8>(selected), __builtin_bit_cast(__m512d, value.v)));
  }
#else
  for (; selected != 0; selected &= selected - 1) *to++ = value[__builtin_ctz(selected)];
#endif
}

}  // namespace breccia::gravity::BRECCIA_ISA

// Between lanes = particles (constitutive update) and lanes = node channels (transfers).
#pragma once

#include "breccia/pack.hpp"

namespace breccia::grid {

namespace detail {

template <class S>
BRECCIA_HD void transpose8_in_registers(Pack<S, 8> (&row)[8]) {
  using V = typename Pack<S, 8>::Vector;
  V t[8];
  V u[8];
  for (int i = 0; i < 8; i += 2) {
    t[i] = __builtin_shufflevector(row[i].v, row[i + 1].v, 0, 8, 1, 9, 4, 12, 5, 13);
    t[i + 1] = __builtin_shufflevector(row[i].v, row[i + 1].v, 2, 10, 3, 11, 6, 14, 7, 15);
  }
  for (int i = 0; i < 8; i += 4) {
    for (int j = 0; j < 2; ++j) {
      u[i + 2 * j] = __builtin_shufflevector(t[i + j], t[i + j + 2], 0, 1, 8, 9, 4, 5, 12, 13);
      u[i + 2 * j + 1] = __builtin_shufflevector(t[i + j], t[i + j + 2], 2, 3, 10, 11, 6, 7, 14, 15);
    }
  }
  for (int i = 0; i < 4; ++i) {
    row[i].v = __builtin_shufflevector(u[i], u[i + 4], 0, 1, 2, 3, 8, 9, 10, 11);
    row[i + 4].v = __builtin_shufflevector(u[i], u[i + 4], 4, 5, 6, 7, 12, 13, 14, 15);
  }
}

// Quarters 0 and 2 (1 and 3) of two rows of 16 lanes.
template <class V>
BRECCIA_HD V even_quarters(V a, V b) {
  return __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11, 16, 17, 18, 19, 24, 25, 26, 27);
}
template <class V>
BRECCIA_HD V odd_quarters(V a, V b) {
  return __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15, 20, 21, 22, 23, 28, 29, 30, 31);
}

// Registers too narrow for a row: the caches do it.
template <class S>
BRECCIA_HD void transpose8_in_memory(Pack<S, 8> (&row)[8]) {
  S from[8][8];
  S to[8][8];
  for (int i = 0; i < 8; ++i) row[i].store(from[i]);
  for (int i = 0; i < 8; ++i) {
    for (int j = 0; j < 8; ++j) to[j][i] = from[i][j];
  }
  for (int i = 0; i < 8; ++i) row[i] = Pack<S, 8>::load(to[i]);
}

}  // namespace detail

/// Transposes 8 rows of 8 lanes in place.
template <class S>
BRECCIA_HD void transpose8(Pack<S, 8> (&row)[8]) {
  if constexpr (breccia::detail::kIsWide<S, 8>) {
    detail::transpose8_in_memory(row);
  } else {
    detail::transpose8_in_registers(row);
  }
}

/// Transposes 16 rows of 16 lanes in place; for registers that hold a row.
template <class S>
BRECCIA_HD void transpose16(Pack<S, 16> (&row)[16]) {
  Pack<S, 16> a[16];
  Pack<S, 16> b[16];
  for (int i = 0; i < 16; i += 2) {
    const auto r0 = row[i].v;
    const auto r1 = row[i + 1].v;
    a[i] = __builtin_shufflevector(r0, r1, 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29);
    a[i + 1] = __builtin_shufflevector(r0, r1, 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31);
  }
  for (int i = 0; i < 16; i += 4) {
    for (int j = 0; j < 2; ++j) {
      const auto r0 = a[i + j].v;
      const auto r1 = a[i + j + 2].v;
      b[i + 2 * j] = __builtin_shufflevector(r0, r1, 0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29);
      b[i + 2 * j + 1] = __builtin_shufflevector(r0, r1, 2, 3, 18, 19, 6, 7, 22, 23, 10, 11, 26, 27, 14, 15, 30, 31);
    }
  }
  // Now quarter q of b[4 k + j] holds column 4 q + j of the rows 4 k .. 4 k + 3.
  for (int j = 0; j < 4; ++j) {
    const auto even_low = detail::even_quarters(b[j].v, b[4 + j].v);
    const auto odd_low = detail::odd_quarters(b[j].v, b[4 + j].v);
    const auto even_high = detail::even_quarters(b[8 + j].v, b[12 + j].v);
    const auto odd_high = detail::odd_quarters(b[8 + j].v, b[12 + j].v);
    row[j] = detail::even_quarters(even_low, even_high);
    row[4 + j] = detail::even_quarters(odd_low, odd_high);
    row[8 + j] = detail::odd_quarters(even_low, even_high);
    row[12 + j] = detail::odd_quarters(odd_low, odd_high);
  }
}

/// channels[c] gets channel c of all lanes from rows[lane]; W = 8 or 16 lanes.
template <class S, int W>
BRECCIA_HD void rows_to_channels(const Pack<S, 8>* rows, Pack<S, W> (&channels)[8]) {
  Pack<S, 8> half[W / 8][8];
  for (int h = 0; h < W / 8; ++h) {
    for (int i = 0; i < 8; ++i) half[h][i] = rows[8 * h + i];
    transpose8(half[h]);
  }
  for (int c = 0; c < 8; ++c) {
    if constexpr (W == 8) {
      channels[c] = half[0][c];
    } else {
      channels[c] = join(half[0][c], half[1][c]);
    }
  }
}

/// The inverse of rows_to_channels.
template <class S, int W>
BRECCIA_HD void channels_to_rows(const Pack<S, W> (&channels)[8], Pack<S, 8>* rows) {
  for (int h = 0; h < W / 8; ++h) {
    Pack<S, 8> half[8];
    for (int c = 0; c < 8; ++c) {
      if constexpr (W == 8) {
        half[c] = channels[c];
      } else {
        half[c] = h == 0 ? lower(channels[c]) : upper(channels[c]);
      }
    }
    transpose8(half);
    for (int i = 0; i < 8; ++i) rows[8 * h + i] = half[i];
  }
}

}  // namespace breccia::grid

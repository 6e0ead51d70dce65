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

// Between lanes = particles (constitutive update) and lanes = node channels (transfers).
#pragma once

#include "breccia/pack.hpp"

namespace breccia::grid {

/// Transposes 8 rows of 8 lanes in place.
template <class S>
BRECCIA_HD void transpose8(Pack<S, 8> (&row)[8]) {
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

/// Lanes 0-3 of a, then lanes 0-3 of b.
template <class S>
BRECCIA_HD Pack<S, 8> low_halves(Pack<S, 8> a, Pack<S, 8> b) {
  return Pack<S, 8>(__builtin_shufflevector(a.v, b.v, 0, 1, 2, 3, 8, 9, 10, 11));
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
      channels[c].v =
          __builtin_shufflevector(half[0][c].v, half[1][c].v, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
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
      } else if (h == 0) {
        half[c].v = __builtin_shufflevector(channels[c].v, channels[c].v, 0, 1, 2, 3, 4, 5, 6, 7);
      } else {
        half[c].v = __builtin_shufflevector(channels[c].v, channels[c].v, 8, 9, 10, 11, 12, 13, 14, 15);
      }
    }
    transpose8(half);
    for (int i = 0; i < 8; ++i) rows[8 * h + i] = half[i];
  }
}

}  // namespace breccia::grid

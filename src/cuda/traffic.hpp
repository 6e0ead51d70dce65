// Bytes that a step moves between particles, grid and device memory, counted from what the kernels read and write. The
// tests hold the table of fields against the kernels (tests/cuda/traffic_test.cpp).
#pragma once

#include <array>
#include <string_view>

#include "cuda/step_arguments.hpp"

namespace breccia::cuda {

/// Words of a field that the fused pass over a particle reads and writes, all effects on and D < 1. What happens to few
/// particles in few steps does not count: a flaw that is activated, C at the start of a window.
struct FieldTraffic {
  std::string_view name;
  int reals_read, reals_written;  ///< of the working precision
  int words_read, words_written;  ///< 4 bytes (offsets: of the precision's offset type)
};

template <class Real>
constexpr auto field_traffic() {
  constexpr int sum = static_cast<int>(ParticleView<Real>::kSum);
  constexpr int offset_words = 3 * static_cast<int>(sizeof(typename ParticleView<Real>::Offset)) / 4;
  return std::array<FieldTraffic, 18>{{{"offset", 0, 0, offset_words, offset_words},
                                       {"node", 0, 0, 1, 1},
                                       {"velocity", 3, 3, 0, 0},
                                       {"mass", 1, 0, 0, 0},
                                       {"volume_change", sum, sum, 0, 0},
                                       {"kirchhoff_pressure", 1, 1, 0, 0},
                                       {"elastic_strain", 5, 5, 0, 0},
                                       {"internal_energy", sum, sum, 0, 0},
                                       {"damage_root", 1, 1, 0, 0},
                                       {"total_strain", 6, 6, 0, 0},
                                       {"flaw_first", 0, 0, 0, 0},
                                       {"flaw_count", 0, 0, 1, 0},
                                       {"next_threshold", 1, 0, 0, 0},
                                       {"gravity", 3, 0, 0, 0},
                                       {"id_low", 0, 0, 0, 0},
                                       {"id_high", 0, 0, 0, 0},
                                       {"body_material", 0, 0, 0, 0},  // read where there are several materials
                                       {"velocity_gradient", 0, 0, 0, 0}}};
}

/// Of the particles' own fields [bytes].
template <class Real>
constexpr int particle_bytes() {
  int bytes = 0;
  for (const FieldTraffic& f : field_traffic<Real>()) {
    bytes += static_cast<int>(sizeof(Real)) * (f.reals_read + f.reals_written) + 4 * (f.words_read + f.words_written);
  }
  return bytes;
}

/// Bytes of the grid for each particle of a full tile that has drifted over `box` nodes along each axis: velocities
/// read, partial sums written and read again, velocities and masses written.
template <class Real>
constexpr double grid_bytes(double particles_per_cell, int box) {
  const double particles = particles_per_cell * grid::kBlockNodes;
  const int touched = box * box * box;
  const double tile = kVelocities * kTileNodes + 2 * kSums * touched + kSums * grid::kBlockNodes;
  return tile * static_cast<double>(sizeof(Real)) / particles;
}

}  // namespace breccia::cuda

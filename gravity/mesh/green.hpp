// Fourier transform of an even kernel on the doubled mesh, of which symmetry leaves one octant.
#pragma once

#include <functional>
#include <vector>

namespace breccia::gravity {

/// Nodes of the real mesh and of the doubled one.
struct MeshSize {
  int nodes[3];
  int padded[3];  ///< even; twice the longest distance wanted must be less

  friend bool operator==(const MeshSize&, const MeshSize&) = default;
};

/// A part [begin, end) of the planes of one axis.
struct PlaneRange {
  int begin = 0, end = 0;
  [[nodiscard]] int count() const { return end - begin; }
};

/// Kernel at the distance (i, j, k) in nodes, each >= 0; even in every component.
using Kernel = std::function<double(int, int, int)>;

/// Wave numbers n and padded - n have the same kernel; this is the lower one.
inline int folded(int wave_number, int padded) {
  return wave_number < padded - wave_number ? wave_number : padded - wave_number;
}

/// The transform over padded points per axis, normalised for a forward and a backward transform of the data: (y wave
/// numbers of `rows`, all <= padded/2, x wave numbers to padded/2, z wave numbers to padded/2). In double, because the
/// small values at high wave numbers are differences of large ones.
std::vector<double> transformed_kernel(const MeshSize& size, const Kernel& kernel, PlaneRange rows, int threads);

}  // namespace breccia::gravity

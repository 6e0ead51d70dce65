#include "gravity/mesh/green.hpp"

#include <omp.h>

#include <algorithm>
#include <complex>

#include "gravity/mesh/aligned.hpp"
#include "gravity/mesh/fft_plan.hpp"

namespace breccia::gravity {
namespace {

using Complex = std::complex<double>;

// Row k of planes with `half` complex numbers per row.
Complex* row_at(AlignedVector<Complex>& plane, int k, int half) {
  return plane.data() + static_cast<std::size_t>(k) * static_cast<std::size_t>(half);
}

// One plane of x: the kernel over all y and z, which are transformed.
void transform_plane(const MeshSize& size, const Kernel& kernel, int x, const FftPlan<double>& over_z,
                     const FftPlan<double>& over_y, AlignedVector<Complex>& plane) {
  const int* padded = size.padded;
  const int half = padded[2] / 2 + 1;
  for (int y = 0; y <= padded[1] / 2; ++y) {
    auto* row = reinterpret_cast<double*>(row_at(plane, y, half));
    for (int z = 0; z < half; ++z) row[z] = kernel(x, y, z);
    for (int z = half; z < padded[2]; ++z) row[z] = row[padded[2] - z];
    if (y > 0 && y < padded[1] - y)
      std::copy_n(row, padded[2], reinterpret_cast<double*>(row_at(plane, padded[1] - y, half)));
  }
  over_z(plane.data());
  over_y(plane.data());
}

}  // namespace

std::vector<double> transformed_kernel(const MeshSize& size, const Kernel& kernel, PlaneRange rows, int threads) {
  const int* padded = size.padded;
  const int half = padded[2] / 2 + 1;
  const int x_count = padded[0] / 2 + 1;
  const auto stride = static_cast<std::size_t>(half);
  std::vector<double> values(static_cast<std::size_t>(std::max(0, rows.count())) * static_cast<std::size_t>(x_count) *
                             stride);
  if (values.empty()) return values;

  const FftPlan<double> over_z(FftKind::kRealToComplex, padded[2], padded[1], 1, half);
  const FftPlan<double> over_y(FftKind::kForward, padded[1], half, half, 1);
  const FftPlan<double> over_x(FftKind::kForward, padded[0], half, half, 1);
  std::vector<AlignedVector<Complex>> work(static_cast<std::size_t>(threads));
  for (auto& w : work) w.resize(static_cast<std::size_t>(std::max(padded[0], padded[1])) * stride);

#pragma omp parallel for num_threads(threads) schedule(static)
  for (int x = 0; x < x_count; ++x) {
    AlignedVector<Complex>& plane = work[static_cast<std::size_t>(omp_get_thread_num())];
    transform_plane(size, kernel, x, over_z, over_y, plane);
    for (int y = rows.begin; y < rows.end; ++y) {
      double* to = &values[static_cast<std::size_t>((y - rows.begin) * x_count + x) * stride];
      const Complex* from = row_at(plane, y, half);
      for (int z = 0; z < half; ++z) to[z] = from[z].real();
    }
  }

  const double normalisation = 1.0 / (static_cast<double>(padded[0]) * padded[1] * padded[2]);
#pragma omp parallel for num_threads(threads) schedule(static)
  for (int y = rows.begin; y < rows.end; ++y) {
    AlignedVector<Complex>& plane = work[static_cast<std::size_t>(omp_get_thread_num())];
    double* row = &values[static_cast<std::size_t>((y - rows.begin) * x_count) * stride];
    for (int x = 0; x < padded[0]; ++x) {
      std::copy_n(row + static_cast<std::size_t>(folded(x, padded[0])) * stride, stride, row_at(plane, x, half));
    }
    over_x(plane.data());
    for (int x = 0; x < x_count; ++x) {
      const Complex* from = row_at(plane, x, half);
      for (std::size_t z = 0; z < stride; ++z)
        row[static_cast<std::size_t>(x) * stride + z] = normalisation * from[z].real();
    }
  }
  return values;
}

}  // namespace breccia::gravity

// Potential of a mesh of masses with vacuum around it: convolution with a kernel on a mesh of twice the size
// (Hockney), by Fourier transforms that skip what is zero before and unwanted after. Planes of x are dealt out to the
// ranks; one transposition turns them into planes of the y wave number and another back (gravity.md 5.3, 5.4).
#pragma once

#include <vector>

#include "gravity/mesh/aligned.hpp"
#include "gravity/mesh/fft_plan.hpp"
#include "gravity/mesh/green.hpp"
#include "mpi/comm.hpp"

namespace breccia::gravity {

/// Share of rank `rank` of `ranks` in `planes` planes: contiguous, as even as can be, empty for some if planes < ranks.
PlaneRange share_of_planes(int planes, int ranks, int rank);

template <class Real>
class Convolution {
 public:
  using Complex = std::complex<Real>;

  /// Collective over `comm`.
  Convolution(const MeshSize& size, const Kernel& kernel, const mpi::Comm& comm, int threads);

  /// The planes of x this rank holds.
  [[nodiscard]] PlaneRange planes() const { return x_[static_cast<std::size_t>(comm_.rank())]; }

  /// Masses to potential, in place: (planes, ny, nz) values, z fastest. Collective.
  void apply(Real* values);

  /// Bytes this rank sends in one call.
  [[nodiscard]] double bytes_sent() const;

 private:
  void make_kernel(const Kernel& kernel);
  void forward_planes(const Real* values);
  void multiply(int plane, Complex* line_block) const;
  void backward_planes(Real* values);
  void transpose_to_y();
  void transpose_to_x();
  [[nodiscard]] PlaneRange own_y() const { return y_[static_cast<std::size_t>(comm_.rank())]; }

  MeshSize size_;
  mpi::Comm comm_;
  int threads_;
  int half_;  // complex numbers along z
  std::vector<PlaneRange> x_, y_;
  FftPlan<Real> real_to_z_, z_to_real_, forward_y_, backward_y_, forward_x_, backward_x_;
  AlignedVector<Real> kernel_;  // (folded y wave number from first_folded_, x wave number to padded/2, half)
  int first_folded_ = 0;
  AlignedVector<Complex> by_x_;               // (y wave number, own x, half): what the x planes give and take
  AlignedVector<Complex> by_y_;               // (own y wave number, x, half)
  std::vector<AlignedVector<Complex>> work_;  // one (padded y or x, half) per thread
};

}  // namespace breccia::gravity

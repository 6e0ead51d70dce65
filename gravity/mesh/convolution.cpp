#include "gravity/mesh/convolution.hpp"

#include <omp.h>

#include <algorithm>
#include <cstdint>

namespace breccia::gravity {
namespace {

std::size_t volume(int a, int b, int c = 1) {
  return static_cast<std::size_t>(a) * static_cast<std::size_t>(b) * static_cast<std::size_t>(c);
}

// Sends block r of each rank's list to rank r; counts in complex numbers, one after the other in both arrays.
template <class Complex>
void exchange(const Complex* send, const std::vector<int>& send_counts, Complex* receive,
              const std::vector<int>& receive_counts, const mpi::Comm& comm) {
  MPI_Datatype type = MPI_DATATYPE_NULL;
  MPI_Type_contiguous(static_cast<int>(sizeof(Complex)), MPI_BYTE, &type);
  MPI_Type_commit(&type);
  std::vector<int> send_at(send_counts.size(), 0), receive_at(receive_counts.size(), 0);
  for (std::size_t r = 1; r < send_counts.size(); ++r) {
    send_at[r] = send_at[r - 1] + send_counts[r - 1];
    receive_at[r] = receive_at[r - 1] + receive_counts[r - 1];
  }
  MPI_Alltoallv(send, send_counts.data(), send_at.data(), type, receive, receive_counts.data(), receive_at.data(), type,
                comm.handle());
  MPI_Type_free(&type);
}

std::vector<PlaneRange> shares(int planes, int ranks) {
  std::vector<PlaneRange> all;
  for (int r = 0; r < ranks; ++r) all.push_back(share_of_planes(planes, ranks, r));
  return all;
}

}  // namespace

PlaneRange share_of_planes(int planes, int ranks, int rank) {
  const auto cut = [&](int r) { return static_cast<int>(static_cast<std::int64_t>(planes) * r / ranks); };
  return {cut(rank), cut(rank + 1)};
}

template <class Real>
Convolution<Real>::Convolution(const MeshSize& size, const Kernel& kernel, const mpi::Comm& comm, int threads)
    : size_(size),
      comm_(comm),
      threads_(std::max(threads, 1)),
      half_(size.padded[2] / 2 + 1),
      x_(shares(size.nodes[0], comm.size())),
      y_(shares(size.padded[1], comm.size())),
      real_to_z_(FftKind::kRealToComplex, size.padded[2], size.nodes[1], 1, half_),
      z_to_real_(FftKind::kComplexToReal, size.padded[2], size.nodes[1], 1, half_),
      forward_y_(FftKind::kForward, size.padded[1], half_, half_, 1),
      backward_y_(FftKind::kBackward, size.padded[1], half_, half_, 1),
      forward_x_(FftKind::kForward, size.padded[0], half_, half_, 1),
      backward_x_(FftKind::kBackward, size.padded[0], half_, half_, 1) {
  work_.resize(static_cast<std::size_t>(threads_));
  for (auto& work : work_) work.resize(volume(std::max(size.padded[0], size.padded[1]), half_));
  by_y_.resize(volume(own_y().count(), size.nodes[0], half_));
  by_x_.resize(comm_.size() > 1 ? volume(size.padded[1], planes().count(), half_) : 0);
  make_kernel(kernel);
}

template <class Real>
void Convolution<Real>::make_kernel(const Kernel& kernel) {
  first_folded_ = size_.padded[1];
  int last_folded = -1;
  for (int y = own_y().begin; y < own_y().end; ++y) {
    first_folded_ = std::min(first_folded_, folded(y, size_.padded[1]));
    last_folded = std::max(last_folded, folded(y, size_.padded[1]));
  }
  const std::vector<double> values =
      transformed_kernel(size_, kernel, {first_folded_, std::max(first_folded_, last_folded + 1)}, threads_);
  kernel_.resize(values.size());
  std::transform(values.begin(), values.end(), kernel_.begin(), [](double v) { return static_cast<Real>(v); });
}

template <class Real>
void Convolution<Real>::apply(Real* values) {
  forward_planes(values);
  if (comm_.size() > 1) transpose_to_y();
#pragma omp parallel for num_threads(threads_) schedule(static)
  for (int y = own_y().begin; y < own_y().end; ++y) {
    Complex* work = work_[static_cast<std::size_t>(omp_get_thread_num())].data();
    Complex* plane = &by_y_[volume(y - own_y().begin, size_.nodes[0], half_)];
    const std::size_t filled = volume(size_.nodes[0], half_);
    std::copy_n(plane, filled, work);
    std::fill(work + filled, work + volume(size_.padded[0], half_), Complex{});
    forward_x_(work);
    multiply(y, work);
    backward_x_(work);
    std::copy_n(work, filled, plane);
  }
  if (comm_.size() > 1) transpose_to_x();
  backward_planes(values);
}

// Transforms over z and y. The result is stored with the y wave number slowest.
template <class Real>
void Convolution<Real>::forward_planes(const Real* values) {
  Complex* to = comm_.size() > 1 ? by_x_.data() : by_y_.data();
  const int count = planes().count();
#pragma omp parallel for num_threads(threads_) schedule(static)
  for (int x = 0; x < count; ++x) {
    Complex* work = work_[static_cast<std::size_t>(omp_get_thread_num())].data();
    for (int y = 0; y < size_.nodes[1]; ++y) {
      Real* row = reinterpret_cast<Real*>(work + volume(y, half_));
      std::copy_n(values + volume(x * size_.nodes[1] + y, size_.nodes[2]), size_.nodes[2], row);
      std::fill(row + size_.nodes[2], row + 2 * half_, Real(0));
    }
    std::fill(work + volume(size_.nodes[1], half_), work + volume(size_.padded[1], half_), Complex{});
    real_to_z_(work);
    forward_y_(work);
    for (int y = 0; y < size_.padded[1]; ++y) {
      std::copy_n(work + volume(y, half_), half_, to + volume(y * count + x, half_));
    }
  }
}

template <class Real>
void Convolution<Real>::multiply(int plane, Complex* line_block) const {
  const int x_count = size_.padded[0] / 2 + 1;
  const int row = folded(plane, size_.padded[1]) - first_folded_;
  for (int x = 0; x < size_.padded[0]; ++x) {
    const Real* factor = &kernel_[volume(row * x_count + folded(x, size_.padded[0]), half_)];
    Real* values = reinterpret_cast<Real*>(line_block + volume(x, half_));
    for (int z = 0; z < half_; ++z) {
      values[2 * z] *= factor[z];
      values[2 * z + 1] *= factor[z];
    }
  }
}

template <class Real>
void Convolution<Real>::backward_planes(Real* values) {
  const Complex* from = comm_.size() > 1 ? by_x_.data() : by_y_.data();
  const int count = planes().count();
#pragma omp parallel for num_threads(threads_) schedule(static)
  for (int x = 0; x < count; ++x) {
    Complex* work = work_[static_cast<std::size_t>(omp_get_thread_num())].data();
    for (int y = 0; y < size_.padded[1]; ++y) {
      std::copy_n(from + volume(y * count + x, half_), half_, work + volume(y, half_));
    }
    backward_y_(work);
    z_to_real_(work);
    for (int y = 0; y < size_.nodes[1]; ++y) {
      std::copy_n(reinterpret_cast<const Real*>(work + volume(y, half_)), size_.nodes[2],
                  values + volume(x * size_.nodes[1] + y, size_.nodes[2]));
    }
  }
}

// by_x_ is ordered by y wave number, so the blocks for the ranks follow one another in it. What arrives from a rank is
// (own y, its x, half): rows to be set into by_y_.
template <class Real>
void Convolution<Real>::transpose_to_y() {
  std::vector<int> to, from;
  for (std::size_t r = 0; r < x_.size(); ++r) {
    to.push_back(static_cast<int>(volume(y_[r].count(), planes().count(), half_)));
    from.push_back(static_cast<int>(volume(own_y().count(), x_[r].count(), half_)));
  }
  AlignedVector<Complex> arrived(by_y_.size());
  exchange(by_x_.data(), to, arrived.data(), from, comm_);
  const Complex* block = arrived.data();
  for (const PlaneRange& x : x_) {
    for (int y = 0; y < own_y().count(); ++y) {
      std::copy_n(block, volume(x.count(), half_), &by_y_[volume(y * size_.nodes[0] + x.begin, half_)]);
      block += volume(x.count(), half_);
    }
  }
}

template <class Real>
void Convolution<Real>::transpose_to_x() {
  std::vector<int> to, from;
  AlignedVector<Complex> leaving(by_y_.size());
  Complex* block = leaving.data();
  for (std::size_t r = 0; r < x_.size(); ++r) {
    for (int y = 0; y < own_y().count(); ++y) {
      std::copy_n(&by_y_[volume(y * size_.nodes[0] + x_[r].begin, half_)], volume(x_[r].count(), half_), block);
      block += volume(x_[r].count(), half_);
    }
    to.push_back(static_cast<int>(volume(own_y().count(), x_[r].count(), half_)));
    from.push_back(static_cast<int>(volume(y_[r].count(), planes().count(), half_)));
  }
  exchange(leaving.data(), to, by_x_.data(), from, comm_);
}

template <class Real>
double Convolution<Real>::bytes_sent() const {
  const auto here = static_cast<double>(volume(own_y().count(), planes().count(), half_));
  return sizeof(Complex) * (static_cast<double>(by_x_.size()) + static_cast<double>(by_y_.size()) - 2.0 * here) *
         (comm_.size() > 1 ? 1.0 : 0.0);
}

template class Convolution<float>;
template class Convolution<double>;

}  // namespace breccia::gravity

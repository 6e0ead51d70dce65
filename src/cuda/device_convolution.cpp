#include "cuda/device_convolution.hpp"

#include <algorithm>

#include "gravity/mesh/green.hpp"

namespace breccia::cuda {
namespace {

using gravity::FftKind;
using gravity::PlaneRange;

std::size_t volume(int a, int b, int c = 1) {
  return static_cast<std::size_t>(a) * static_cast<std::size_t>(b) * static_cast<std::size_t>(c);
}

std::vector<PlaneRange> shares(int planes, int ranks) {
  std::vector<PlaneRange> all;
  for (int r = 0; r < ranks; ++r) all.push_back(gravity::share_of_planes(planes, ranks, r));
  return all;
}

std::vector<int> places(const std::vector<int>& counts) {
  std::vector<int> at(counts.size(), 0);
  for (std::size_t r = 1; r < counts.size(); ++r) at[r] = at[r - 1] + counts[r - 1];
  return at;
}

template <class Real>
MPI_Datatype mpi_real() {
  return sizeof(Real) == 4 ? MPI_FLOAT : MPI_DOUBLE;
}
template <class Real>
MPI_Datatype mpi_complex() {
  return sizeof(Real) == 4 ? MPI_C_FLOAT_COMPLEX : MPI_C_DOUBLE_COMPLEX;
}

}  // namespace

template <class Real>
DeviceConvolution<Real>::DeviceConvolution(const gravity::MeshSize& size, const gravity::Kernel& kernel,
                                           const mpi::Comm& comm, cudaStream_t stream)
    : size_(size),
      comm_(comm),
      stream_(stream),
      half_(size.padded[2] / 2 + 1),
      x_(shares(size.nodes[0], comm.size())),
      y_(shares(size.padded[1], comm.size())),
      to_yz_(FftKind::kRealToComplex, {{size.padded[1], size.padded[2]}, own_x().count(), 1, size.padded[1] * half_},
             stream),
      from_yz_(FftKind::kComplexToReal, {{size.padded[1], size.padded[2]}, own_x().count(), 1, size.padded[1] * half_},
               stream),
      to_x_(FftKind::kForward, {{size.padded[0]}, own_y().count() * half_, own_y().count() * half_, 1}, stream),
      from_x_(FftKind::kBackward, {{size.padded[0]}, own_y().count() * half_, own_y().count() * half_, 1}, stream) {
  by_x_.allocate(volume(comm.size() > 1 ? own_x().count() : size.padded[0], size.padded[1], half_));
  share_work_area();
  make_kernel(kernel);
  if (comm.size() == 1) return;
  by_y_.allocate(volume(size.padded[0], own_y().count(), half_));
  own_nodes_.allocate(volume(own_x().count(), size.nodes[1], size.nodes[2]));
  potential_.allocate(volume(size.nodes[0], size.nodes[1], size.nodes[2]));
  const std::size_t most = std::max(volume(own_x().count(), size.padded[1], half_),
                                    volume(size.nodes[0], std::max(own_y().count(), size.nodes[1]), half_));
  leaving_.reserve(most);
  arrived_.reserve(most);
  const double here = static_cast<double>(volume(own_x().count(), own_y().count(), half_));
  bytes_sent_ = sizeof(Complex) * (static_cast<double>(volume(own_x().count(), size.padded[1], half_)) +
                                   static_cast<double>(volume(size.nodes[0], own_y().count(), half_)) - 2.0 * here) +
                sizeof(Real) * static_cast<double>(own_nodes_.size()) * (comm.size() - 1);
}

template <class Real>
void DeviceConvolution<Real>::share_work_area() {
  DeviceFft<Real>* const transforms[] = {&to_yz_, &from_yz_, &to_x_, &from_x_};
  std::size_t most = 0;
  for (const DeviceFft<Real>* transform : transforms) most = std::max(most, transform->work_bytes());
  work_area_.allocate(most);
  for (DeviceFft<Real>* transform : transforms) transform->use_work_area(work_area_.data());
}

template <class Real>
void DeviceConvolution<Real>::make_kernel(const gravity::Kernel& kernel) {
  first_folded_ = size_.padded[1];
  int end = 0;
  for (int y = own_y().begin; y < own_y().end; ++y) {
    first_folded_ = std::min(first_folded_, gravity::folded(y, size_.padded[1]));
    end = std::max(end, gravity::folded(y, size_.padded[1]) + 1);
  }
  const std::vector<double> values =
      gravity::transformed_kernel(size_, kernel, {first_folded_, std::max(first_folded_, end)}, 1);
  kernel_.allocate(values.size());
  std::vector<Real> rounded(values.size());
  std::transform(values.begin(), values.end(), rounded.begin(), [](double v) { return static_cast<Real>(v); });
  kernel_.upload(rounded, stream_);
}

template <class Real>
MeshPlanes<Real> DeviceConvolution<Real>::masses() const {
  return {reinterpret_cast<Real*>(by_x_.data()), own_x().begin, own_x().end, size_.padded[1], 2 * half_};
}

template <class Real>
MeshPlanes<const Real> DeviceConvolution<Real>::potential() const {
  if (comm_.size() > 1) return {potential_.data(), 0, size_.nodes[0], size_.nodes[1], size_.nodes[2]};
  return {reinterpret_cast<const Real*>(by_x_.data()), 0, size_.nodes[0], size_.padded[1], 2 * half_};
}

template <class Real>
void DeviceConvolution<Real>::apply() {
  to_yz_(by_x_.data());
  if (comm_.size() > 1) transpose_to_y();
  const std::size_t filled = volume(size_.nodes[0], own_y().count(), half_);
  const std::size_t all = volume(size_.padded[0], own_y().count(), half_);
  if (all > filled) {
    check(cudaMemsetAsync(by_y() + filled, 0, (all - filled) * sizeof(Complex), stream_), "planes beyond the mesh");
  }
  to_x_(by_y());
  launch_multiply<Real>({.values = reinterpret_cast<Real*>(by_y()),
                         .kernel = kernel_.data(),
                         .padded = {size_.padded[0], size_.padded[1]},
                         .half = half_,
                         .first_row = own_y().begin,
                         .rows = own_y().count(),
                         .first_folded = first_folded_},
                        stream_);
  from_x_(by_y());
  if (comm_.size() > 1) transpose_to_x();
  from_yz_(by_x_.data());
  if (comm_.size() > 1) share_potential();
}

template <class Real>
std::vector<int> DeviceConvolution<Real>::counts_by_x() const {
  std::vector<int> counts;
  for (const PlaneRange& y : y_) counts.push_back(static_cast<int>(volume(own_x().count(), y.count(), half_)));
  return counts;
}
template <class Real>
std::vector<int> DeviceConvolution<Real>::counts_by_y() const {
  std::vector<int> counts;
  for (const PlaneRange& x : x_) counts.push_back(static_cast<int>(volume(x.count(), own_y().count(), half_)));
  return counts;
}

template <class Real>
void DeviceConvolution<Real>::exchange(const Complex* send, const std::vector<int>& send_counts, Complex* receive,
                                       const std::vector<int>& receive_counts) {
  const std::vector<int> send_at = places(send_counts);
  const std::vector<int> receive_at = places(receive_counts);
  MPI_Alltoallv(send, send_counts.data(), send_at.data(), mpi_complex<Real>(), receive, receive_counts.data(),
                receive_at.data(), mpi_complex<Real>(), comm_.handle());
}

// For rank r: (own x, its y, half). What arrives from a rank, (its x, own y, half), is one stretch of by_y_.
template <class Real>
void DeviceConvolution<Real>::transpose_to_y() {
  const std::size_t plane = volume(size_.padded[1], half_) * sizeof(Complex);
  Complex* to = leaving_.data();
  for (const PlaneRange& y : y_) {
    const std::size_t row = volume(y.count(), half_) * sizeof(Complex);
    if (row > 0 && own_x().count() > 0) {
      check(cudaMemcpy2DAsync(to, row, by_x_.data() + volume(y.begin, half_), plane, row,
                              static_cast<std::size_t>(own_x().count()), cudaMemcpyDeviceToHost, stream_),
            "planes of x to the host");
    }
    to += volume(own_x().count(), y.count(), half_);
  }
  check(cudaStreamSynchronize(stream_), "planes of x to the host");
  exchange(leaving_.data(), counts_by_x(), arrived_.data(), counts_by_y());
  const std::size_t bytes = volume(size_.nodes[0], own_y().count(), half_) * sizeof(Complex);
  check(cudaMemcpyAsync(by_y_.data(), arrived_.data(), bytes, cudaMemcpyHostToDevice, stream_),
        "wave numbers of y to the device");
}

template <class Real>
void DeviceConvolution<Real>::transpose_to_x() {
  const std::size_t bytes = volume(size_.nodes[0], own_y().count(), half_) * sizeof(Complex);
  check(cudaMemcpyAsync(leaving_.data(), by_y_.data(), bytes, cudaMemcpyDeviceToHost, stream_),
        "wave numbers of y to the host");
  check(cudaStreamSynchronize(stream_), "wave numbers of y to the host");
  exchange(leaving_.data(), counts_by_y(), arrived_.data(), counts_by_x());
  const std::size_t plane = volume(size_.padded[1], half_) * sizeof(Complex);
  const Complex* from = arrived_.data();
  for (const PlaneRange& y : y_) {
    const std::size_t row = volume(y.count(), half_) * sizeof(Complex);
    if (row > 0 && own_x().count() > 0) {
      check(cudaMemcpy2DAsync(by_x_.data() + volume(y.begin, half_), plane, from, row, row,
                              static_cast<std::size_t>(own_x().count()), cudaMemcpyHostToDevice, stream_),
            "planes of x to the device");
    }
    from += volume(own_x().count(), y.count(), half_);
  }
}

// Bodies of any rank may lie anywhere in the box.
template <class Real>
void DeviceConvolution<Real>::share_potential() {
  const int ny = size_.nodes[1];
  const int nz = size_.nodes[2];
  const MeshPlanes<Real> own{own_nodes_.data(), own_x().begin, own_x().end, ny, nz};
  launch_take_nodes(masses(), own, stream_);
  auto* send = reinterpret_cast<Real*>(leaving_.data());
  auto* all = reinterpret_cast<Real*>(arrived_.data());
  check(cudaMemcpyAsync(send, own_nodes_.data(), own.size() * sizeof(Real), cudaMemcpyDeviceToHost, stream_),
        "potential to the host");
  check(cudaStreamSynchronize(stream_), "potential to the host");
  std::vector<int> counts;
  for (const PlaneRange& x : x_) counts.push_back(static_cast<int>(volume(x.count(), ny, nz)));
  const std::vector<int> at = places(counts);
  MPI_Allgatherv(send, static_cast<int>(own.size()), mpi_real<Real>(), all, counts.data(), at.data(), mpi_real<Real>(),
                 comm_.handle());
  check(cudaMemcpyAsync(potential_.data(), all, potential_.bytes(), cudaMemcpyHostToDevice, stream_),
        "potential to the device");
}

template class DeviceConvolution<float>;
template class DeviceConvolution<double>;

}  // namespace breccia::cuda

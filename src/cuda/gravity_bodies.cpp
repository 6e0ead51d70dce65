#include "cuda/gravity_bodies.hpp"

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

namespace breccia::cuda {

template <class Real>
void GravityBodies<Real>::gather(const PredictArguments<Real>& own) {
  own_ = own.count;
  predicted_.reserve(4 * std::size_t{own_});
  launch_predict(own, predicted_.data(), stream_);
  first_ = 0;
  all_ = own_;
  bytes_sent_ = 0.0;
  if (comm_.size() > 1) exchange();
}

template <class Real>
void GravityBodies<Real>::exchange() {
  const std::size_t own = own_;
  sent_.reserve(4 * own);
  if (own > 0) {
    check(cudaMemcpyAsync(sent_.data(), predicted_.data(), 4 * own * sizeof(double), cudaMemcpyDeviceToHost, stream_),
          "positions to the host");
  }
  check(cudaStreamSynchronize(stream_), "positions to the host");

  const std::vector<std::int64_t> counts = comm_.allgather(static_cast<std::int64_t>(own));
  std::int64_t all = 0;
  std::vector<int> count, place;
  for (std::size_t r = 0; r < counts.size(); ++r) {
    if (static_cast<int>(r) == comm_.rank()) first_ = static_cast<unsigned>(all);
    count.push_back(static_cast<int>(counts[r]));
    place.push_back(static_cast<int>(all));
    all += counts[r];
  }
  if (all > std::numeric_limits<int>::max()) {
    throw UsageError("gravity on devices: " + std::to_string(all) +
                     " particles are more than the 2147483647 that each " + "device can hold; use --device host");
  }
  all_ = static_cast<unsigned>(all);
  received_.reserve(4 * static_cast<std::size_t>(all));
  for (std::size_t c = 0; c < 4; ++c) {
    MPI_Allgatherv(sent_.data() + c * own, static_cast<int>(own), MPI_DOUBLE,
                   received_.data() + c * static_cast<std::size_t>(all), count.data(), place.data(), MPI_DOUBLE,
                   comm_.handle());
  }
  bytes_sent_ = 4.0 * sizeof(double) * static_cast<double>(own) * (comm_.size() - 1);
  gathered_.reserve(4 * static_cast<std::size_t>(all));
  if (all > 0) {
    check(cudaMemcpyAsync(gathered_.data(), received_.data(), 4 * static_cast<std::size_t>(all) * sizeof(double),
                          cudaMemcpyHostToDevice, stream_),
          "positions to the device");
  }
}

template <class Real>
void GravityBodies<Real>::forget() {
  predicted_ = {};
  gathered_ = {};
  all_ = own_ = first_ = 0;
}

template <class Real>
BodyArrays GravityBodies<Real>::all() const {
  const double* values = comm_.size() > 1 ? gathered_.data() : predicted_.data();
  const std::size_t stride = all_;
  return {{values, values + stride, values + 2 * stride}, values + 3 * stride, all_};
}

template <class Real>
BodyArrays GravityBodies<Real>::own_bodies() const {
  const double* values = predicted_.data();
  const std::size_t stride = own_;
  return {{values, values + stride, values + 2 * stride}, values + 3 * stride, own_};
}

template <class Real>
Extremes GravityBodies<Real>::extremes() {
  const unsigned count = reducers(all_);
  extremes_.reserve(count);
  launch_extremes(all(), extremes_.data(), stream_);
  const std::vector<Extremes> parts = extremes_.download(count, stream_);
  Extremes result = parts[0];
  for (const Extremes& part : parts) {
    for (std::size_t k = 0; k < std::size(part.of); ++k) result.of[k] = std::max(result.of[k], part.of[k]);
  }
  return result;
}

template class GravityBodies<float>;
template class GravityBodies<double>;

}  // namespace breccia::cuda

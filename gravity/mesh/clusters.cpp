#include "gravity/mesh/clusters.hpp"

#include <algorithm>
#include <cmath>

namespace breccia::gravity {
namespace {

// Centres are rounded to this [cells].
constexpr double kCentreUnit = 1.0 / 256.0;

// z-bins per column width: about two particles each, so that clusters are cut nearly in the order of z.
constexpr int kBinsPerWidth = 8;

// Columns and bins are limited to this many per particle: a few particles far away must not cost memory.
constexpr double kBinsPerParticle = 8.0;

double component(Vec3d v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

}  // namespace

template <class Real>
void Clusters<Real>::build(std::span<const Vec3d> position, std::span<const double> mass, double spacing, int threads) {
  lay_columns(position, spacing);
  sort(position, threads);

  const std::size_t columns = static_cast<std::size_t>(nx_) * static_cast<std::size_t>(ny_);
  first_.assign(columns + 1, 0);
  for (std::size_t c = 0; c < columns; ++c) {
    const std::size_t bins = static_cast<std::size_t>(bins_);
    const std::int64_t particles = start_[(c + 1) * bins] - start_[c * bins];
    first_[c + 1] = first_[c] + (particles + kClusterSize - 1) / kClusterSize;
  }
  const auto clusters = static_cast<std::size_t>(count() + kClusterSize);
  for (int axis = 0; axis < 3; ++axis) {
    centre_[axis].resize(clusters);
    half_[axis].resize(clusters);
    offset_[axis].resize(clusters * kClusterSize);
    // What lies behind the last cluster is loaded with it but not used.
    std::fill(centre_[axis].end() - kClusterSize, centre_[axis].end(), Real(0));
    std::fill(half_[axis].end() - kClusterSize, half_[axis].end(), Real(0));
  }
  mass_.resize(clusters * kClusterSize);
  slots_.resize(position.size());
#pragma omp parallel for num_threads(threads) schedule(dynamic, 16)
  for (std::size_t c = 0; c < columns; ++c) fill_column(c, position, mass);
}

template <class Real>
void Clusters<Real>::lay_columns(std::span<const Vec3d> position, double spacing) {
  nx_ = ny_ = bins_ = 0;
  if (position.empty()) return;
  Vec3d high = low_ = position[0];
  for (const Vec3d p : position) {
    low_ = {std::min(low_.x, p.x), std::min(low_.y, p.y), std::min(low_.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  const Vec3d extent = high - low_;
  // A cluster as wide as high.
  width_ = std::cbrt(static_cast<double>(kClusterSize)) * spacing;
  const double most = kBinsPerParticle * static_cast<double>(position.size()) + 64.0;
  for (;; width_ *= 1.5) {
    bin_ = width_ / kBinsPerWidth;
    const double columns = (std::floor(extent.x / width_) + 1.0) * (std::floor(extent.y / width_) + 1.0);
    if (columns * (std::floor(extent.z / bin_) + 1.0) <= most) break;
  }
  nx_ = static_cast<int>(extent.x / width_) + 1;
  ny_ = static_cast<int>(extent.y / width_) + 1;
  bins_ = static_cast<int>(extent.z / bin_) + 1;
}

// Counting sort by column and z-bin; particles of one bin keep their order.
template <class Real>
void Clusters<Real>::sort(std::span<const Vec3d> position, int threads) {
  const std::size_t n = position.size();
  key_.resize(n);
  order_.resize(n);
  start_.assign(static_cast<std::size_t>(nx_) * static_cast<std::size_t>(ny_) * static_cast<std::size_t>(bins_) + 1, 0);
#pragma omp parallel for num_threads(threads) schedule(static)
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3d d = position[i] - low_;
    const int x = std::min(static_cast<int>(d.x / width_), nx_ - 1);
    const int y = std::min(static_cast<int>(d.y / width_), ny_ - 1);
    const int z = std::min(static_cast<int>(d.z / bin_), bins_ - 1);
    key_[i] = static_cast<std::uint32_t>((x * ny_ + y) * bins_ + z);
  }
  for (const std::uint32_t k : key_) ++start_[k + 1];
  for (std::size_t b = 1; b < start_.size(); ++b) start_[b] += start_[b - 1];
  // start_[k] moves to the end of bin k, which is the start of the next one.
  for (std::size_t i = 0; i < n; ++i) order_[start_[key_[i]]++] = static_cast<std::uint32_t>(i);
  std::copy_backward(start_.begin(), start_.end() - 1, start_.end());
  start_[0] = 0;
}

template <class Real>
void Clusters<Real>::fill_column(std::size_t column, std::span<const Vec3d> position, std::span<const double> mass) {
  const std::size_t bins = static_cast<std::size_t>(bins_);
  const std::span<const std::uint32_t> members(order_.data() + start_[column * bins],
                                               order_.data() + start_[(column + 1) * bins]);
  auto cluster = static_cast<std::size_t>(first_[column]);
  for (std::size_t i = 0; i < members.size(); i += kClusterSize) {
    fill_cluster(cluster++, members.subspan(i, std::min<std::size_t>(kClusterSize, members.size() - i)), position,
                 mass);
  }
}

template <class Real>
void Clusters<Real>::fill_cluster(std::size_t cluster, std::span<const std::uint32_t> members,
                                  std::span<const Vec3d> position, std::span<const double> mass) {
  const std::size_t slot = cluster * kClusterSize;
  for (int axis = 0; axis < 3; ++axis) {
    double low = component(position[members[0]], axis);
    double high = low;
    for (const std::uint32_t i : members) {
      low = std::min(low, component(position[i], axis));
      high = std::max(high, component(position[i], axis));
    }
    const double centre = std::round(0.5 * (low + high) / kCentreUnit) * kCentreUnit;
    centre_[axis][cluster] = static_cast<Real>(centre);
    half_[axis][cluster] = static_cast<Real>(0.5 * (high - low) + kCentreUnit);
    Real* offset = &offset_[axis][slot];
    for (std::size_t i = 0; i < static_cast<std::size_t>(kClusterSize); ++i) {
      const std::uint32_t member = members[i < members.size() ? i : 0];
      offset[i] = static_cast<Real>(component(position[member], axis) - centre);
    }
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(kClusterSize); ++i) {
    mass_[slot + i] = i < members.size() ? static_cast<Real>(mass[members[i]]) : Real(0);
    if (i < members.size()) slots_[members[i]] = static_cast<std::int64_t>(slot + i);
  }
}

template <class Real>
ClusterArrays<Real> Clusters<Real>::arrays() const {
  return {count(),
          {centre_[0].data(), centre_[1].data(), centre_[2].data()},
          {half_[0].data(), half_[1].data(), half_[2].data()},
          {offset_[0].data(), offset_[1].data(), offset_[2].data()},
          mass_.data()};
}

template <class Real>
ClusterColumns Clusters<Real>::columns() const {
  return {{low_.x, low_.y}, width_, nx_, ny_, first_.data()};
}

template class Clusters<float>;
template class Clusters<double>;

}  // namespace breccia::gravity

#include "scene/lattice.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "scene/shapes.hpp"

namespace breccia::scene {

namespace {

bool is_close_packed(Lattice lattice) { return lattice == Lattice::kFcc || lattice == Lattice::kHcp; }

Vec3d conventional_cell(Lattice lattice, double a) {
  const double r3 = std::numbers::sqrt3;
  if (lattice == Lattice::kFcc) return Vec3d{a, a, a} * std::numbers::sqrt2;
  if (lattice == Lattice::kHcp) return {a, a * r3, a * std::sqrt(8.0 / 3.0)};
  return {a, a, a};
}

std::vector<Vec3d> basis_points(Lattice lattice) {
  if (lattice == Lattice::kFcc) return {{0, 0, 0}, {0, 0.5, 0.5}, {0.5, 0, 0.5}, {0.5, 0.5, 0}};
  if (lattice == Lattice::kHcp) return {{0, 0, 0}, {0.5, 0.5, 0}, {0.5, 1.0 / 6.0, 0.5}, {0, 2.0 / 3.0, 0.5}};
  return {{0, 0, 0}};
}

double smallest(const Vec3d& v) { return std::min({v.x, v.y, v.z}); }

// Quasi-random points of the unit cube (Roberts' R3 sequence: powers of the root of g^4 = g + 1).
Vec3d quasi_random(int n) {
  constexpr double g = 1.2207440846057596;
  const auto fraction = [](double x) { return x - std::floor(x); };
  return {fraction(n / g), fraction(n / (g * g)), fraction(n / (g * g * g))};
}

}  // namespace

double volume_per_particle(Lattice lattice, double spacing) {
  const double cube = spacing * spacing * spacing;
  return is_close_packed(lattice) ? cube / std::numbers::sqrt2 : cube;
}

double lattice_spacing(Lattice lattice, double volume) {
  return std::cbrt(is_close_packed(lattice) ? volume * std::numbers::sqrt2 : volume);
}

LatticeFill::LatticeFill(Lattice lattice, Shape shape, const Vec3d& semi_axes, std::uint64_t count,
                         const RandomStream& stream)
    : lattice_(lattice), shape_(shape), semi_axes_(semi_axes), count_(count), stream_(stream) {
  const double volume = shape_volume(shape, semi_axes) / static_cast<double>(count);
  const double spacing = lattice_spacing(lattice, volume);
  cell_ = conventional_cell(lattice, spacing);
  basis_ = basis_points(lattice);
  // Wider than the covering radius of the lattice: fewer than `count` points lie within the shell, at least `count` up
  // to its outer side.
  const double covering_radius = (lattice == Lattice::kRandom ? 1.75 : 0.9) * spacing;
  shell_ = covering_radius / smallest(semi_axes);
  best_.misfit = std::numeric_limits<double>::infinity();
  for (const Vec3d& origin : origins()) {
    const Cut tried = cut(origin);
    if (tried.misfit < best_.misfit) best_ = tried;
  }
}

// The eight origins that have planes of points or midplanes between them in the centre, which suit flat faces, and
// generic ones, which cut no symmetric shell in two. Large bodies average over so many surface cells that few do.
std::vector<Vec3d> LatticeFill::origins() const {
  const double half_plane = basis_.size() == 1 ? 0.5 : 0.25;
  std::vector<Vec3d> all;
  for (int i = 0; i < 8; ++i) all.push_back(Vec3d{double(i >> 2 & 1), double(i >> 1 & 1), double(i & 1)} * half_plane);
  constexpr std::uint64_t kWork = 2'000'000;
  const int generic = static_cast<int>(std::clamp<std::uint64_t>(kWork / count_, 4, 256));
  for (int n = 1; n <= generic; ++n) all.push_back(quasi_random(n));
  return all;
}

// Visits the points within the bounding box of the shape scaled by `reach` as visit(ordinal, x), x slowest.
template <class Visit>
void LatticeFill::for_each_point(const Vec3d& origin, double reach, Visit visit) const {
  const auto cells = [&](double semi_axis, double cell) {
    return static_cast<std::int64_t>(std::ceil(reach * semi_axis / cell)) + 1;
  };
  const std::int64_t nx = cells(semi_axes_.x, cell_.x);
  const std::int64_t ny = cells(semi_axes_.y, cell_.y);
  const std::int64_t nz = cells(semi_axes_.z, cell_.z);
  std::uint64_t ordinal = 0;
  for (std::int64_t i = -nx; i <= nx; ++i) {
    for (std::int64_t j = -ny; j <= ny; ++j) {
      for (std::int64_t k = -nz; k <= nz; ++k) {
        for (const Vec3d& at : basis_) {
          Vec3d u = Vec3d{double(i), double(j), double(k)} + at + origin;
          if (lattice_ == Lattice::kRandom) u += jitter(ordinal);
          visit(ordinal++, Vec3d{u.x * cell_.x, u.y * cell_.y, u.z * cell_.z});
        }
      }
    }
  }
}

Vec3d LatticeFill::jitter(std::uint64_t ordinal) const {
  const auto xy = stream_.uniform(ordinal, 0);
  const auto z = stream_.uniform(ordinal, 1);
  return {xy[0] - 0.5, xy[1] - 0.5, z[0] - 0.5};
}

LatticeFill::CutKey LatticeFill::cut_key(std::uint64_t ordinal, double radius) const {
  constexpr double kResolution = 1.0e9;
  constexpr std::uint32_t kTieBlock = 2;  // blocks 0 and 1 are the jitter
  const auto words = stream_.words(ordinal, kTieBlock);
  return {static_cast<std::uint64_t>(std::llround(radius * kResolution)), words[0], ordinal};
}

bool LatticeFill::keeps(const Cut& cut, std::uint64_t ordinal, double radius) const {
  return radius < cut.inside || (radius <= 1.0 + shell_ && cut_key(ordinal, radius) <= cut.last);
}

LatticeFill::Cut LatticeFill::cut(const Vec3d& origin) const {
  struct ShellPoint {
    CutKey key;
    Vec3d x;
    double radius;
  };
  Cut result;
  result.origin = origin;
  result.inside = std::max(0.0, 1.0 - shell_);
  std::uint64_t inside = 0;
  Vec3d sum{};
  Sym3<double> squares{};
  const auto add = [&](const Vec3d& x) {
    sum += x;
    squares = squares + Sym3<double>{x.x * x.x, x.y * x.y, x.z * x.z, x.x * x.y, x.x * x.z, x.y * x.z};
  };
  std::vector<ShellPoint> shell;
  for_each_point(origin, 1.0 + shell_, [&](std::uint64_t ordinal, const Vec3d& x) {
    const double radius = scaled_radius(shape_, semi_axes_, x);
    if (radius < result.inside) {
      ++inside;
      add(x);
    } else if (radius <= 1.0 + shell_) {
      shell.push_back({cut_key(ordinal, radius), x, radius});
    }
  });
  const auto end = shell.begin() + static_cast<std::ptrdiff_t>(count_ - inside);
  std::nth_element(shell.begin(), end - 1, shell.end(),
                   [](const ShellPoint& a, const ShellPoint& b) { return a.key < b.key; });
  for (auto point = shell.begin(); point != end; ++point) add(point->x);
  result.last = (end - 1)->key;

  const double n = static_cast<double>(count_);
  result.mean = (1.0 / n) * sum;
  result.misfit = misfit((1.0 / n) * squares, result.mean, (end - 1)->radius);
  return result;
}

// For curved shapes the errors of centre, second moments and cut, all relative and summed in quadrature; flat faces
// want the outermost points as far inside as possible, which is where the planes of the lattice fit the box.
double LatticeFill::misfit(const Sym3<double>& moments, const Vec3d& mean, double cut_radius) const {
  const Vec3d a{mean.x / semi_axes_.x, mean.y / semi_axes_.y, mean.z / semi_axes_.z};
  if (shape_ == Shape::kBox || shape_ == Shape::kCylinder) return std::sqrt(dot(a, a)) + cut_radius;
  const Vec3d m = second_moments(shape_, semi_axes_);
  const Vec3d diagonal{moments.xx / m.x - 1, moments.yy / m.y - 1, moments.zz / m.z - 1};
  const Vec3d mixed{moments.yz / std::sqrt(m.y * m.z), moments.xz / std::sqrt(m.x * m.z),
                    moments.xy / std::sqrt(m.x * m.y)};
  const double cut = cut_radius - 1.0;
  return std::sqrt(dot(a, a) + dot(diagonal, diagonal) + dot(mixed, mixed) + cut * cut);
}

std::vector<Vec3d> LatticeFill::points(std::uint64_t begin, std::uint64_t end) const {
  std::vector<Vec3d> result;
  result.reserve(end - begin);
  std::uint64_t number = 0;
  for_each_point(best_.origin, 1.0 + shell_, [&](std::uint64_t ordinal, const Vec3d& x) {
    if (number >= end) return;
    const double radius = scaled_radius(shape_, semi_axes_, x);
    if (!keeps(best_, ordinal, radius)) return;
    if (number >= begin) result.push_back(x - best_.mean);
    ++number;
  });
  return result;
}

}  // namespace breccia::scene

#include "bench/gravity_states.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "breccia/constants.hpp"
#include "breccia/error.hpp"
#include "breccia/random.hpp"

namespace breccia::bench {
namespace {

constexpr double kDensity = 2700.0;
constexpr double kJitter = 0.2;  ///< of the lattice spacing
constexpr int kFragments = 49;

double volume(Vec3d semi_axes) { return 4.0 / 3.0 * kPi * semi_axes.x * semi_axes.y * semi_axes.z; }

class Builder {
 public:
  explicit Builder(GravityState& state, double particle_mass) : state_(state), particle_mass_(particle_mass) {}

  // Exactly `count` points of a jittered cubic lattice, the innermost of those in a slightly larger ellipsoid.
  void add_ellipsoid(std::int64_t count, Vec3d centre, Vec3d axes) {
    struct Point {
      Vec3d x;
      double level;
    };
    const double h = std::cbrt(volume(axes) / static_cast<double>(count));
    std::vector<Point> points;
    const auto reach = [&](double axis) { return static_cast<int>(1.2 * axis / h) + 2; };
    for (int i = -reach(axes.x); i <= reach(axes.x); ++i) {
      for (int j = -reach(axes.y); j <= reach(axes.y); ++j) {
        for (int k = -reach(axes.z); k <= reach(axes.z); ++k) {
          const auto [a, b, c] = random3();
          const Vec3d x{h * (i + kJitter * (2 * a - 1)), h * (j + kJitter * (2 * b - 1)),
                        h * (k + kJitter * (2 * c - 1))};
          const Vec3d u{x.x / axes.x, x.y / axes.y, x.z / axes.z};
          if (dot(u, u) < 1.5) points.push_back({x, dot(u, u)});
        }
      }
    }
    std::sort(points.begin(), points.end(), [](const Point& p, const Point& q) { return p.level < q.level; });
    points.resize(static_cast<std::size_t>(count));
    for (const Point& p : points) add(centre + p.x);
  }

  // Singles with directions and logarithms of distances uniform.
  void add_ejecta(std::int64_t count, double nearest, double farthest) {
    for (std::int64_t n = 0; n < count; ++n) {
      const double r = nearest * std::pow(farthest / nearest, random3().x);
      add(r * direction());
    }
  }

  Vec3d direction() {
    const auto [a, b, c] = random3();
    const double z = 2 * a - 1;
    const double s = std::sqrt(1 - z * z);
    return {s * std::cos(2 * kPi * b), s * std::sin(2 * kPi * b), z};
  }
  Vec3d random3() {
    const auto [a, b] = random_.uniform(draws_, 0);
    const auto [c, d] = random_.uniform(draws_, 1);
    ++draws_;
    return {a, b, c};
  }

 private:
  void add(Vec3d x) {
    state_.position.push_back(x);
    state_.mass.push_back(particle_mass_);
  }

  GravityState& state_;
  double particle_mass_;
  RandomStream random_{1, 0x62656e63};
  std::uint64_t draws_ = 0;
};

// As the engine holds particles: those of a block of nodes together, x slowest.
void sort_by_blocks(GravityState& state, double width) {
  std::vector<std::array<std::int64_t, 4>> keys;
  for (std::size_t i = 0; i < state.position.size(); ++i) {
    const Vec3d p = (1.0 / width) * state.position[i];
    keys.push_back({std::llround(p.x), std::llround(p.y), std::llround(p.z), static_cast<std::int64_t>(i)});
  }
  std::sort(keys.begin(), keys.end());
  GravityState sorted = state;
  for (std::size_t k = 0; k < keys.size(); ++k) {
    const auto from = static_cast<std::size_t>(keys[k][3]);
    sorted.position[k] = state.position[from];
    sorted.in_body[k] = state.in_body[from];
  }
  state = std::move(sorted);
}

}  // namespace

GravityState gravity_state(char name, std::int64_t particles) {
  const Vec3d sphere{50e3, 50e3, 50e3};
  const double particle_volume = 2.0 * volume(sphere) / static_cast<double>(particles);
  GravityState state;
  state.softening = 0.05 * std::cbrt(particle_volume * 1.41);
  Builder builder(state, kDensity * particle_volume);
  std::int64_t body = particles / 2;
  if (name == 'a' || name == 'p' || name == 'q') {
    const double half = name == 'a' ? 100e3 : (name == 'p' ? 500e3 : 2500e3);
    builder.add_ellipsoid(body, {-half, 0, 0}, sphere);
    builder.add_ellipsoid(particles - body, {half, 0, 0}, sphere);
  } else if (name == 'b' || name == 'n' || name == 'f') {
    body = particles * 3 / 4;
    builder.add_ellipsoid(body, {0, 0, 0}, {119e3, 40e3, 40e3});
    builder.add_ejecta(particles - body, 130e3, name == 'b' ? 2e7 : (name == 'n' ? 1e6 : 4e7));
  } else if (name == 'c') {
    // Fragment k is (k+1)^-1 of the largest.
    std::int64_t left = particles * 6 / 10;
    double parts = 0.0;
    for (int k = 0; k < kFragments; ++k) parts += 1.0 / (k + 1);
    const double whole = static_cast<double>(left) / parts;
    for (int k = 0; k < kFragments && left > 0; ++k) {
      const auto count = std::min(left, std::max<std::int64_t>(1, static_cast<std::int64_t>(whole / (k + 1))));
      const double radius = std::cbrt(static_cast<double>(count) * particle_volume * 0.75 / kPi);
      const double r = k == 0 ? 0.0 : 300e3 * std::pow(2e7 / 300e3, builder.random3().x);
      builder.add_ellipsoid(count, r * builder.direction(), {radius, radius, radius});
      if (k == 0) body = count;
      left -= count;
    }
    builder.add_ejecta(particles - static_cast<std::int64_t>(state.position.size()), 300e3, 2e7);
  } else {
    throw UsageError("gravity states are a, b, c, n, f, p and q; not " + std::string(1, name));
  }
  state.in_body.assign(state.position.size(), 0);
  std::fill_n(state.in_body.begin(), body, char{1});
  sort_by_blocks(state, 4.0 * std::cbrt(1.41 * particle_volume));
  return state;
}

}  // namespace breccia::bench

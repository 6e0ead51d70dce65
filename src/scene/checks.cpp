#include "scene/checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "breccia/error.hpp"
#include "scene/body_points.hpp"
#include "scene/from_root.hpp"
#include "scene/resolve.hpp"
#include "scene/shapes.hpp"

namespace breccia::scene {

namespace {

// Points in cubic bins of side `distance`, to ask whether one of them is nearer than that.
class NearPoints {
 public:
  NearPoints(const std::vector<Vec3d>& points, double distance) : distance_(distance) {
    for (const Vec3d& x : points) bins_.emplace(key(bin(x.x), bin(x.y), bin(x.z)), x);
  }
  [[nodiscard]] bool near(const Vec3d& x) const {
    for (std::int64_t i = -1; i <= 1; ++i)
      for (std::int64_t j = -1; j <= 1; ++j)
        for (std::int64_t k = -1; k <= 1; ++k)
          if (near_in_bin(x, key(bin(x.x) + i, bin(x.y) + j, bin(x.z) + k))) return true;
    return false;
  }

 private:
  [[nodiscard]] bool near_in_bin(const Vec3d& x, std::uint64_t bin_key) const {
    const auto [first, last] = bins_.equal_range(bin_key);
    return std::any_of(first, last, [&](const auto& entry) {
      const Vec3d d = entry.second - x;
      return dot(d, d) < distance_ * distance_;
    });
  }
  [[nodiscard]] std::int64_t bin(double x) const { return static_cast<std::int64_t>(std::floor(x / distance_)); }
  // 21 bits per axis; bins that share a key cost time, not correctness.
  [[nodiscard]] static std::uint64_t key(std::int64_t i, std::int64_t j, std::int64_t k) {
    constexpr std::uint64_t kMask = (1ULL << 21U) - 1;
    const auto bits = [](std::int64_t n) { return static_cast<std::uint64_t>(n) & kMask; };
    return bits(i) << 42U | bits(j) << 21U | bits(k);
  }

  double distance_;
  std::unordered_multimap<std::uint64_t, Vec3d> bins_;
};

bool is_sphere(const BodyParameters& body) { return body.shape == Shape::kSphere; }

bool spheres_overlap(const BodyParameters& a, const BodyParameters& b) {
  constexpr double kRounding = 1.0e-9;
  const Vec3d d = a.position - b.position;
  return std::sqrt(dot(d, d)) < (a.semi_axes.x + b.semi_axes.x) * (1.0 - kRounding);
}

bool bounding_boxes_overlap(const BodyParameters& a, const BodyParameters& b) {
  const Vec3d d = a.position - b.position;
  const Vec3d reach = a.semi_axes + b.semi_axes;
  return std::abs(d.x) < reach.x && std::abs(d.y) < reach.y && std::abs(d.z) < reach.z;
}

std::vector<Vec3d> particle_positions(const Scene& scene, std::uint32_t index) {
  const BodyParameters& body = scene.bodies[index];
  std::vector<Vec3d> points;
  Vec3d offset = body.position;
  if (body.shape == Shape::kParticles) {
    points = read_particle_file(body.file, 0, body.particles).position;
    offset -= summarize_particle_file(body.file).centre;
  } else {
    points = body_lattice(scene, index).points(0, body.particles);
  }
  for (Vec3d& x : points) x += offset;
  return points;
}

// Whether a particle of `intruder` lies in the matter of `host`: a quarter of a spacing below the surface of an
// analytic shape, or within half a spacing of a particle read from a file.
bool penetrates(const Scene& scene, std::uint32_t host_index, const std::vector<Vec3d>& intruder) {
  const BodyParameters& host = scene.bodies[host_index];
  if (host.shape == Shape::kParticles) {
    const NearPoints matter(particle_positions(scene, host_index), 0.5 * host.spacing);
    return std::any_of(intruder.begin(), intruder.end(), [&](const Vec3d& x) { return matter.near(x); });
  }
  const double skin = 0.25 * host.spacing / std::min({host.semi_axes.x, host.semi_axes.y, host.semi_axes.z});
  return std::any_of(intruder.begin(), intruder.end(), [&](const Vec3d& x) {
    return scaled_radius(host.shape, host.semi_axes, x - host.position) < 1.0 - skin;
  });
}

bool bodies_overlap(const Scene& scene, std::uint32_t i, std::uint32_t j) {
  const BodyParameters& a = scene.bodies[i];
  const BodyParameters& b = scene.bodies[j];
  if (is_sphere(a) && is_sphere(b)) return spheres_overlap(a, b);
  if (!bounding_boxes_overlap(a, b)) return false;
  return penetrates(scene, i, particle_positions(scene, j)) || penetrates(scene, j, particle_positions(scene, i));
}

}  // namespace

void check_overlap(const Scene& scene, const Document& document, const mpi::Comm* comm) {
  from_root(comm, [&] {
    for (std::uint32_t j = 1; j < scene.bodies.size(); ++j)
      for (std::uint32_t i = 0; i < j; ++i)
        if (bodies_overlap(scene, i, j))
          fail(document, fmt::format("body[{}].position", j),
               fmt::format("the bodies \"{}\" and \"{}\" overlap; move one of them", scene.bodies[i].name,
                           scene.bodies[j].name));
    return std::string();
  });
}

void check_inside_boundaries(const Scene& scene, const Document& document) {
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const BodyParameters& body = scene.bodies[i];
    if (body.shape == Shape::kParticles) continue;
    for (std::size_t b = 0; b < scene.boundaries.size(); ++b) {
      const BoundaryPlane& plane = scene.boundaries[b];
      const double gap =
          dot(body.position - plane.point, plane.normal) - support(body.shape, body.semi_axes, plane.normal);
      if (gap < -0.1 * body.spacing)
        fail(document, fmt::format("body[{}].position", i),
             fmt::format("\"{}\" reaches {:.6g} m through the plane boundary[{}]", body.name, -gap, b));
    }
  }
}

void check_speeds(const Scene& scene, const Document& document) {
  constexpr double kLight = 299792458.0;  // [m/s]
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const BodyParameters& body = scene.bodies[i];
    const double speed = std::sqrt(dot(body.velocity, body.velocity));
    const double reach = std::max({body.semi_axes.x, body.semi_axes.y, body.semi_axes.z});
    const double rim = std::sqrt(dot(body.spin, body.spin)) * reach;
    const auto refuse = [&](const char* key, double value) {
      fail(document, fmt::format("body[{}].{}", i, key),
           fmt::format("\"{}\" would move at {:.6g} m/s, faster than light", body.name, value));
    };
    if (!(speed < kLight)) refuse("velocity", speed);
    if (!(rim < kLight)) refuse("spin", rim);
  }
}

}  // namespace breccia::scene

// Direct summation as written in a textbook: one pair after the other, in double.
#pragma once

#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include "breccia/constants.hpp"
#include "breccia/linalg.hpp"

namespace breccia::gravity {

struct Cloud {
  std::vector<Vec3d> position;
  std::vector<double> mass;
};

struct Field {
  std::vector<Vec3d> acceleration;
  std::vector<double> potential;
};

inline Field plain_sum(const Cloud& cloud, double softening) {
  const std::size_t n = cloud.position.size();
  Field field{std::vector<Vec3d>(n), std::vector<double>(n)};
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      if (i == j) continue;
      const Vec3d d = cloud.position[j] - cloud.position[i];
      const double r = std::sqrt(dot(d, d) + softening * softening);
      field.acceleration[i] += (kGravitationalConstant * cloud.mass[j] / (r * r * r)) * d;
      field.potential[i] -= kGravitationalConstant * cloud.mass[j] / r;
    }
  }
  return field;
}

/// sqrt(mean |a - b|^2 / mean |b|^2).
inline double rms_error(const std::vector<Vec3d>& a, const std::vector<Vec3d>& b) {
  double error = 0.0;
  double size = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    error += dot(a[i] - b[i], a[i] - b[i]);
    size += dot(b[i], b[i]);
  }
  return std::sqrt(error / size);
}

/// Adds `count` particles of 3e13 kg, 50 % up or down, uniform in a ball.
inline void add_ball(Cloud& cloud, std::size_t count, Vec3d centre, double radius, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  while (count > 0) {
    const Vec3d p{unit(random), unit(random), unit(random)};
    if (dot(p, p) > 1.0) continue;
    cloud.position.push_back(centre + radius * p);
    cloud.mass.push_back(3e13 * (1.0 + 0.5 * unit(random)));
    --count;
  }
}

/// A ball of a jittered cubic lattice: rock, in which particles keep their distance.
inline void add_rock(Cloud& cloud, std::size_t about, Vec3d centre, double radius, std::mt19937_64& random) {
  const double h = radius * std::cbrt(4.0 / 3.0 * kPi / static_cast<double>(about));
  std::uniform_real_distribution<double> jitter(-0.2, 0.2);
  const int reach = static_cast<int>(radius / h) + 1;
  for (int i = -reach; i <= reach; ++i) {
    for (int j = -reach; j <= reach; ++j) {
      for (int k = -reach; k <= reach; ++k) {
        const Vec3d p{h * (i + jitter(random)), h * (j + jitter(random)), h * (k + jitter(random))};
        if (dot(p, p) > radius * radius) continue;
        cloud.position.push_back(centre + p);
        cloud.mass.push_back(3e13);
      }
    }
  }
}

/// The same on a face-centred cubic lattice, as bodies of a scene are by default.
inline void add_fcc_rock(Cloud& cloud, std::size_t about, Vec3d centre, double radius, std::mt19937_64& random) {
  const double h = radius * std::cbrt(16.0 / 3.0 * kPi / static_cast<double>(about));
  std::uniform_real_distribution<double> jitter(-0.05, 0.05);
  const int reach = 2 * (static_cast<int>(radius / h) + 1);
  for (int i = -reach; i <= reach; ++i) {
    for (int j = -reach; j <= reach; ++j) {
      for (int k = -reach; k <= reach; ++k) {
        if ((i + j + k) % 2 != 0) continue;
        const Vec3d p{h * (0.5 * i + jitter(random)), h * (0.5 * j + jitter(random)), h * (0.5 * k + jitter(random))};
        if (dot(p, p) > radius * radius) continue;
        cloud.position.push_back(centre + p);
        cloud.mass.push_back(3e13);
      }
    }
  }
}

}  // namespace breccia::gravity

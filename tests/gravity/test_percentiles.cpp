// How errors are distributed in the states of gravity.md 3, on any number of ranks and however the state lies in space
// (gravity.md 6.3).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "deal_out.hpp"
#include "gravity/verify.hpp"

namespace breccia::gravity {
namespace {

constexpr double kRadius = 5e4;
constexpr std::size_t kBody = 6000;
const double kSpacing = kRadius * std::cbrt(4.0 / 3.0 * kPi / static_cast<double>(kBody));

void add_debris(Cloud& cloud, std::size_t count, double nearest, double farthest, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (std::size_t i = 0; i < count; ++i) {
    const double r = nearest * std::pow(farthest / nearest, unit(random));
    const double z = 2.0 * unit(random) - 1.0;
    const double phi = 2.0 * kPi * unit(random);
    const double s = std::sqrt(1.0 - z * z);
    cloud.position.push_back({r * s * std::cos(phi), r * s * std::sin(phi), r * z});
    cloud.mass.push_back(3e13);
  }
}

// a: two spheres; b: an elongated body and a quarter debris; c: fragments and 40 % debris; t: two spheres in contact;
// s: a single sphere.
Cloud state(char name) {
  Cloud cloud;
  std::mt19937_64 random(31);
  if (name == 'a' || name == 't') {
    const double half = name == 'a' ? 2.0 * kRadius : kRadius;
    add_rock(cloud, kBody, {-half, 0, 0}, kRadius, random);
    add_rock(cloud, kBody, {half, 0, 0}, kRadius, random);
  } else if (name == 'b') {
    // The part in a long ellipsoid of a lattice as dense as that of the others.
    Cloud whole;
    add_rock(whole, 8 * kBody, {}, 2.0 * kRadius, random);
    for (const Vec3d& x : whole.position) {
      if (0.25 * x.x * x.x + 2.0 * (x.y * x.y + x.z * x.z) > kRadius * kRadius) continue;
      cloud.position.push_back(x);
      cloud.mass.push_back(3e13);
    }
    add_debris(cloud, kBody / 3, 1.3e5, 2e7, random);
  } else if (name == 'c') {
    for (std::size_t k = 0; k < 12; ++k) {
      const std::size_t size = kBody / 3 / (k + 1);
      std::uniform_real_distribution<double> unit(-1.0, 1.0);
      const Vec3d at{1e6 * unit(random), 1e6 * unit(random), 1e6 * unit(random)};
      add_rock(cloud, size, k == 0 ? Vec3d{} : at, kSpacing * std::cbrt(0.75 / kPi * static_cast<double>(size)),
               random);
    }
    add_debris(cloud, 2 * cloud.position.size() / 3, 3e5, 2e7, random);
  } else {
    add_rock(cloud, kBody, {}, kRadius, random);
  }
  return cloud;
}

struct Errors {
  FieldErrors relative;
  double rms = 0.0;  // of those over max(|a|, a tenth of its mean): no particle at a centre of a body decides it
};

// Slabs of x, as the ranks of a run hold them.
Cloud share_of(const Cloud& cloud) {
  const mpi::Comm comm;
  Cloud mine;
  std::vector<double> x;
  for (const Vec3d& p : cloud.position) x.push_back(p.x);
  std::sort(x.begin(), x.end());
  for (std::size_t i = 0; i < cloud.position.size(); ++i) {
    const auto below = std::lower_bound(x.begin(), x.end(), cloud.position[i].x) - x.begin();
    if (below * comm.size() / static_cast<std::ptrdiff_t>(x.size()) != comm.rank()) continue;
    mine.position.push_back(cloud.position[i]);
    mine.mass.push_back(cloud.mass[i]);
  }
  return mine;
}

double norm(Vec3d a) { return std::sqrt(dot(a, a)); }

Errors errors_of(GravityMethod method, const Cloud& cloud) {
  const mpi::Comm comm;
  const Cloud mine = share_of(cloud);
  const ParticlesView view{mine.position, mine.mass};
  const Parameters parameters{.softening = 0.05 * kSpacing, .mesh = {.particle_spacing = kSpacing}, .error = 3.5e-4};
  std::vector<Vec3d> a(mine.position.size());
  make_solver(method, parameters, comm, 1)->evaluate(view, a, {});
  std::vector<std::int64_t> all(a.size());
  std::iota(all.begin(), all.end(), 0);
  const std::vector<Vec3d> exact = direct_acceleration(view, all, parameters.softening, comm, 1);

  double mean = 0.0, square = 0.0;
  for (const Vec3d& e : exact) mean += norm(e);
  const auto count = static_cast<double>(cloud.position.size());
  mean = comm.sum(mean) / count;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double error = norm(a[i] - exact[i]) / std::max(norm(exact[i]), 0.1 * mean);
    square += error * error;
  }
  return {field_errors(a, exact, comm), std::sqrt(comm.sum(square) / count)};
}

// The default levels of gravity.md 7; its largest errors are 1.2e-3 to 1e-2 for the tree.
TEST(Percentiles, OfAllStatesByTree) {
  for (const char name : {'a', 'b', 'c', 't', 's'}) {
    const Errors e = errors_of(GravityMethod::kTree, state(name));
    SCOPED_TRACE(std::string("state ") + name);
    EXPECT_LT(e.rms, 3.5e-4);
    EXPECT_LT(e.relative.median, 3.0e-4);
    EXPECT_LT(e.relative.p99, 1.3e-3);
    EXPECT_LT(e.relative.max, 5e-3);
  }
}

// Those of gravity.md 7 for bodies of 47,324 particles: smaller ones get a wider split.
TEST(Percentiles, OfAllStatesByMesh) {
  for (const char name : {'a', 'b', 'c', 't', 's'}) {
    const Errors e = errors_of(GravityMethod::kTreePm, state(name));
    SCOPED_TRACE(std::string("state ") + name);
    EXPECT_LT(e.rms, 4.5e-4);
    EXPECT_LT(e.relative.median, 4.0e-4);
    EXPECT_LT(e.relative.p99, 1.6e-3);
    // gravity.md 3 finds 2e-2 to 5e-2, at centres of bodies.
    EXPECT_LT(e.relative.max, 1e-2);
  }
}

// Rotation by Rodrigues' formula about (1, 2, 3), then a shift by no multiple of a cell.
Cloud moved(Cloud cloud, double angle, int shifts) {
  const Vec3d axis = (1.0 / std::sqrt(14.0)) * Vec3d{1, 2, 3};
  for (Vec3d& x : cloud.position) {
    x = std::cos(angle) * x + std::sin(angle) * cross(axis, x) + (1.0 - std::cos(angle)) * dot(axis, x) * axis +
        shifts * Vec3d{123456.7, -7654.3, 33333.3};
  }
  return cloud;
}

// The tree's errors change by a quarter with its random root, that is, with every evaluation: means of four are
// compared. Bodies on the lattice of a run; a plain cubic one that lies along the mesh beats with it, which gives 1.25
// times the error in any place (1.45 at 47,000 particles a body).
TEST(Percentiles, DoNotDependOnPlaceAndDirection) {
  if (mpi::Comm().size() > 1)
    GTEST_SKIP() << "more ranks give the same field, as gravity_tree and gravity_tree_pm show";
  Cloud aligned;
  std::mt19937_64 random(31);
  for (const double side : {-1.0, 1.0}) add_fcc_rock(aligned, kBody, {2.0 * side * kRadius, 0, 0}, kRadius, random);
  const auto mean_error = [&](GravityMethod method, double angle, int first_shift) {
    const int times = method == GravityMethod::kTree ? 4 : 1;
    double sum = 0.0;
    for (int k = 0; k < times; ++k) sum += errors_of(method, moved(aligned, angle, first_shift + k)).rms;
    return sum / times;
  };
  for (const GravityMethod method : {GravityMethod::kTree, GravityMethod::kTreePm}) {
    SCOPED_TRACE("method " + std::to_string(static_cast<int>(method)));
    const double here = mean_error(method, 0.0, 0);
    EXPECT_NEAR(mean_error(method, 0.0, 4) / here, 1.0, 0.2);
    EXPECT_NEAR(mean_error(method, 0.7, 8) / here, 1.0, 0.2);
    EXPECT_NEAR(mean_error(method, 1.4, 12) / here, 1.0, 0.2);
  }
}

}  // namespace
}  // namespace breccia::gravity

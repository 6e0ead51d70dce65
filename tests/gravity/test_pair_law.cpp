// The pull of one mass at distances over five decades (gravity.md 6.1): inside a box by mesh and near field, across its
// border and outside by the whole law.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "gravity/mesh/box_field.hpp"
#include "gravity/tree/unsplit.hpp"
#include "plain_sum.hpp"

namespace breccia::gravity {
namespace {

constexpr double kMass = 1e15;
constexpr double kSoftening = 125.0;

// Distances spread evenly in their logarithms.
struct Distances {
  double nearest, farthest;
};
Vec3d around(Vec3d centre, const Distances& distances, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const double r = distances.nearest * std::pow(distances.farthest / distances.nearest, unit(random));
  const double z = 2.0 * unit(random) - 1.0;
  const double phi = 2.0 * kPi * unit(random);
  const double s = std::sqrt(1.0 - z * z);
  return centre + r * Vec3d{s * std::cos(phi), s * std::sin(phi), z};
}

struct LawErrors {
  double rms = 0.0, max = 0.0, potential = 0.0;
};

// Of massless particles against Plummer's law of the first one.
class ErrorsOfLaw {
 public:
  void add(const std::vector<Vec3d>& position, const std::vector<Vec3d>& a, const std::vector<double>& phi) {
    for (std::size_t i = 1; i < position.size(); ++i) {
      const Vec3d d = position[0] - position[i];
      const double q = 1.0 / std::sqrt(dot(d, d) + kSoftening * kSoftening);
      const Vec3d should = (kGravitationalConstant * kMass * q * q * q) * d;
      const double error = std::sqrt(dot(a[i] - should, a[i] - should) / dot(should, should));
      square_ += error * error;
      ++count_;
      errors_.max = std::max(errors_.max, error);
      errors_.potential = std::max(errors_.potential, std::abs(phi[i] / (-kGravitationalConstant * kMass * q) - 1.0));
    }
  }
  [[nodiscard]] LawErrors result() const { return {std::sqrt(square_ / count_), errors_.max, errors_.potential}; }

 private:
  LawErrors errors_;
  double square_ = 0.0, count_ = 0.0;
};

struct Particles {
  std::vector<Vec3d> position;
  std::vector<double> mass;
  std::vector<Vec3d> acceleration;
  std::vector<double> potential, work;

  explicit Particles(Vec3d source) : position{source}, mass{kMass} {}
  void add(Vec3d x) {
    position.push_back(x);
    mass.push_back(0.0);
  }
  FieldView field() {
    acceleration.assign(position.size(), {});
    potential.assign(position.size(), 0.0);
    work.assign(position.size(), 0.0);
    return {acceleration, potential, work};
  }
};

// 10,000 points from 10 m on around masses at random places of the mesh, whose cells are 2.5 km.
LawErrors inside_a_box(double split, double cutoff) {
  constexpr double kCell = 2500.0;
  const Box box{{0, 0, 0}, {240e3, 80e3, 80e3}};
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  BoxField<double> mesh(mpi::Comm(MPI_COMM_SELF), 1);
  ErrorsOfLaw errors;
  for (int trial = 0; trial < 10; ++trial) {
    Particles p({240e3 * unit(random), 80e3 * unit(random), 80e3 * unit(random)});
    while (p.position.size() <= 1000) {
      const Vec3d x = around(p.position[0], {10.0, 250e3}, random);
      if (box.contains(x)) p.add(x);
    }
    Stats stats;
    const std::vector<std::uint8_t> set(p.position.size(), 1);
    mesh.add_to({p.position, p.mass}, set, 1, {box, kCell, kCell, {split, split * cutoff, kSoftening / kCell}, kMass},
                p.field(), stats);
    errors.add(p.position, p.acceleration, p.potential);
    // The mass itself feels nothing and has no potential of its own, but for the mesh's error at its place.
    const double unit_field = kGravitationalConstant * kMass / (kCell * kCell);
    EXPECT_LT(std::sqrt(dot(p.acceleration[0], p.acceleration[0])), 1e-12 * unit_field);
    EXPECT_LT(std::abs(p.potential[0]), 0.01 * unit_field * kCell);
  }
  return errors.result();
}

// What TSC leaves of a single pair is aliasing, and falls with the third power of cell over split scale; longer cutoffs
// change nothing. gravity.md 6.1 asks for 3e-4 and 2e-3: that takes a split of 1.6 cells. In the sums over bodies that
// gravity.error speaks of, the errors of a thousand neighbours average: the default, a split of 0.84, leaves 2.8e-4
// there, though single pairs are off by 4e-3.
TEST(PairLaw, InsideABox) {
  struct Case {
    double split, cutoff, rms, max;
  };
  for (const Case c : {Case{0.84, 4.6, 5e-3, 3e-2}, Case{1.25, 5.5, 8e-4, 6e-3}, Case{1.6, 6.0, 3e-4, 2e-3}}) {
    const LawErrors errors = inside_a_box(c.split, c.cutoff);
    EXPECT_LT(errors.rms, c.rms) << "split " << c.split;
    EXPECT_LT(errors.max, c.max) << "split " << c.split;
    EXPECT_LT(errors.potential, c.max) << "split " << c.split;
  }
}

// A mass in a box acts outside of it by the whole law, and one outside on what is in the box; particles outside on each
// other too. The border itself is nowhere to be seen.
TEST(PairLaw, AcrossTheBorderAndOutside) {
  const mpi::Comm self(MPI_COMM_SELF);
  for (const auto& [of_mass, of_others] : {std::pair{1, 0}, std::pair{0, 1}, std::pair{0, 0}}) {
    UnsplitField unsplit({.softening = kSoftening, .error = 3.5e-4}, self, 1);
    std::mt19937_64 random(2);
    ErrorsOfLaw errors;
    for (int trial = 0; trial < 5; ++trial) {
      Particles p({1e4 * trial, -2e4, 5e3});
      while (p.position.size() <= 2000) p.add(around(p.position[0], {10.0, 1e6}, random));
      std::vector<std::uint8_t> set(p.position.size(), static_cast<std::uint8_t>(of_others));
      set[0] = static_cast<std::uint8_t>(of_mass);
      Stats stats;
      unsplit.add_to({p.position, p.mass}, set, 2, kMass, p.field(), stats);
      errors.add(p.position, p.acceleration, p.potential);
    }
    EXPECT_LT(errors.result().max, 1e-5) << "mass in set " << of_mass;
    EXPECT_LT(errors.result().potential, 1e-5) << "mass in set " << of_mass;
  }
}

}  // namespace
}  // namespace breccia::gravity

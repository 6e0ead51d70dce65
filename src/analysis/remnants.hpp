// What a collision leaves: groups of particles with mass, motion, shape and class (physics.md 7).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "analysis/group_sums.hpp"
#include "analysis/shape.hpp"
#include "breccia/particle_arrays.hpp"
#include "mpi/comm.hpp"

namespace breccia::analysis {

/// A group of at least two particles.
struct Remnant {
  std::uint64_t label = 0;      ///< smallest particle id in it
  std::uint64_t particles = 0;  ///< how many
  double mass = 0.0;            ///< [kg]
  double mass_over_target = 0.0;
  Vec3d position{};                  ///< centre of mass [m]
  Vec3d velocity{};                  ///< of the centre of mass [m/s]
  Vec3d angular_momentum{};          ///< about the centre of mass [kg m2/s]
  Vec3d spin{};                      ///< angular velocity of a rigid body of this L and inertia [rad/s]
  double spin_period = 0.0;          ///< [s]; infinite without spin
  double a = 0.0, b = 0.0, c = 0.0;  ///< full lengths of the ellipsoid of equal inertia, a >= b >= c [m]
  double b_over_a = 0.0, c_over_a = 0.0;
  std::array<Vec3d, 3> axes{};             ///< unit vectors along a, b, c
  std::array<double, 3> trimmed_extent{};  ///< along a, b, c, 98 % of the particles [m]; largest remnant only, else 0
  double bound_mass = 0.0;                 ///< [kg]; largest remnant only, else NaN
  ShapeClass shape = ShapeClass::kSuperCatastrophic;      ///< both bodies in one from 1.99 target masses on
  ShapeClass shape_195 = ShapeClass::kSuperCatastrophic;  ///< from 1.95
  ShapeClass shape_190 = ShapeClass::kSuperCatastrophic;  ///< from 1.90
};

struct Fragments {
  std::vector<Remnant> remnants;  ///< largest mass first, equal masses by label
  Singles singles;                ///< particles without a friend
};

/// Groups with linking length `link` [m]; `target_mass` [kg] is what masses are divided by. `potential` [J/kg], one
/// entry per particle of this rank or empty on all ranks, refines bound_mass. Collective, the same on all ranks.
/// Throws UsageError for a link or target mass that is not positive, NumericsError for positions that are not finite.
Fragments find_fragments(const ParticleArrays& particles, double link, double target_mass, const mpi::Comm& comm,
                         std::span<const double> potential = {});

/// The remnants alone.
std::vector<Remnant> find_remnants(const ParticleArrays& particles, double link, double target_mass,
                                   const mpi::Comm& comm);

}  // namespace breccia::analysis

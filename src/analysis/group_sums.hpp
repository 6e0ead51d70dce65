// Sums over the groups of particles that friends of friends found, wherever their members are.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "breccia/linalg.hpp"
#include "breccia/particle_arrays.hpp"
#include "mpi/comm.hpp"

namespace breccia::analysis {

/// One group of at least two particles.
struct GroupSums {
  std::uint64_t label = 0;
  std::uint64_t particles = 0;
  double mass = 0.0;             ///< [kg]
  Vec3d position{};              ///< centre of mass [m]
  Vec3d velocity{};              ///< of the centre of mass [m/s]
  Vec3d angular_momentum{};      ///< about the centre of mass [kg m2/s]
  Sym3<double> second_moment{};  ///< sum m x x^T about the centre of mass [kg m2]
};

/// Particles without a friend.
struct Singles {
  std::uint64_t particles = 0;
  double mass = 0.0;  ///< [kg]
};

struct Groups {
  std::vector<GroupSums> groups;  ///< largest mass first, equal masses by label; the same on all ranks
  Singles singles;                ///< of all ranks
};

/// Collective. `label` as find_groups gives them.
Groups sum_groups(const ParticleArrays& particles, std::span<const std::uint64_t> label, const mpi::Comm& comm);

}  // namespace breccia::analysis

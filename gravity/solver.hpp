// What every gravity solver offers: accelerations and potentials of point masses spread over the ranks.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "breccia/linalg.hpp"
#include "breccia/scene.hpp"
#include "gravity/mesh/phases.hpp"
#include "mpi/comm.hpp"

namespace breccia::gravity {

/// The particles of this rank at the time the field is wanted for (Window::prediction_time).
struct ParticlesView {
  std::span<const Vec3d> position;  ///< [m]
  std::span<const double> mass;     ///< [kg]
};

/// Of the particle mesh (gravity.md 5.3).
struct MeshParameters {
  double particle_spacing = 0.0;  ///< mean distance of the particles where they are dense [m]; 0: found from them
  double cell = 0.0;              ///< [m]; 0: kCellsPerSpacing particle spacings
  double split = 0.0;             ///< scale rs of the Gaussian split [cells]; 0: follows from Parameters::error
  double cutoff = 0.0;            ///< of the short-range part [rs]; 0: follows from the split
};

/// Not near 1: a lattice of particles beats with a mesh of its own spacing. Larger cells also balance the cost of
/// pairs and transforms.
inline constexpr double kCellsPerSpacing = 1.3;

struct Parameters {
  double softening = 0.0;  ///< Plummer length: a pair at distance r counts with 1/sqrt(r^2 + softening^2) [m]
  Precision precision = Precision::kMixed;
  MeshParameters mesh{};
  double error = 3.5e-4;  ///< rms of |da|/|a| that is good enough
  double opening = 0.0;   ///< tree: error allowed to one cell, as a fraction of the acceleration; 0: follows from error
};

/// What one evaluation cost and how well it conserved momentum. Seconds, pairs and bytes are this rank's.
struct Stats {
  double seconds = 0.0;
  double pairs = 0.0;              ///< particle with particle
  double cell_interactions = 0.0;  ///< particle with cell
  double expansions = 0.0;         ///< cell with cell
  double bytes_sent = 0.0;
  double cells_imported = 0.0;  ///< tree cells and particles that other ranks sent for the walk (not the near field)
  double particles_imported = 0.0;
  double cells_missing = 0.0;  ///< times that a cell was taken whole because another rank had not sent its parts; 0
  int boxes = 0;               ///< that have a mesh
  Phases phases{};
  GravityMethod method = GravityMethod::kDirect;  ///< that was used
  std::string reason{};                           ///< for it; empty unless kAuto chose
  Vec3d net_force_removed{};    ///< sum(m a) that was subtracted from all accelerations [N]; zero for a pairwise sum
  double momentum_error = 0.0;  ///< |sum(m a)| / sum(m |a|) over all ranks
};

class Solver {
 public:
  Solver() = default;
  Solver(const Solver&) = delete;
  Solver& operator=(const Solver&) = delete;
  virtual ~Solver() = default;

  /// Acceleration [m/s2] and, unless its span is empty, potential without the self term [J/kg] of this rank's
  /// particles, in their order. Collective: the ranks agree on whether the potential is wanted; a rank may be empty.
  virtual void evaluate(ParticlesView particles, std::span<Vec3d> acceleration, std::span<double> potential) = 0;

  /// Of the last evaluation.
  [[nodiscard]] virtual const Stats& last() const = 0;

  /// What each of this rank's particles cost in the last evaluation, in pairs of particles: counted, not timed, so that
  /// a balance of loads repeats. The mesh costs all of its particles the same and is not in it.
  [[nodiscard]] virtual std::span<const double> work() const = 0;
};

/// The solver for `method`; kAuto chooses anew at each evaluation. Throws UsageError for kOff, for methods this program
/// lacks, for a softening that is negative or not finite and for an error or opening that is not positive.
std::unique_ptr<Solver> make_solver(GravityMethod method, const Parameters& parameters, const mpi::Comm& comm,
                                    int threads);

}  // namespace breccia::gravity

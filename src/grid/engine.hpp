// The MPM engine: particles, sparse grid, slabs and halo behind the operations the time step calls (sim/time_step.cpp).
// Knows nothing of gravity solvers, output or time control.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "breccia/engine_state.hpp"
#include "breccia/particle_arrays.hpp"
#include "breccia/scene.hpp"
#include "breccia/timeline.hpp"
#include "material/effects_policy.hpp"
#include "material/flaws.hpp"
#include "mpi/comm.hpp"
#include "mpi/slabs.hpp"

namespace breccia::grid {

/// What an engine is made for.
struct EngineSetup {
  double cell = 0.0;  ///< dx [m]
  std::vector<MaterialParameters> materials;
  std::vector<BoundaryPlane> boundaries;
  material::RuntimeEffects effects;
  bool self_gravity = false;  ///< particles hold an acceleration over a window
  Vec3d uniform_gravity{};    ///< [m/s2]
  NumericsParameters numerics;
  int threads = 1;
  std::optional<int> slab_axis;  ///< the grid is cut along it; none: along the longest extent of the matter
  DeviceMessages device_messages = DeviceMessages::kMpi;
  bool divide_blocks = true;  ///< cuts may run through blocks, where the engine can do with that
};

/// What tells how a particle is.
struct ParticleValues {
  Vec3d velocity{};           ///< [m/s]
  double volume_ratio = 1.0;  ///< J
  double energy = 0.0;        ///< specific internal [J/kg]
  double pressure = 0.0;      ///< J P [Pa]
  double damage = 0.0;        ///< D
};

/// One particle as it stands.
struct ParticleSample {
  std::uint64_t id = 0;
  Vec3d position{};  ///< [m]
  ParticleValues values;
};

/// A particle that a pass could not take on. It was left as it was before and gives nothing to the grid any more: the
/// run has to end.
struct ParticleFault {
  ParticleSample before;
  ParticleValues after;
  bool finite = false;  ///< false: not finite; true: it moved a cell or more in one step
};

/// What the passes over this rank's particles found.
struct PassReport {
  double plastic_work = 0.0;  ///< of all passes since the last sorting [J]
  double viscous_work = 0.0;  ///< of all passes since the last sorting [J]
  double largest_move = 0.0;  ///< of the last pass [cells]
  std::uint64_t clamped = 0;  ///< volume changes cut since the last sorting: det(I + dt L) <= 0.1 (hard case 3)
  std::optional<ParticleFault> fault;  ///< the first since the last sorting
  std::uint64_t fault_step = 0;        ///< gathers between the last sorting and the one with the fault
};

/// Fastest signals over all ranks, for the time step.
struct SignalSpeeds {
  double sound = 0.0;             ///< longitudinal [m/s]
  double particle = 0.0;          ///< largest |v| along an axis [m/s]
  double compression_rate = 0.0;  ///< largest -tr C [1/s]
};

/// Numbers of this rank, for diagnostics and the profile.
struct EngineStats {
  std::uint64_t particles = 0;
  std::uint64_t lone_particles = 0;  ///< that use no grid
  std::uint64_t tiles = 0;
  std::uint64_t occupied_blocks = 0;  ///< that hold particles which use the grid
  std::uint64_t packs = 0;            ///< SIMD packs in tiles; 0 on a device
  std::uint64_t blocks = 0;
  std::uint64_t halo_bytes_per_step = 0;
  std::uint64_t key_exchanges = 0;  ///< sortings after which ranks had to agree on shared blocks anew
  double halo_in_flight = 0.0;      ///< from sending to having received, all messages of nodes so far [s]
  double halo_waited = 0.0;         ///< of that, with nothing else to do [s]
  std::uint64_t particle_bytes = 0;
  std::uint64_t grid_bytes = 0;
  std::uint64_t sort_bytes = 0;  ///< more than these, held at once around the last sorting; 0 on a device
};

class Engine {
 public:
  virtual ~Engine() = default;

  /// Takes the particles of this rank, with the flaws of each (empty lists if damage is off), and sorts them.
  /// `spin` gives the initial velocity gradient of each body. Collective.
  virtual void insert(const ParticleArrays& particles, const material::FlawLists& flaws,
                      std::span<const Vec3d> spin_of_body) = 0;

  /// The whole state, only between sort() and the scatter() that follows.
  [[nodiscard]] virtual EngineState save() const = 0;
  /// The flaws of the particles in the order of save(); empty lists if damage does not grow.
  [[nodiscard]] virtual material::FlawLists flaws() const = 0;
  /// Takes a saved state in place of insert(), with the flaws that its particles were inserted with (empty lists if
  /// damage does not grow): a scatter() that follows gives the same bits as after save(), if the state comes from as
  /// many ranks. Collective. Throws IoError if a field is missing.
  virtual void restore(const EngineState& state, const material::FlawLists& flaws) = 0;

  /// Sorts particles into tiles, sends those that left the slab to their owner, rebuilds blocks and halo. Only between
  /// gather() and scatter(). Collective. Returns the work of the uniform field on particles of this rank over the
  /// periods by which they are put back: m g L for each that has fallen through one of length L [J].
  virtual double sort() = 0;
  /// That of particles which lie beyond their period now: observe() shows them inside, sort() has not put them
  /// back [J].
  [[nodiscard]] virtual double work_beyond_period() const = 0;

  /// How the grid is cut. insert() cuts for equal numbers of particles, sort() leaves cuts as they are.
  [[nodiscard]] virtual const mpi::Slabs& slabs() const = 0;
  /// What the particles of this rank cost in a step on this engine, by the planes that slabs().axis() crosses: those
  /// before which this engine can cut [ps]. Counted, not timed (grid/work_weights.hpp), so that a run repeats. `more`:
  /// what each of them costs elsewhere [ps of a step], in the order of predict(); empty for nothing. Only between
  /// sort() and scatter().
  [[nodiscard]] virtual mpi::PlaneWork work(std::span<const double> more) const = 0;
  /// Cuts the grid anew; particles go to their owners with all that they hold, and are sorted. Only between sort() and
  /// scatter(). Collective.
  virtual void cut(const mpi::Slabs& slabs) = 0;

  /// Stress and P2G: particles at t_n give the sums of the grid. `half_step`: half the dt of the velocity gradient.
  virtual void scatter(double half_step) = 0;
  /// Halo sums to owners, v_i^{n+1/2} = v_i^{n-1/2} + kick f_i/m_i, boundaries, velocities back. Collective.
  virtual void update_grid(double kick) = 0;
  /// G2P and particle update over `step`.
  virtual void gather(double step) = 0;
  /// gather(step) and the next scatter(step / 2) in one sweep. update_grid(step), with the same step, must follow: it
  /// finds much of its work done while the nodes were in the cache.
  virtual void gather_scatter(double step) = 0;

  /// Positions x + time * v [m] and masses [kg] of this rank's particles, in the order held_gravity expects. This and
  /// the next three: only between gather() and scatter().
  virtual void predict(double time, std::vector<Vec3d>& position, std::vector<double>& mass) const = 0;
  /// Sets the acceleration held until the next call [m/s2].
  virtual void hold_gravity(std::span<const Vec3d> acceleration) = 0;
  /// v -= time * g with the held and the uniform gravity: makes v^{-1/2} from v(0).
  virtual void kick_velocities(double time) = 0;

  /// Collective.
  [[nodiscard]] virtual SignalSpeeds signal_speeds() const = 0;

  /// Everything at t_n, after update_grid(): velocities are the mean of v^{n-1/2} and v^{n+1/2}.
  [[nodiscard]] virtual ParticleOutput observe() const = 0;
  /// The same at any moment and without the grid: velocities are v^{n-1/2}, there is no grid density.
  [[nodiscard]] virtual ParticleOutput inspect() const = 0;
  /// True if a particle of this rank has moved more than a cell since the last sorting: sort() cannot go on from there.
  [[nodiscard]] virtual bool strayed() const = 0;
  /// The particle of this rank that has left the margin of its tile, or is faster than all others; none on a rank
  /// without particles.
  [[nodiscard]] virtual std::optional<ParticleSample> fastest() const = 0;
  /// J of each particle in the order of observe(), and the elastic shear energy of this rank [J].
  [[nodiscard]] virtual std::vector<double> volume_ratios() const = 0;
  [[nodiscard]] virtual double elastic_energy() const = 0;

  /// True on all ranks once every particle has D = 1; then damage is switched off and its fields are freed. Collective,
  /// only between gather() and scatter().
  virtual bool finish_damage() = 0;

  /// May wait for a device: not meant for every step.
  [[nodiscard]] virtual PassReport passes() const = 0;
  [[nodiscard]] virtual EngineStats stats() const = 0;
  /// The engine's last call, where something else works on its device: what steps so far still wait for from other
  /// ranks is given up, or a device that waits could give nothing back.
  virtual void abandon() {}
  /// Has tiles and messages noted in `timeline` from now on; null: no more. An engine may have nothing to note.
  virtual void record(Timeline* timeline) { static_cast<void>(timeline); }
};

/// The engine on host cores.
std::unique_ptr<Engine> make_host_engine(const EngineSetup& setup, const mpi::Comm& comm);

/// Makes engines of one kind; which one the user wants is decided in grid/device.hpp.
using EngineMaker = std::unique_ptr<Engine> (*)(const EngineSetup& setup, const mpi::Comm& comm);

}  // namespace breccia::grid

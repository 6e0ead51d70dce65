// A scene as resolved: every number in SI, every default filled in. Made by scene/, read by all others.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "breccia/linalg.hpp"
#include "breccia/material_parameters.hpp"

namespace breccia {

enum class Shape { kSphere, kEllipsoid, kBox, kCylinder, kParticles };
enum class Lattice { kFcc, kHcp, kCubic, kRandom };

/// A body as resolved, [[impact]] already applied.
struct BodyParameters {
  std::string name;
  Shape shape = Shape::kSphere;
  Vec3d semi_axes{};           ///< sphere: r,r,r; ellipsoid: semi-axes; box: half sizes; cylinder: r,r,h/2 (axis z) [m]
  std::string file;            ///< shape "particles": HDF5 file with /PartType0/{Coordinates,Velocities,Masses}
  std::uint32_t material = 0;  ///< index into Scene::materials
  std::uint64_t particles = 0;  ///< exact count
  double spacing = 0.0;         ///< lattice nearest-neighbour distance [m]; 0: follows from the count
  Lattice lattice = Lattice::kFcc;
  Vec3d position{};            ///< centre [m]
  Vec3d velocity{};            ///< [m/s]
  Vec3d spin{};                ///< angular velocity about the centre [rad/s]
  double damage = 0.0;         ///< initial D
  double mass = 0.0;           ///< [kg]
  std::uint64_t first_id = 0;  ///< global id of its first particle
};

/// Two bodies meet with this speed and angle at contact distance (physics.md 6).
struct ImpactParameters {
  double velocity = 0.0;    ///< relative speed at contact [m/s]
  double angle = 0.0;       ///< from the line of centres, 0 = head-on [rad]
  double separation = 0.0;  ///< centre to centre at the start [m]
};

enum class BoundaryKind {
  kSlip,      ///< no velocity along the normal, free along the plane (bilateral)
  kStick,     ///< no velocity
  kFriction,  ///< no velocity into the plane, Coulomb friction along it, may separate
  kPeriodic,  ///< with a second periodic plane of opposite normal
};

/// A plane; the matter is on the side the normal points to.
struct BoundaryPlane {
  Vec3d point{};
  Vec3d normal{};  ///< unit length
  BoundaryKind kind = BoundaryKind::kSlip;
  double friction = 0.0;  ///< Coulomb coefficient
};

enum class GravityMethod { kOff, kDirect, kTree, kTreePm, kAuto };
enum class Switch { kOff, kOn, kAuto };

/// Effects as the scene asks for them; what they become is decided by resolve_effects (sim/effects.hpp).
struct EffectSwitches {
  GravityMethod gravity = GravityMethod::kAuto;
  Switch strength = Switch::kAuto;
  Switch damage = Switch::kAuto;
  Switch viscosity = Switch::kAuto;
  Switch energy = Switch::kAuto;
  Switch shear = Switch::kAuto;
};

struct GravityParameters {
  int interval = 32;       ///< steps between evaluations
  double softening = 0.0;  ///< Plummer length [m]; default 0.05 cell
  double error = 3.5e-4;   ///< rms relative error of the acceleration that is good enough
  double opening = 0.0;    ///< tree: error allowed to one cell; 0: follows from `error`
  double mesh = 0.0;       ///< treepm: mesh cell [m]; 0: follows from the particles' spacing
  double split = 0.0;      ///< treepm: scale of the split [mesh cells]; 0: follows from `error`
  Vec3d uniform{};         ///< constant field [m/s2]
};

enum class Precision { kMixed, kDouble };
enum class Transfer { kAsflip, kApic, kFlip };

struct NumericsParameters {
  Precision precision = Precision::kMixed;
  Transfer transfer = Transfer::kAsflip;
  double asflip_alpha = 0.995;
  double asflip_beta = 1.0;
  int sort_interval = 32;  ///< most steps between two sortings
  /// Largest gain of energy over max(kinetic + |potential|). Resolved bodies only lose energy but for rounding and the
  /// order of the step, 1e-6 in the flagship collision; ASFLIP can make a quarter of a body of few cells that flies
  /// apart (tests/stability, SpinBeyondBreakUp). Twice as much is neither; an unstable run gains as much as it has
  /// within a few windows.
  double energy_gain = 0.5;
  bool lone_without_grid = true;  ///< closed form for particles that share no node with another one
  bool overlap = true;            ///< messages between ranks travel while tiles inside a slab are computed
  bool reproducible = false;      ///< the same bits on any number of ranks
  LiteralSwitches literal;
};

enum class BalanceMode {
  kOff,     ///< slabs stay as they were cut at the start
  kAlways,  ///< cut anew at every gravity window
  kAuto     ///< cut anew where the work has become uneven
};

/// What carries sums of the grid between CUDA devices of several ranks.
enum class DeviceMessages {
  kMpi,   ///< MPI, which makes the host wait once a step
  kNccl,  ///< NCCL, from device to device
  kAuto   ///< NCCL where it can be used
};

/// How the work is shared by ranks.
struct ParallelParameters {
  BalanceMode balance = BalanceMode::kAuto;
  double imbalance = 1.05;  ///< largest over mean work of the ranks that kAuto lets be
  std::optional<int> axis;  ///< 0, 1, 2: slabs across x, y, z; none: across the longest extent of the matter
  DeviceMessages device_messages = DeviceMessages::kMpi;
};

struct TimeParameters {
  double end = 0.0;            ///< [s]
  std::optional<double> step;  ///< fixed step [s]; none: adaptive
  double cfl = 0.4;            ///< fraction of the stable step in adaptive mode
};

struct OutputParameters {
  double snapshot_interval = 0.0;                 ///< [s]; 0: only start and end
  double diagnostics_interval = 0.0;              ///< [s]; 0: end/200
  std::vector<std::string> fields;                ///< snapshot fields; empty: all there are
  std::vector<double> analysis_times;             ///< times of an in-situ analysis besides the end [s]
  std::optional<double> checkpoint_wall = 600.0;  ///< wall time between checkpoints [s]; none: not by wall time
  double checkpoint_time = 0.0;                   ///< simulated time between checkpoints [s]; 0: not by simulated time
  std::uint64_t keep = 2;                         ///< newest checkpoints that stay
  double link_cells = 3.0;                        ///< friends-of-friends length [cells]
};

/// Everything a run needs to know.
struct Scene {
  std::string name;
  std::string file;  ///< path it was read from
  std::uint64_t seed = 1;
  double cell = 0.0;  ///< grid spacing dx [m]
  std::vector<MaterialParameters> materials;
  std::vector<BodyParameters> bodies;
  std::optional<ImpactParameters> impact;
  std::vector<BoundaryPlane> boundaries;
  EffectSwitches effects;
  GravityParameters gravity;
  NumericsParameters numerics;
  ParallelParameters parallel;
  TimeParameters time;
  OutputParameters output;
};

/// One key as the user gave it or as its default stands, for `check`, summary.json and the used/unused report.
struct ResolvedKey {
  std::string key;     ///< "grid.cell", "body[0].radius"
  std::string value;   ///< as printed, with unit
  bool given = false;  ///< by the scene or --set; otherwise the default
};

}  // namespace breccia

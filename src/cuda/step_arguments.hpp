// What the kernels of a step read and write, as plain pointers to device memory.
#pragma once

#include "breccia/linalg.hpp"
#include "breccia/scene.hpp"
#include "cuda/particle_view.hpp"
#include "grid/layout.hpp"
#include "material/constitutive.hpp"
#include "material/effects_policy.hpp"

namespace breccia::cuda {

inline constexpr int kTileNodes = grid::kTileWidth * grid::kTileWidth * grid::kTileWidth;

/// Channels of a node: sums while particles scatter, velocities after the grid update.
inline constexpr int kSums = 7;
inline constexpr int kVelocities = 6;  // v_new and v_old, what a pass reads
enum SumChannel { kMomentum = 0, kForce = 3, kMass = 6 };
enum VelocityChannel { kNewVelocity = 0, kOldVelocity = 3 };  // the mass stays where it is

/// The nodes that a tile touched in its last scatter, 4 bits each: first and last of x, y, z. Empty: last before first.
using PackedBox = std::uint32_t;
inline constexpr PackedBox kEmptyBox = 0x010101;

BRECCIA_HD PackedBox packed_axis(int first, int last, int axis) {
  return static_cast<PackedBox>(first | last << 4) << (8 * axis);
}
BRECCIA_HD bool box_holds(PackedBox box, int node, int axis) {
  const int first = static_cast<int>(box >> (8 * axis) & 15U);
  const int last = static_cast<int>(box >> (8 * axis + 4) & 15U);
  return first <= node && node <= last;
}

/// How far a particle counts as moved whose state is not finite any more [cells].
inline constexpr double kNotFinite = 1e30;

/// What a tile, or a thread block of lone particles, found: works since the last sorting, move of the last pass.
struct PassSums {
  double plastic_work;  ///< [J]
  double viscous_work;  ///< [J]
  double largest_move;  ///< [cells]
};

/// The background grid. Nodes are stored by cubes of 2x2x2, a cube being one sector of memory (node_order.hpp).
template <class Real>
struct GridView {
  unsigned tiles = 0;
  unsigned blocks = 0;                         ///< tiles first: block t is that of tile t
  const unsigned* first = nullptr;             ///< [tiles + 1] first slot of a tile
  const unsigned* neighbours = nullptr;        ///< [blocks][27] block indices, x slowest; kNoBlock where none is
  const grid::BlockKey* block_keys = nullptr;  ///< [blocks]
  PackedBox* boxes = nullptr;                  ///< [tiles]
  Real* partial_sums = nullptr;                ///< [tiles][kSums][512] what each tile scatters
  Real* velocities = nullptr;                  ///< [blocks][kSums][64]
};

/// Blocks that other ranks' particles reach too: what those ranks hold of them (halo.hpp). Null pointers on one rank.
template <class Real>
struct SharedView {
  const unsigned* list_of_block = nullptr;  ///< [blocks] kNoBlock where no other rank reaches
  const unsigned* first = nullptr;          ///< [lists + 1] into `places`; contributions in the order of their ranks
  const unsigned* lower = nullptr;          ///< [lists] how many of them come from lower ranks than this one
  const unsigned* places = nullptr;         ///< of a block's sums in `received`
  const Real* received = nullptr;           ///< [place][kSums][64]
};

/// The tiles of a launch that does not take all.
struct TileList {
  static constexpr unsigned kAll = 0xffffffffU;

  const unsigned* tiles = nullptr;  ///< null: tile t by thread block t
  unsigned count = kAll;
};

/// Transfer after physics.md 5: d = alpha (v_p - v_old); v_p = v_new + d; x += dt (v_new + beta d).
template <class Real>
struct Transfer {
  Real alpha, beta;
  bool affine;  ///< C enters P2G (APIC, ASFLIP); off: FLIP
};

template <class Real>
struct PassArguments {
  ParticleView<Real> particles;
  GridView<Real> grid;
  TileList only;

  unsigned first_lone = 0;    ///< slot; lone particles follow those in tiles
  unsigned lone = 0;          ///< number of them
  Real* lone_pull = nullptr;  ///< [6][lone] what a kick takes from C (lone_pass.cu) [1/s2]

  PassSums* sums = nullptr;     ///< [tiles + blocks of the lone pass]
  unsigned* strayed = nullptr;  ///< particles found outside their tile
  unsigned* clamped = nullptr;  ///< volume changes that were cut
  const float* flaw_thresholds = nullptr;
  const material::Constants<Real>* materials = nullptr;
  int material_count = 1;
  material::RuntimeEffects effects;
  bool held_gravity = false;

  Real cell = 0;
  Real step = 0;              ///< dt of the drift and of the strain push [s]
  Real kick = 0;              ///< dt of the grid's last kick, for particles that use no grid [s]
  Real stress_half_step = 0;  ///< half the dt over which C was the velocity gradient [s]
  Vec3<Real> uniform_gravity{};
  Transfer<Real> transfer{};

  bool gather = true;   ///< G2P and particle update
  bool scatter = true;  ///< stress and P2G
};

/// Sums to velocities.
template <class Real>
struct NodeArguments {
  GridView<Real> grid;
  SharedView<Real> shared;
  Real kick = 0;           ///< dt of the kick [s]
  Real smallest_mass = 0;  ///< nodes with less are empty (hard case 2) [kg]
  double cell = 0;         ///< [m]
  const BoundaryPlane* walls = nullptr;
  int wall_count = 0;
};

}  // namespace breccia::cuda

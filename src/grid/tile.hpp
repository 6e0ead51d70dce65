// The tile: the particles of a stack of blocks and the nodes they can reach. Plain data shared by the engine and the
// kernel files.
#pragma once

#include <cstdint>
#include <span>

#include "grid/layout.hpp"
#include "grid/node_columns.hpp"
#include "grid/particles.hpp"
#include "material/constitutive.hpp"

namespace breccia::grid {

/// Blocks of a stack, along z. Along z nodes are taken by aligned pairs, so that one block would be a fourth of waste.
inline constexpr int kStackBlocks = 4;
inline constexpr int kStackHeight = kStackBlocks * kBlockWidth;  ///< nodes of a stack along z
inline constexpr int kStackCells = kStackBlocks * kBlockNodes;
inline constexpr int kTileHeight = kStackHeight + 2 * kTileMargin;  ///< nodes of a tile along z; kTileWidth along x, y

inline constexpr std::uint32_t kNoTile = kNoBlock;

/// Lowest block of the stack that a block belongs to.
constexpr BlockCoord stack_of(BlockCoord b) { return {b.x, b.y, b.z & ~(kStackBlocks - 1)}; }

/// Nodes of a tile along an axis.
constexpr int tile_extent(int axis) { return axis == 2 ? kTileHeight : kTileWidth; }

/// Columns of nodes of a tile, and where column (x, y) stands among them.
inline constexpr int kTileColumns = kTileWidth * kTileWidth;
constexpr int column_index(int x, int y) { return x * kTileWidth + y; }

/// The blocks around and of a stack, x slowest.
inline constexpr int kNeighboursAlongZ = kStackBlocks + 2;
inline constexpr int kNeighbours = 3 * 3 * kNeighboursAlongZ;

/// Where neighbour n lies, in blocks from the lowest of the stack.
constexpr BlockCoord neighbour_offset(int n) {
  return {n / (3 * kNeighboursAlongZ) - 1, n / kNeighboursAlongZ % 3 - 1, n % kNeighboursAlongZ - 1};
}

constexpr int neighbour_at(BlockCoord offset) {
  return ((offset.x + 1) * 3 + offset.y + 1) * kNeighboursAlongZ + offset.z + 1;
}

/// Which planes of a neighbour, of its four along an axis, a tile can reach: bit 0 for the lowest.
constexpr unsigned planes_in_reach(BlockCoord offset, int axis) {
  constexpr unsigned kAll = (1U << kBlockWidth) - 1;
  const std::int32_t d = component(offset, axis);
  const std::int32_t above = axis == 2 ? kStackBlocks : 1;
  if (d < 0) return kAll & ~(kAll >> kTileMargin);
  return d >= above ? kAll >> (kBlockWidth - kTileMargin) : kAll;
}

/// Which rows along z of a block hold something: bit 4 x + y of half 0 for x = 0, 1, and 4 (x - 2) + y of half 1. Tiles
/// on both sides of a block may mark it at the same time, each its own half.
struct RowMask {
  std::uint8_t half[2] = {0, 0};
};
inline constexpr RowMask kAllRows{{0xff, 0xff}};

/// Channels of a node. Sums while particles scatter, velocities after the grid update.
inline constexpr int kChannels = 8;
enum SumChannel { kMomentum = 0, kForce = 3, kMass = 6 };
enum VelocityChannel { kNewVelocity = 0, kOldVelocity = 3 };  // kMass stays where it is

/// Of the velocities of a node, which come in two halves. How these lie is a matter of the kernels
/// (node_velocities.hpp).
inline constexpr int kVelocityChannels = kChannels / 2;

template <class P>
using Node = Pack<typename P::Real, kChannels>;

/// Nodes of a tile, or of those where stencils begin: first and last of each axis.
struct TileBox {
  std::int8_t low[3];
  std::int8_t high[3];
};

static_assert(NodeColumns::kBefore >= kStackHeight + kTileMargin && NodeColumns::kBefore % 2 == 0);

/// Where a stencil that lies in a tile begins.
inline constexpr TileBox kAnyStart{{0, 0, 0}, {kTileWidth - 3, kTileWidth - 3, kTileHeight - 3}};

/// The columns of a tile that lie in blocks above each other.
struct TileColumns {
  std::uint32_t first = 0;   ///< place of the tile's node z = 0 in the column (0, 0) of the blocks
  std::uint32_t height = 0;  ///< places from one column to the next (node_columns.hpp)
};

struct Tile {
  std::uint32_t first_pack = 0;
  std::uint32_t particles = 0;
  std::uint32_t first_block = 0;  ///< of the blocks of its stack that it reaches and this rank owns
  std::uint32_t last_block = 0;
  TileBox starts = kAnyStart;             ///< of stencils all whose nodes exist; low along z is even
  TileColumns columns[9];                 ///< of the blocks around and of the stack, x slowest
  std::uint32_t neighbours[kNeighbours];  ///< block indices; kNoBlock where it reaches no node
};

/// Finds the columns of a tile, from where its neighbours lie.
inline void set_columns(Tile& tile, std::span<const BlockPlace> blocks) {
  for (int column = 0; column < 9; ++column) {
    for (int n = column * kNeighboursAlongZ; n < (column + 1) * kNeighboursAlongZ; ++n) {
      const std::uint32_t block = tile.neighbours[n];
      if (block == kNoBlock) continue;
      const std::int32_t height_in_tile = kBlockWidth * neighbour_offset(n).z + kTileMargin;
      tile.columns[column] = {blocks[block].first - static_cast<std::uint32_t>(height_in_tile), blocks[block].height};
      break;
    }
  }
}

/// Packs of particles that no other particle can meet before the next sorting (lone_pass.hpp). They follow the tiles.
struct LonePacks {
  std::uint32_t first_pack = 0;
  std::uint32_t particles = 0;
};

/// What a kick takes from C of a lone particle, by the stress of its last scatter: (4/dx^2) (V0/m) tau [1/s2].
template <class P>
struct LonePull {
  Sym3<typename P::RealPack> rate;
};

/// What a pass over a tile, or over a stretch of lone packs, found.
struct TileReport {
  double plastic_work = 0.0;  ///< [J]
  double viscous_work = 0.0;  ///< [J]
  double largest_move = 0.0;  ///< largest |dx| along an axis [cells]
  std::uint32_t strayed = 0;  ///< particles found outside the margin
  std::uint32_t clamped = 0;  ///< particles whose change of J was cut (hard case 3)
};

/// What would have become of the first particle a pass could not take on; its pack is left as it was before.
struct PassFault {
  static constexpr std::uint32_t kNone = 0xffffffffU;
  std::uint32_t slot = kNone;       ///< pack * lanes + lane; the lowest of all
  int lock = 0;                     ///< tiles of several threads may fail at once
  bool finite = false;              ///< false: not finite; true: it moved a cell or more in one step
  double velocity[3] = {};          ///< [m/s]
  double volume_change = 0.0;       ///< J - 1
  double energy = 0.0;              ///< [J/kg]
  double kirchhoff_pressure = 0.0;  ///< J P [Pa]
  double damage_root = 0.0;         ///< D^(1/3)
};

/// Velocity transfer (physics.md 5): d = alpha (v_p - v_old); v_p = v_new + d; x += dt (v_new + beta d).
struct TransferParameters {
  double alpha = 0.995;
  double beta = 1.0;
  bool affine = true;  ///< C enters P2G (APIC, ASFLIP); off: FLIP
};

/// Everything a pass reads and writes, as plain pointers: kernel files hold no containers.
template <class P>
struct PassArguments {
  using Real = typename P::Real;

  const Tile* tiles = nullptr;
  const Tile* targets = nullptr;  ///< the same tiles, with the blocks they add to as neighbours
  std::uint32_t tile_count = 0;
  Kinematics<P>* kinematics = nullptr;
  Volume<P>* volume = nullptr;
  Elastic<P>* elastic = nullptr;
  Energy<P>* energy = nullptr;
  DamageLevel<P>* damage_level = nullptr;
  Flaws<P>* flaws = nullptr;
  HeldGravity<P>* gravity = nullptr;  ///< null: no self-gravity
  Identity<P>* identity = nullptr;
  Affine<P>* affine = nullptr;
  LonePacks lone;
  LonePull<P>* lone_pull = nullptr;  ///< one for each lone pack

  const Real* velocities = nullptr;                ///< as node_velocities.hpp lays them out
  std::size_t places = 0;                          ///< of velocities
  Real* sums = nullptr;                            ///< [places][8], SumChannel
  RowMask* rows = nullptr;                         ///< [blocks] rows that a scatter has added to
  const material::FlawCode* flaw_codes = nullptr;  ///< arena of this rank
  PassFault* fault = nullptr;
  const material::Constants<Real>* materials = nullptr;
  int material_count = 1;
  material::RuntimeEffects effects;

  Real cell = 0;
  Real step = 0;              ///< dt of the drift and of the strain push [s]
  Real kick = 0;              ///< dt of the grid's last kick, for particles that use no grid [s]
  Real stress_half_step = 0;  ///< half the dt over which C was the velocity gradient [s]
  Vec3<Real> uniform_gravity{};
  TransferParameters transfer;

  bool gather = true;         ///< G2P and particle update
  bool scatter = true;        ///< stress and P2G
  bool adds_by_tile = false;  ///< what a tile gives to a node is added up first (ordered_sums.hpp)
};

/// What the output step reads from the grid, without changing anything.
template <class P>
struct ProbeArguments {
  using Real = typename P::Real;
  const Tile* tiles = nullptr;
  const Kinematics<P>* kinematics = nullptr;
  const Affine<P>* affine = nullptr;
  const Real* velocities = nullptr;
  std::size_t places = 0;
  TransferParameters transfer;
  Real* new_velocity = nullptr;  ///< [slots][3] v_p^{n+1/2}
  Real* node_mass = nullptr;     ///< [slots] sum of w m_i
  Real* gradient = nullptr;      ///< [slots][9] C^{n+1/2}, row by row
  Real cell = 0;

  LonePacks lone;
  const LonePull<P>* lone_pull = nullptr;
  const HeldGravity<P>* gravity = nullptr;
  Vec3<Real> uniform_gravity{};
  Real kick = 0;
};

/// Grid update of the marked rows of blocks: sums to velocities, sums and marks cleared.
template <class P>
struct NodeArguments {
  using Real = typename P::Real;
  Real* sums = nullptr;
  Real* velocities = nullptr;
  std::size_t places = 0;  ///< of velocities
  const BlockPlace* blocks = nullptr;
  RowMask* rows = nullptr;
  Real kick = 0;           ///< dt of the kick [s]
  Real smallest_mass = 0;  ///< nodes with less are empty (hard case 2) [kg]
};

/// The entry points one instruction set provides.
template <class P>
struct Kernels {
  /// `ahead`: the tile that comes next, whose nodes are far; else kNoTile.
  void (*pass)(const PassArguments<P>&, std::uint32_t tile, std::uint32_t ahead, TileReport&);
  void (*probe)(const ProbeArguments<P>&, std::uint32_t tile);
  /// The same for the lone packs first .. last-1, counted from 0.
  void (*lone_pass)(const PassArguments<P>&, std::uint32_t first, std::uint32_t last, TileReport&);
  void (*lone_probe)(const ProbeArguments<P>&);
  void (*update_blocks)(const NodeArguments<P>&, std::uint32_t first_block, std::uint32_t last_block);
  /// Where half `h` of the velocities at a place lies, the one that begins with v_new being 0 [halves].
  std::uint32_t (*velocity_half)(std::uint32_t place, std::uint32_t h, std::size_t places);
};

/// Kernels of the running processor.
template <class P>
const Kernels<P>& active_kernels();

}  // namespace breccia::grid

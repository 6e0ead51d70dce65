// The kernels, compiled once for each instruction set: BRECCIA_ISA is the namespace of this copy.
#include "grid/lone_pass.hpp"
#include "grid/tile_pass.hpp"

namespace breccia::grid::BRECCIA_ISA {
namespace {

// Of a tile whose sums are added up apart from the grid; zero between two tiles.
template <class P>
typename P::Real* sums_apart() {
  alignas(64) static thread_local typename P::Real sums[kTileColumns * kTileHeight * kChannels];
  return sums;
}

template <class Fx>
bool matches(const material::RuntimeEffects& fx) {
  return fx.shear == Fx::shear && fx.strength == Fx::strength && fx.damage == Fx::damage &&
         fx.viscosity == Fx::viscosity && fx.energy == Fx::energy && fx.fully_damaged == Fx::fully_damaged;
}

// Calls run(effects) with the compile-time policy that equals `fx`, or with fx itself.
template <class F>
BRECCIA_HD void specialised(const material::RuntimeEffects& fx, F&& run) {
  if (matches<material::RockEffects>(fx)) {
    run(material::RockEffects{});
  } else if (matches<material::GranularEffects>(fx)) {
    run(material::GranularEffects{});
  } else {
    run(fx);
  }
}

template <class P>
void pass(const PassArguments<P>& a, std::uint32_t tile, std::uint32_t ahead, TileReport& report) {
  specialised(a.effects, [&](const auto& fx)
                             BRECCIA_INLINE_LAMBDA { pass_over_tile(a, fx, sums_apart<P>(), tile, ahead, report); });
}

template <class P>
void lone_pass(const PassArguments<P>& a, std::uint32_t first, std::uint32_t last, TileReport& report) {
  specialised(a.effects, [&](const auto& fx) BRECCIA_INLINE_LAMBDA { pass_over_lone(a, fx, first, last, report); });
}

template <class P>
void probe(const ProbeArguments<P>& a, std::uint32_t index) {
  using Real = typename P::Real;
  const Tile& tile = a.tiles[index];
  TileNodes<P> nodes;
  nodes.set_velocities(tile, a.velocities, a.places);
  Stencil<P> stencil(tile.starts);
  const auto alpha = static_cast<Real>(a.transfer.alpha);
  for (std::uint32_t first = 0; first < tile.particles; first += P::kLanes) {
    const std::size_t pack = tile.first_pack + first / P::kLanes;
    const auto left = static_cast<int>(tile.particles - first);
    const int lanes = left < P::kLanes ? left : P::kLanes;
    const Kinematics<P>& k = a.kinematics[pack];
    stencil.set(k);
    const GatheredVelocity<P> grid = gather<P>(nodes, stencil, lanes);
    for (int lane = 0; lane < lanes; ++lane) {
      const std::size_t slot = pack * P::kLanes + static_cast<std::size_t>(lane);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        a.new_velocity[3 * slot + axis] =
            grid.updated[axis][lane] + alpha * (k.velocity[axis][lane] - grid.previous[axis][lane]);
      }
      Real mass(0);
      stencil.for_each_node(lane, [&](Real weight, int column, int z) BRECCIA_INLINE_LAMBDA {
        mass += weight * nodes.velocities[column][z * kVelocityStride<P> + mass_distance<P>(a.places)];
      });
      a.node_mass[slot] = mass;
      const Real c = Real(4) / a.cell;  // as TileGrid::velocity
      for (std::size_t row = 0; row < 3; ++row) {
        Real* const gradient = a.gradient + 9 * slot + 3 * row;
        gradient[0] = c * grid.by_x[row][lane];
        gradient[1] = c * grid.by_y[row][lane];
        gradient[2] = c * grid.by_z[row][lane];
      }
    }
  }
}

template <class P>
void lone_probe(const ProbeArguments<P>& a) {
  probe_lone(a);
}

// [p f m 0] to [p/m f/m 1 0] to [v_new v_old m 0], of one node or of two that lie beside each other.
template <class N, class Real>
BRECCIA_HD N node_velocities(N sums, N inverse_mass, Real kick) {
  const N per_mass = sums * inverse_mass;
  const N velocity = rearranged<0, 1, 2, 0, 1, 2, 7, 7>(per_mass);
  const N acceleration = rearranged<3, 4, 5, 7, 7, 7, 7, 7>(per_mass);
  const N mass_alone = rearranged<7, 7, 7, 7, 7, 7, 6, 7>(sums);
  return velocity + N(kick) * acceleration + mass_alone;
}

// A register's worth of nodes from `place` on. Those without mass are at rest.
template <class P>
BRECCIA_HD void update_nodes_at(const NodeArguments<P>& a, std::size_t place) {
  using Real = typename P::Real;
  Real* sums = a.sums + place * kChannels;
  Real* velocities = a.velocities + place * kVelocityStride<P>;
  if constexpr (kNodePairs<P>) {
    using N = TwoNodes<P>;
    const N values = N::load(sums);
    N(Real(0)).store(sums);
    const N mass = rearranged<6, 6, 6, 6, 6, 6, 6, 6>(values);
    // Lanes of an empty node may be anything until the selection.
    const N moving = select(mass > N(a.smallest_mass), node_velocities(values, N(Real(1)) / mass, a.kick), N(Real(0)));
    put_velocities<P>(moving, a.places, velocities);
  } else {
    using N = Node<P>;
    const Real mass = sums[kMass];
    const N values = N::load(sums);
    N(Real(0)).store(sums);
    const N moving = mass > a.smallest_mass ? node_velocities(values, N(Real(1) / mass), a.kick) : N(Real(0));
    moving.store(velocities);
  }
}

template <class P>
BRECCIA_HD void update_row(const NodeArguments<P>& a, std::size_t first) {
  constexpr std::size_t kAtOnce = kNodePairs<P> ? 2 : 1;
  for (std::size_t n = 0; n < kBlockWidth; n += kAtOnce) update_nodes_at(a, first + n);
}

template <class P>
void update_blocks(const NodeArguments<P>& a, std::uint32_t first, std::uint32_t last) {
  for (std::uint32_t block = first; block < last; ++block) {
    unsigned rows = a.rows[block].half[0] | static_cast<unsigned>(a.rows[block].half[1]) << 8;
    a.rows[block] = {};
    const BlockPlace place = a.blocks[block];
    for (std::size_t row = place.first; rows != 0; rows >>= 1U, row += place.height) {
      if ((rows & 1U) != 0) update_row(a, row);
    }
  }
}

template <class P>
std::uint32_t velocity_half(std::uint32_t place, std::uint32_t h, std::size_t places) {
  return kNodePairs<P> ? place + h * static_cast<std::uint32_t>(places) : 2 * place + h;
}

}  // namespace

template <class P>
const Kernels<P>& kernels() {
  static constexpr Kernels<P> table{&pass<P>,       &probe<P>,         &lone_pass<P>,
                                    &lone_probe<P>, &update_blocks<P>, &velocity_half<P>};
  return table;
}
template const Kernels<MixedPrecision>& kernels<MixedPrecision>();
template const Kernels<DoublePrecision>& kernels<DoublePrecision>();

}  // namespace breccia::grid::BRECCIA_ISA

// The kernels, compiled once for each instruction set: BRECCIA_ISA is the namespace of this copy.
#include "grid/tile_pass.hpp"

namespace breccia::grid::BRECCIA_ISA {
namespace {

template <class P>
TileScratch<P>& scratch() {
  static thread_local TileScratch<P> nodes;
  return nodes;
}

template <class Fx>
bool matches(const material::RuntimeEffects& fx) {
  return fx.shear == Fx::shear && fx.strength == Fx::strength && fx.damage == Fx::damage &&
         fx.viscosity == Fx::viscosity && fx.energy == Fx::energy && fx.fully_damaged == Fx::fully_damaged;
}

template <class P>
void pass(const PassArguments<P>& a, std::uint32_t tile, TileReport& report) {
  const material::RuntimeEffects& fx = a.effects;
  const auto run = [&](const auto& effects)
                       BRECCIA_INLINE_LAMBDA { TilePass(a, effects, scratch<P>()).run(a.tiles[tile], report); };
  if (matches<material::RockEffects>(fx)) {
    run(material::RockEffects{});
  } else if (matches<material::GranularEffects>(fx)) {
    run(material::GranularEffects{});
  } else {
    run(fx);
  }
}

template <class P>
void probe(const ProbeArguments<P>& a, std::uint32_t index) {
  using Real = typename P::Real;
  const Tile& tile = a.tiles[index];
  TileScratch<P>& nodes = scratch<P>();
  load_tile<P>(tile, a.velocities, nodes.velocities);
  Stencil<P> stencil;
  const auto alpha = static_cast<Real>(a.transfer.alpha);
  for (std::uint32_t n = 0; n < tile.particles; ++n) {
    const std::size_t pack = tile.first_pack + n / P::kLanes;
    const int lane = static_cast<int>(n % P::kLanes);
    if (lane == 0) stencil.set(a.kinematics[pack]);
    const Node<P> v = gather_lane<P>(nodes.velocities, stencil, lane).value;
    const std::size_t slot = pack * P::kLanes + static_cast<std::size_t>(lane);
    for (int axis = 0; axis < 3; ++axis) {
      const Real old = a.kinematics[pack].velocity[axis][lane];
      a.new_velocity[3 * slot + static_cast<std::size_t>(axis)] =
          v[kNewVelocity + axis] + alpha * (old - v[kOldVelocity + axis]);
    }
    a.node_mass[slot] = v[kMass];
  }
}

template <class P>
void update_blocks(const NodeArguments<P>& a, std::uint32_t first, std::uint32_t last) {
  using N = Node<P>;
  for (std::size_t n = std::size_t{first} * kBlockNodes; n < std::size_t{last} * kBlockNodes; ++n) {
    typename P::Real* sums = a.sums + n * kChannels;
    typename P::Real* velocities = a.velocities + n * kChannels;
    const typename P::Real mass = sums[kMass];
    if (!(mass > a.smallest_mass)) {
      N{}.store(velocities);
      N{}.store(sums);
      continue;
    }
    // Momentum and force per mass are velocity and acceleration.
    const N per_mass = N::load(sums) * N(typename P::Real(1) / mass);
    typename P::Real v[kChannels];
    per_mass.store(v);
    for (int axis = 0; axis < 3; ++axis) {
      velocities[kNewVelocity + axis] = v[kMomentum + axis] + a.kick * v[kForce + axis];
      velocities[kOldVelocity + axis] = v[kMomentum + axis];
    }
    velocities[kMass] = mass;
    velocities[kMass + 1] = typename P::Real(0);
    N{}.store(sums);
  }
}

}  // namespace

template <class P>
const Kernels<P>& kernels() {
  static constexpr Kernels<P> table{&pass<P>, &probe<P>, &update_blocks<P>};
  return table;
}
template const Kernels<MixedPrecision>& kernels<MixedPrecision>();
template const Kernels<DoublePrecision>& kernels<DoublePrecision>();

}  // namespace breccia::grid::BRECCIA_ISA

// The pass over one tile: G2P and P2G on the nodes of the blocks around it.
#pragma once

#include "grid/nodes_ahead.hpp"
#include "grid/pack_pass.hpp"
#include "grid/tile_nodes.hpp"
#include "grid/transfer.hpp"

namespace breccia::grid {

/// The grid of a tile as its packs see it.
template <class P>
class TileGrid {
  using Real = typename P::Real;
  using T = typename P::RealPack;

 public:
  static constexpr bool kKeepsGradient = false;

  /// `sums_apart`: as TileNodes::set_sums_apart wants them.
  BRECCIA_HD TileGrid(const PassArguments<P>& arguments, std::uint32_t tile, Real* sums_apart)
      : a_(arguments), target_(arguments.targets[tile]), stencil_(arguments.tiles[tile].starts) {
    if (a_.gather) nodes_.set_velocities(a_.tiles[tile], a_.velocities, a_.places);
    if (a_.scatter && !a_.adds_by_tile) nodes_.set_sums(target_, a_.sums);
    if (a_.scatter && a_.adds_by_tile) nodes_.set_sums_apart(sums_apart);
  }

  /// After the last pack of the tile.
  BRECCIA_HD void finish(TileReport& report) const {
    if (!a_.scatter) return;
    TileBox box = touched_.box(target_.starts);
    // Those that strayed have been moved to the lowest node.
    for (int axis = 0; strayed_ && axis < 3; ++axis) box.low[axis] = target_.starts.low[axis];
    if (a_.adds_by_tile) nodes_.add_sums(target_, box, a_.sums);
    mark_rows(target_, box, a_.rows);
    if (strayed_) ++report.strayed;
  }

  BRECCIA_HD GridVelocity<P> velocity(std::size_t, int lanes, const Kinematics<P>& k) {
    stencil_.set(k);
    const GatheredVelocity<P> g = gather<P>(nodes_, stencil_, lanes);
    const T c(Real(4) / a_.cell);  // (4 / dx^2) * dx, moments being in cells
    return {{g.updated[0], g.updated[1], g.updated[2]},
            {g.previous[0], g.previous[1], g.previous[2]},
            {c * g.by_x[0], c * g.by_y[0], c * g.by_z[0], c * g.by_x[1], c * g.by_y[1], c * g.by_z[1], c * g.by_x[2],
             c * g.by_y[2], c * g.by_z[2]}};
  }

  BRECCIA_HD void scatter(std::size_t i, int lanes, const Kinematics<P>& k, const PackStress<P>& s, TileReport&) {
    const auto place = stencil_.set_for_scatter(k);
    if (any(stencil_.outside(place))) strayed_ = true;
    touched_.add(place, k.mass);
    grid::scatter<P>(nodes_, stencil_, lanes, momentum_and_force(i, k, s));
  }

 private:
  // Of each lane: value + gradient * (x_i - x_p).
  BRECCIA_HD SpreadMomentum<P> momentum_and_force(std::size_t i, const Kinematics<P>& k, const PackStress<P>& s) const {
    const T affine = a_.transfer.affine ? k.mass * T(a_.cell) : T(Real(0));
    const T pull = T(Real(-4) / a_.cell) * s.volume;
    const Vec3<T> g = gravity_of<P>(a_, i);
    const Mat3<T>& c = s.gradient;
    const Sym3<T>& tau = s.tau;
    return {{k.mass * k.velocity[0], k.mass * k.velocity[1], k.mass * k.velocity[2], k.mass * g.x, k.mass * g.y,
             k.mass * g.z, k.mass},
            {affine * c.xx, affine * c.yx, affine * c.zx, pull * tau.xx, pull * tau.xy, pull * tau.xz},
            {affine * c.xy, affine * c.yy, affine * c.zy, pull * tau.xy, pull * tau.yy, pull * tau.yz},
            {affine * c.xz, affine * c.yz, affine * c.zz, pull * tau.xz, pull * tau.yz, pull * tau.zz}};
  }

  const PassArguments<P>& a_;
  const Tile& target_;
  TileNodes<P> nodes_;
  Stencil<P> stencil_;
  BoxOfStencils<P> touched_;
  bool strayed_ = false;
};

template <class P, class Fx>
BRECCIA_HD void pass_over_tile(const PassArguments<P>& a, const Fx& fx, typename P::Real* sums_apart,
                               std::uint32_t index, std::uint32_t ahead, TileReport& report) {
  TileGrid<P> grid(a, index, sums_apart);
  PackPass<P, Fx, TileGrid<P>> packs(a, fx, grid);
  const Tile& tile = a.tiles[index];
  NodesAhead<P> nodes_ahead(a, tile, ahead);
  for (int done = 0; done < static_cast<int>(tile.particles); done += P::kLanes) {
    const int left = static_cast<int>(tile.particles) - done;
    const int pack = done / P::kLanes;
    nodes_ahead.ask(pack);
    packs.run(tile.first_pack + static_cast<std::size_t>(pack), left < P::kLanes ? left : P::kLanes, report);
  }
  grid.finish(report);
}

}  // namespace breccia::grid

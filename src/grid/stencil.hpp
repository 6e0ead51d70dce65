// Quadratic B-spline weights of a pack of particles.
#pragma once

#include "grid/node_velocities.hpp"

namespace breccia::grid {

/// Offset from the nearest node in cells, in [-1/2, 1/2).
BRECCIA_HD Pack<float, 16> offset_in_cells(Pack<std::int32_t, 16> offset) {
  return convert<float>(offset) * Pack<float, 16>(0x1p-32F);
}
BRECCIA_HD Pack<double, 8> offset_in_cells(Pack<double, 8> offset) { return offset; }

/// First node of the stencil along an axis in the tile, from 0 inside the margin.
template <int W>
BRECCIA_HD Pack<std::int32_t, W> stencil_start(Pack<std::int32_t, W> node, int axis) {
  using I = Pack<std::int32_t, W>;
  return ((node >> (8 * axis)) & I(255)) - I(kNodeBias - 1);
}

/// The nodes around the particles of a pack and their weights: products along x and y, and those along z. Along z the
/// gather takes the three nodes; where nodes are taken by pairs the scatter takes four, one of them with weight 0, so
/// that the first is even. First moments are taken about the nearest node, sum w_k (k - 1) n_k, which needs no weights
/// of its own but along z by pairs; `offset` turns them into moments about the particle.
template <class P>
struct Stencil {
  using Real = typename P::Real;
  using T = typename P::RealPack;
  static constexpr int kAlongZ = kNodePairs<P> ? 4 : 3;
  static constexpr int kColumnBits = 5;  ///< of start: those of z
  static constexpr int kColumnUnit = 1 << kColumnBits;
  static_assert(kTileHeight <= kColumnUnit);

  T offset[3];                                  ///< of the particle from its nearest node [cells]
  alignas(64) Real weight_xy[3][3][P::kLanes];  ///< of the column (x, y)
  alignas(64) Real weight_z[kAlongZ][P::kLanes];
  alignas(64) Real moment_z[kAlongZ][P::kLanes];  ///< only for pairs
  alignas(64) std::int32_t start[P::kLanes];      ///< first node: its column in the tile, times kColumnUnit, and z

  /// Stencils that do not begin in `starts` are moved to its lowest node.
  BRECCIA_HD explicit Stencil(const TileBox& starts) : starts_(starts) {}

  /// First node along each axis of every lane.
  struct Place {
    typename P::IntPack axis[3];
  };

  BRECCIA_HD static Place place(const Kinematics<P>& k) {
    return {stencil_start(k.node, 0), stencil_start(k.node, 1), stencil_start(k.node, 2)};
  }

  /// Sets the stencil of all lanes to three nodes along z.
  BRECCIA_HD Place set(const Kinematics<P>& k) {
    const Place p = place(k);
    set_columns(k);
    const Weights w(offset[2]);
    for (int i = 0; i < 3; ++i) w.node[i].store(weight_z[i]);
    set_start(p, p.axis[2]);
    return p;
  }

  /// The same for a scatter: two pairs of nodes along z where pairs fit a register.
  BRECCIA_HD Place set_for_scatter(const Kinematics<P>& k) {
    using I = typename P::IntPack;
    if constexpr (kNodePairs<P>) {
      const Place p = place(k);
      set_columns(k);
      store_pairs(Weights(offset[2]), (p.axis[2] & I(1)) == I(1));
      set_start(p, p.axis[2] & I(~1));
      return p;
    } else {
      return set(k);
    }
  }

  /// Lanes whose stencil does not begin in the box.
  BRECCIA_HD static typename P::IntPack::Mask outside(const Place& place, const TileBox& starts) {
    using I = typename P::IntPack;
    const auto before = [&](int axis) BRECCIA_INLINE_LAMBDA { return place.axis[axis] < I(starts.low[axis]); };
    const auto behind = [&](int axis) BRECCIA_INLINE_LAMBDA { return place.axis[axis] > I(starts.high[axis]); };
    return (before(0) | before(1) | before(2)) | (behind(0) | behind(1) | behind(2));
  }
  BRECCIA_HD typename P::IntPack::Mask outside(const Place& place) const { return outside(place, starts_); }

  /// The column of the first node in the tile, and its z there.
  BRECCIA_HD int column(int lane) const { return start[lane] >> kColumnBits; }
  BRECCIA_HD int along_z(int lane) const { return start[lane] & (kColumnUnit - 1); }

  /// Calls visit(weight, column in the tile, z) for the 27 nodes of a lane; after set().
  template <class F>
  BRECCIA_HD void for_each_node(int lane, F&& visit) const {
    for (int x = 0; x < 3; ++x) {
      for (int y = 0; y < 3; ++y) {
        for (int z = 0; z < 3; ++z) {
          visit(weight_xy[x][y][lane] * weight_z[z][lane], column(lane) + column_index(x, y), along_z(lane) + z);
        }
      }
    }
  }

 private:
  struct Weights {
    T node[3];
    BRECCIA_HD explicit Weights(T d) {
      const T half(Real(0.5));
      const T lower = half - d;
      const T upper = half + d;
      node[0] = half * lower * lower;
      node[1] = T(Real(0.75)) - d * d;
      node[2] = half * upper * upper;
    }
  };

  BRECCIA_HD void set_columns(const Kinematics<P>& k) {
    for (int axis = 0; axis < 3; ++axis) offset[axis] = offset_in_cells(k.offset[axis]);
    const Weights x(offset[0]);
    const Weights y(offset[1]);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) (x.node[i] * y.node[j]).store(weight_xy[i][j]);
    }
  }

  BRECCIA_HD void set_start(const Place& p, typename P::IntPack z) {
    using I = typename P::IntPack;
    const I moved(column_index(starts_.low[0], starts_.low[1]) * kColumnUnit + starts_.low[2]);
    const I here = p.axis[0] * I(kTileWidth * kColumnUnit) + p.axis[1] * I(kColumnUnit) + z;
    select(outside(p), moved, here).store(start);
  }

  BRECCIA_HD void store_pairs(const Weights& w, typename T::Mask odd) {
    const T zero(Real(0));
    select(odd, zero, w.node[0]).store(weight_z[0]);
    select(odd, w.node[0], w.node[1]).store(weight_z[1]);
    select(odd, w.node[1], w.node[2]).store(weight_z[2]);
    select(odd, w.node[2], zero).store(weight_z[3]);
    select(odd, zero, -w.node[0]).store(moment_z[0]);
    select(odd, -w.node[0], zero).store(moment_z[1]);
    select(odd, zero, w.node[2]).store(moment_z[2]);
    select(odd, w.node[2], zero).store(moment_z[3]);
  }

  TileBox starts_;
};

/// Grows over the stencils of the packs of a tile.
template <class P>
class BoxOfStencils {
  using I = typename P::IntPack;

 public:
  BRECCIA_HD BoxOfStencils() : low_{I(kTileHeight), I(kTileHeight), I(kTileHeight)}, high_{I(-1), I(-1), I(-1)} {}

  /// Empty lanes have mass 0 and do not count.
  BRECCIA_HD void add(const typename Stencil<P>::Place& place, typename P::RealPack mass) {
    const auto there = convert<std::int32_t>(select(mass > typename P::RealPack(0), typename P::RealPack(1),
                                                    typename P::RealPack(0))) > I(0);
    for (int axis = 0; axis < 3; ++axis) {
      low_[axis] = select(there, min(low_[axis], place.axis[axis]), low_[axis]);
      high_[axis] = select(there, max(high_[axis], place.axis[axis]), high_[axis]);
    }
  }

  /// The nodes of stencils that begin in `starts`.
  [[nodiscard]] BRECCIA_HD TileBox box(const TileBox& starts) const {
    TileBox b;
    for (int axis = 0; axis < 3; ++axis) {
      int low = starts.high[axis];
      int high = starts.low[axis];
      for (int l = 0; l < P::kLanes; ++l) {
        low = low_[axis][l] < low ? low_[axis][l] : low;
        high = high_[axis][l] > high ? high_[axis][l] : high;
      }
      // What strayed is not there.
      low = low < starts.low[axis] ? starts.low[axis] : low;
      high = high > starts.high[axis] ? starts.high[axis] : high;
      b.low[axis] = static_cast<std::int8_t>(low);
      b.high[axis] = static_cast<std::int8_t>(high + 2);
    }
    return b;
  }

 private:
  I low_[3], high_[3];
};

}  // namespace breccia::grid

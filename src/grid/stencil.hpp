// Quadratic B-spline weights of a pack of particles.
#pragma once

#include "grid/tile.hpp"

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

/// Two nodes that follow each other along z fill a register: transfers take nodes by pairs (transfer_pairs.hpp).
template <class P>
inline constexpr bool kNodePairs = static_cast<int>(sizeof(typename P::Real)) * 2 * kChannels == kRegisterBytes;

/// Weights w_k of three nodes along an axis. First moments are taken about the nearest node, sum w_k (k - 1) n_k, which
/// needs no weights of its own; `offset` turns them into moments about the particle. Where nodes are taken by pairs
/// there are four along z, one of them with weight 0, so that the first is even; their moments are tabulated.
template <class P>
struct Stencil {
  using Real = typename P::Real;
  using T = typename P::RealPack;
  static constexpr int kAlongZ = kNodePairs<P> ? 4 : 3;

  T offset[3];                               ///< of the particle from its nearest node [cells]
  alignas(64) Real weight[2][3][P::kLanes];  ///< x and y
  alignas(64) Real weight_z[kAlongZ][P::kLanes];
  alignas(64) Real moment_z[kAlongZ][P::kLanes];  ///< only for pairs
  alignas(64) std::int32_t start[P::kLanes];      ///< index of the first node in the tile

  /// First node along each axis of every lane.
  struct Place {
    typename P::IntPack axis[3];
  };

  BRECCIA_HD static Place place(const Kinematics<P>& k) {
    return {stencil_start(k.node, 0), stencil_start(k.node, 1), stencil_start(k.node, 2)};
  }

  /// Sets the stencil of all lanes. The start of those outside the margin is made harmless.
  BRECCIA_HD Place set(const Kinematics<P>& k) {
    using I = typename P::IntPack;
    const Place p = place(k);
    const I z = p.axis[2];
    for (int axis = 0; axis < 3; ++axis) offset[axis] = offset_in_cells(k.offset[axis]);
    store(Weights(offset[0]), weight[0]);
    store(Weights(offset[1]), weight[1]);
    if constexpr (kNodePairs<P>) {
      store_pairs(Weights(offset[2]), (z & I(1)) == I(1));
    } else {
      store(Weights(offset[2]), weight_z);
    }
    const I first = kNodePairs<P> ? z & I(~1) : z;
    select(outside(p), I(0), p.axis[0] * I(kTilePlane) + p.axis[1] * I(kTileHeight) + first).store(start);
    return p;
  }

  /// Lanes whose stencil reaches beyond the tile.
  BRECCIA_HD static typename P::IntPack::Mask outside(const Place& place) {
    using I = typename P::IntPack;
    const I low = min(min(place.axis[0], place.axis[1]), place.axis[2]);
    const I high = max(max(place.axis[0], place.axis[1]), place.axis[2] - I(kTileHeight - kTileWidth));
    return (low < I(0)) | (high > I(kTileWidth - 3));
  }

  /// sum over the nodes of w^2.
  BRECCIA_HD Real sum_of_squares(int lane) const {
    Real x(0), y(0), z(0);
    for (int i = 0; i < 3; ++i) {
      x += weight[0][i][lane] * weight[0][i][lane];
      y += weight[1][i][lane] * weight[1][i][lane];
    }
    for (int i = 0; i < kAlongZ; ++i) z += weight_z[i][lane] * weight_z[i][lane];
    return x * y * z;
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

  BRECCIA_HD static void store(const Weights& w, Real (&to)[3][P::kLanes]) {
    for (int i = 0; i < 3; ++i) w.node[i].store(to[i]);
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

  /// Inside the tile whatever strayed.
  [[nodiscard]] BRECCIA_HD TileBox box() const {
    TileBox b;
    for (int axis = 0; axis < 3; ++axis) {
      const int last = tile_extent(axis) - 3;
      int low = last;
      int high = 0;
      for (int l = 0; l < P::kLanes; ++l) {
        low = low_[axis][l] < low ? low_[axis][l] : low;
        high = high_[axis][l] > high ? high_[axis][l] : high;
      }
      b.low[axis] = static_cast<std::int8_t>(low < 0 ? 0 : low);
      b.high[axis] = static_cast<std::int8_t>((high > last ? last : high) + 2);
    }
    return b;
  }

 private:
  I low_[3], high_[3];
};

}  // namespace breccia::grid

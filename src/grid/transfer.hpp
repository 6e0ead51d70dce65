// Between the nodes of a tile and a pack of particles. Node channels lie in lanes, particles are taken one after the
// other. The sums over the 27 nodes are taken over the nine columns first, whose weights are products made for all
// lanes at once, and then along z; a scatter goes the other way. First moments are taken about the nearest node, where
// they cost a difference of two terms. Where two nodes fill a register a gather takes four of half the channels and a
// scatter pairs, else both take nodes one by one.
#pragma once

#include "grid/stencil.hpp"
#include "grid/tile_nodes.hpp"

namespace breccia::grid {

/// What a gather delivers, lanes = particles: sum w n of both velocities of the nodes, sum w r n of v_new, r in cells.
template <class P>
struct GatheredVelocity {
  using T = typename P::RealPack;
  T updated[3], previous[3];
  T by_x[3], by_y[3], by_z[3];
};

/// What a scatter spreads, lanes = particles: node (r) gets w (value + by_x r_x + by_y r_y + by_z r_z). The mass has no
/// slope.
template <class P>
struct SpreadMomentum {
  using T = typename P::RealPack;
  T value[kChannels - 1];
  T by_x[6], by_y[6], by_z[6];
};

/// Whether most particles of a pack have the stencil of the one before them. The end of a run is a branch nobody can
/// predict: runs must be long for it to pay.
template <class P>
BRECCIA_HD bool mostly_shared(const Stencil<P>& s, int lanes) {
  int shared = 0;
  for (int l = 1; l < lanes; ++l) shared += s.start[l] == s.start[l - 1] ? 1 : 0;
  return shared >= P::kLanes * 5 / 8;
}

}  // namespace breccia::grid

#include "grid/gather_fours.hpp"
#include "grid/scatter_pairs.hpp"
#include "grid/transfer_nodes.hpp"

namespace breccia::grid {

template <class P>
BRECCIA_HD GatheredVelocity<P> gather(const TileNodes<P>& nodes, const Stencil<P>& s, int lanes) {
  GatheredVelocity<P> g;
  if constexpr (kNodePairs<P>) {
    gather_fours<P>(nodes, s, lanes, g);
  } else {
    gather_nodes<P>(nodes, s, lanes, g);
  }
  // From moments about the nearest node to moments about the particle.
  for (int c = 0; c < 3; ++c) {
    g.by_x[c] = g.by_x[c] - s.offset[0] * g.updated[c];
    g.by_y[c] = g.by_y[c] - s.offset[1] * g.updated[c];
    g.by_z[c] = g.by_z[c] - s.offset[2] * g.updated[c];
  }
  return g;
}

/// Adds to the nodes of the tile. Lanes from `lanes` on are left out.
template <class P>
BRECCIA_HD void scatter(const TileNodes<P>& nodes, const Stencil<P>& s, int lanes, SpreadMomentum<P>&& q) {
  // The linear field at the nearest node instead of at the particle.
  for (int c = 0; c < 6; ++c) {
    q.value[c] = q.value[c] - s.offset[0] * q.by_x[c] - s.offset[1] * q.by_y[c] - s.offset[2] * q.by_z[c];
  }
  if constexpr (kNodePairs<P>) {
    scatter_pairs<P>(nodes, s, lanes, q);
  } else {
    scatter_nodes<P>(nodes, s, lanes, q);
  }
}

}  // namespace breccia::grid

// How the velocities of the nodes lie in a tile. Where two nodes of a block fill a register, the tile holds them in two
// arrays of four channels: v_new with x of v_old, and [z of v_old, 0, mass, y of v_old] (gather_fours.hpp). Else a node
// keeps its channels together, as in the blocks.
#pragma once

#include "grid/tile.hpp"

namespace breccia::grid {

/// Two nodes that follow each other along z fill a register: transfers take several at once.
template <class P>
inline constexpr bool kNodePairs = static_cast<int>(sizeof(typename P::Real)) * 2 * kChannels == kRegisterBytes;

template <class P>
using TwoNodes = Pack<typename P::Real, 2 * kChannels>;

/// Of a node in either array.
inline constexpr int kVelocityChannels = 4;

/// Channels of the second array. y of v_old is last, where the first array has a channel whose slopes nobody needs: it
/// takes the place of one of them without being moved.
enum RestChannel { kRestOldZ = 0, kRestMass = 2, kRestOldY = 3 };

/// Four nodes along z of one array.
template <class P>
using FourNodes = Pack<typename P::Real, 4 * kVelocityChannels>;

/// Where the mass of node n of the tile lies in its velocities.
template <class P>
BRECCIA_HD constexpr int place_of_mass(int n) {
  if constexpr (kNodePairs<P>) return (kTileNodes + n) * kVelocityChannels + kRestMass;
  return n * kChannels + kMass;
}

/// Puts two nodes, n and n + 1, as they lie in a block into the velocities of a tile.
template <class P>
BRECCIA_HD void put_velocities(TwoNodes<P> two, int n, typename P::Real* nodes) {
  if constexpr (kNodePairs<P>) {
    using Half = Pack<typename P::Real, kChannels>;
    const Half moving(__builtin_shufflevector(two.v, two.v, 0, 1, 2, 3, 8, 9, 10, 11));
    const Half rest(__builtin_shufflevector(two.v, two.v, 5, 7, 6, 4, 13, 15, 14, 12));
    moving.store(nodes + n * kVelocityChannels);
    rest.store(nodes + (kTileNodes + n) * kVelocityChannels);
  } else {
    two.store(nodes + n * kChannels);
  }
}

}  // namespace breccia::grid

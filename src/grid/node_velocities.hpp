// How the velocities of the nodes lie in memory. Where two nodes fill a register, they lie in two arrays of four
// channels, the second behind the whole of the first: v_new with x of v_old, and [z of v_old, 0, mass, y of v_old]
// (gather_fours.hpp). Else a node keeps its channels together, as its sums do.
#pragma once

#include "grid/tile.hpp"

namespace breccia::grid {

/// Two nodes that follow each other along z fill a register: transfers take several at once.
template <class P>
inline constexpr bool kNodePairs = static_cast<int>(sizeof(typename P::Real)) * 2 * kChannels == kRegisterBytes;

template <class P>
using TwoNodes = Pack<typename P::Real, 2 * kChannels>;

/// Channels of the second array. y of v_old is last, where the first array has a channel whose slopes nobody needs: it
/// takes the place of one of them without being moved.
enum RestChannel { kRestOldZ = 0, kRestMass = 2, kRestOldY = 3 };

/// Four nodes along z of one array.
template <class P>
using FourNodes = Pack<typename P::Real, 4 * kVelocityChannels>;

/// Reals from one place to the next: of a column of velocities.
template <class P>
inline constexpr int kVelocityStride = kNodePairs<P> ? kVelocityChannels : kChannels;

/// From the first array to the second [reals]; `places` of all velocities.
BRECCIA_HD constexpr std::size_t rest_distance(std::size_t places) { return places * kVelocityChannels; }

/// Where the mass of a node lies, from where its velocities do.
template <class P>
BRECCIA_HD constexpr std::size_t mass_distance(std::size_t places) {
  return kNodePairs<P> ? rest_distance(places) + kRestMass : std::size_t{kMass};
}

/// Puts two nodes that follow each other, as channels of VelocityChannel, to where the velocities of the first lie.
template <class P>
BRECCIA_HD void put_velocities(TwoNodes<P> two, std::size_t places, typename P::Real* to) {
  static_assert(kNodePairs<P>);
  using Half = Pack<typename P::Real, kChannels>;
  const Half moving(__builtin_shufflevector(two.v, two.v, 0, 1, 2, 3, 8, 9, 10, 11));
  const Half rest(__builtin_shufflevector(two.v, two.v, 5, 7, 6, 4, 13, 15, 14, 12));
  moving.store(to);
  rest.store(to + rest_distance(places));
}

}  // namespace breccia::grid

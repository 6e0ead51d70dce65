// What a step costs, by what can be counted: the weights by which slabs are balanced. Only their relations matter.
#pragma once

namespace breccia::grid {

/// Cost of one step [ps]. A tile costs by itself (its nodes are fetched and updated), and its particles by the pack.
struct WorkWeights {
  double tile;       ///< that holds particles
  double pack;       ///< of particles in a tile, full or not
  double lone_pack;  ///< of particles without grid
};

}  // namespace breccia::grid

// Sums that do not depend on how the grid is cut (numerics.reproducible): what a tile gives to a node is added up
// first, and one rank alone adds the tiles that reach a node in the order of their turns and keys (sweep_plan.hpp).
// Where slabs meet, and where the boundary tiles run before others that should have come first, every tile therefore
// adds to blocks of its own, and the owner of a block adds up what tiles gave to it in that same order.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "grid/blocks.hpp"
#include "grid/node_columns.hpp"
#include "grid/tile.hpp"
#include "mpi/halo.hpp"
#include "mpi/standing_requests.hpp"

namespace breccia::grid {

/// Where the sums of an owned block come from.
enum class BlockSums : std::uint8_t {
  kInPlace,    ///< all tiles add to it directly, on this rank
  kCollected,  ///< tiles of this rank alone, added up in order
  kShared      ///< other ranks add to it, too
};

/// What a tile gives to a block.
struct Contribution {
  BlockKey tile;  ///< lowest block of its stack
  BlockKey block;
  std::int32_t neighbour;  ///< index of the block in Tile::neighbours
  std::int32_t turn;       ///< of the tile

  friend bool operator==(const Contribution&, const Contribution&) = default;
};

/// The nodes that contributions travel through.
struct ContributionMessages {
  std::vector<mpi::SharedNodes> sent, received;
};

class OrderedSums {
 public:
  /// Gives tiles that reach columns of blocks of other ranks, shared or collected blocks columns of their own to add
  /// to, stored behind those of `blocks`: their places are appended to `columns`. In a column of blocks either none or
  /// all are added to in place. `stacks`: lowest blocks of the tiles; `owner(block)` is a rank; `period` as in
  /// sweep_plan.hpp. Collective.
  template <class Owner>
  ContributionMessages connect(std::span<const Tile> tiles, std::span<const BlockKey> stacks, const BlockTable& blocks,
                               NodeColumns& columns, std::span<const BlockSums> owned, std::int32_t period,
                               Owner&& owner, const mpi::Comm& comm) {
    begin(tiles, comm.size());
    for (std::uint32_t t = 0; t < tiles.size(); ++t) {
      bool has_own = false;
      for (int column = 0; column < kNeighbours; column += kNeighboursAlongZ) {
        const auto first = static_cast<std::uint32_t>(columns.blocks().size());
        int count = 0;
        for (int n = column; n < column + kNeighboursAlongZ; ++n) {
          const std::uint32_t block = tiles[t].neighbours[n];
          if (block == kNoBlock || (block < owned.size() && owned[block] == BlockSums::kInPlace)) continue;
          const Contribution c{stacks[t], blocks.keys()[block], n, sweep_turn_of(stacks[t], period)};
          const int rank = block < owned.size() ? comm.rank() : owner(block_coord(c.block));
          add(t, block, c, first + static_cast<std::uint32_t>(count++), rank, comm.rank());
        }
        if (count != 0) columns.append_run(count);
        has_own = has_own || count != 0;
      }
      if (has_own) set_columns(targets_[t], columns.blocks());
    }
    return finish(blocks, columns, owned, comm);
  }

  /// The tiles, with the blocks they add to as neighbours.
  [[nodiscard]] std::span<const Tile> targets() const { return targets_; }
  /// How many blocks are added up: the shared ones first, then the collected ones.
  [[nodiscard]] std::size_t sums() const { return sums_.size(); }
  [[nodiscard]] std::size_t shared_sums() const { return shared_; }

  /// Adds up the sum `i` into its block, marks its rows and clears what it took.
  template <class Real>
  void add_up(std::size_t i, const NodeColumns& columns, Real* sums, RowMask* rows) const;

 private:
  struct Part {
    std::uint32_t block;
    Contribution what;
    std::uint32_t from;  ///< block it lies in
    RowMask rows;        ///< of a received one; those of others are marked where they lie
  };
  struct Sum {
    std::uint32_t block, first, last;  ///< parts
  };

  static int sweep_turn_of(BlockKey tile, std::int32_t period);
  void begin(std::span<const Tile> tiles, int ranks);
  void add(std::uint32_t tile, std::uint32_t block, const Contribution& c, std::uint32_t own, int rank, int self);
  ContributionMessages finish(const BlockTable& blocks, NodeColumns& columns, std::span<const BlockSums> owned,
                              const mpi::Comm& comm);

  std::vector<Tile> targets_;
  std::vector<Part> parts_;
  std::vector<Sum> sums_;
  std::size_t shared_ = 0;
  std::vector<std::vector<Contribution>> given_;        // to each rank
  std::vector<std::vector<std::uint32_t>> given_from_;  // the blocks they lie in
  mpi::StandingRequests<Contribution> requests_;
};

}  // namespace breccia::grid

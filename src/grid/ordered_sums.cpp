#include "grid/ordered_sums.hpp"

#include <algorithm>
#include <bit>
#include <tuple>
#include <utility>

#include "grid/sweep_plan.hpp"

namespace breccia::grid {
namespace {

// Nodes of a neighbour that a tile can reach along an axis: first and last.
struct Range {
  std::uint32_t first, last;
  explicit Range(unsigned planes)
      : first(static_cast<std::uint32_t>(std::countr_zero(planes))),
        last(static_cast<std::uint32_t>(std::bit_width(planes)) - 1U) {}
};

struct Reach {
  Range x, y, z;
  explicit Reach(BlockCoord offset)
      : x(planes_in_reach(offset, 0)), y(planes_in_reach(offset, 1)), z(planes_in_reach(offset, 2)) {}
};

void append_nodes(std::vector<std::uint32_t>& nodes, const BlockPlace& block, std::int32_t neighbour) {
  const Reach r(neighbour_offset(neighbour));
  for (std::uint32_t x = r.x.first; x <= r.x.last; ++x) {
    for (std::uint32_t y = r.y.first; y <= r.y.last; ++y) {
      for (std::uint32_t z = r.z.first; z <= r.z.last; ++z) nodes.push_back(block.node(x, y, z));
    }
  }
}

RowMask rows_of(std::int32_t neighbour) {
  const Reach r(neighbour_offset(neighbour));
  RowMask rows;
  for (std::uint32_t x = r.x.first; x <= r.x.last; ++x) {
    for (std::uint32_t y = r.y.first; y <= r.y.last; ++y) {
      std::uint8_t& half = rows.half[x / 2];
      half = static_cast<std::uint8_t>(half | 1U << (4 * (x % 2) + y));
    }
  }
  return rows;
}

}  // namespace

int OrderedSums::sweep_turn_of(BlockKey tile, std::int32_t period) { return sweep_turn(block_coord(tile).x, period); }

void OrderedSums::begin(std::span<const Tile> tiles, int ranks) {
  targets_.assign(tiles.begin(), tiles.end());
  parts_.clear();
  given_.assign(static_cast<std::size_t>(ranks), {});
  given_from_.assign(static_cast<std::size_t>(ranks), {});
}

void OrderedSums::add(std::uint32_t tile, std::uint32_t block, const Contribution& c, std::uint32_t own, int rank,
                      int self) {
  targets_[tile].neighbours[c.neighbour] = own;
  if (rank == self) {
    parts_.push_back({block, c, own, {}});
  } else {
    given_[static_cast<std::size_t>(rank)].push_back(c);
    given_from_[static_cast<std::size_t>(rank)].push_back(own);
  }
}

ContributionMessages OrderedSums::finish(const BlockTable& blocks, NodeColumns& columns,
                                         std::span<const BlockSums> owned, const mpi::Comm& comm) {
  ContributionMessages messages;
  for (std::size_t rank = 0; rank < given_.size(); ++rank) {
    if (given_[rank].empty()) continue;
    mpi::SharedNodes& to = messages.sent.emplace_back(mpi::SharedNodes{static_cast<int>(rank), {}});
    for (std::size_t i = 0; i < given_[rank].size(); ++i) {
      append_nodes(to.nodes, columns.blocks()[given_from_[rank][i]], given_[rank][i].neighbour);
    }
  }
  requests_.ask(std::move(given_), comm);
  for (std::size_t rank = 0; rank < requests_.by_rank().size(); ++rank) {
    const std::vector<Contribution>& of_rank = requests_.by_rank()[rank];
    if (of_rank.empty()) continue;
    mpi::SharedNodes& from = messages.received.emplace_back(mpi::SharedNodes{static_cast<int>(rank), {}});
    for (const Contribution& c : of_rank) {
      const auto own = static_cast<std::uint32_t>(columns.blocks().size());
      columns.append_run(1);
      append_nodes(from.nodes, columns.blocks()[own], c.neighbour);
      parts_.push_back({blocks.find(c.block), c, own, rows_of(c.neighbour)});
    }
  }
  const auto order = [&](const Part& p) {
    return std::tuple(owned[p.block] != BlockSums::kShared, p.block, p.what.turn, p.what.tile, p.what.neighbour);
  };
  std::sort(parts_.begin(), parts_.end(), [&](const Part& a, const Part& b) { return order(a) < order(b); });
  sums_.clear();
  for (std::uint32_t i = 0; i < parts_.size(); ++i) {
    if (sums_.empty() || sums_.back().block != parts_[i].block) sums_.push_back({parts_[i].block, i, i});
    sums_.back().last = i + 1;
  }
  shared_ = static_cast<std::size_t>(
      std::ranges::count_if(sums_, [&](const Sum& s) { return owned[s.block] == BlockSums::kShared; }));
  return messages;
}

template <class Real>
void OrderedSums::add_up(std::size_t i, const NodeColumns& columns, Real* sums, RowMask* rows) const {
  constexpr std::size_t kRow = std::size_t{kBlockWidth} * kChannels;
  const Sum& sum = sums_[i];
  const auto row_of = [&](std::uint32_t block, std::size_t row) {
    return sums + std::size_t{columns.blocks()[block].node(static_cast<std::uint32_t>(row) * kBlockWidth)} * kChannels;
  };
  for (std::uint32_t p = sum.first; p < sum.last; ++p) {
    const Part& part = parts_[p];
    for (std::size_t h = 0; h < 2; ++h) {
      const auto marked = static_cast<std::uint8_t>(part.rows.half[h] | rows[part.from].half[h]);
      rows[part.from].half[h] = 0;
      rows[sum.block].half[h] = static_cast<std::uint8_t>(rows[sum.block].half[h] | marked);
      for (std::size_t row = 0; row < 8; ++row) {
        if ((marked >> row & 1U) == 0) continue;
        Real* const to = row_of(sum.block, 8 * h + row);
        Real* const from = row_of(part.from, 8 * h + row);
        for (std::size_t k = 0; k < kRow; ++k) {
          to[k] += from[k];
          from[k] = Real(0);
        }
      }
    }
  }
}

template void OrderedSums::add_up(std::size_t, const NodeColumns&, float*, RowMask*) const;
template void OrderedSums::add_up(std::size_t, const NodeColumns&, double*, RowMask*) const;

}  // namespace breccia::grid

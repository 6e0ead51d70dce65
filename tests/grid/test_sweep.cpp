// What threads do in a pass over the tiles, and when: the order that fixes the sums on nodes which planes of blocks
// share, and the grid update behind it.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <random>

#include "grid/sweep_board.hpp"
#include "grid/sweep_plan.hpp"

namespace {

using namespace breccia::grid;
using Kind = SweepWork::Kind;

// Planes of one to nine tiles from x = -20 on, a quarter of them empty.
std::vector<SweepTile> random_tiles(std::mt19937& engine, std::int32_t planes) {
  std::vector<SweepTile> tiles;
  for (std::int32_t x = -20; x < planes - 20; ++x) {
    if (engine() % 4 == 0) continue;
    const auto rows = static_cast<std::int32_t>(1 + engine() % 9);
    for (std::int32_t y = 0; y < rows; ++y) {
      tiles.push_back({block_key({x, y, 0}), false, 1.0 + static_cast<double>(engine() % 5)});
    }
  }
  return tiles;
}

std::vector<SweepTile> even_tiles(std::int32_t planes, std::int32_t rows) {
  std::vector<SweepTile> tiles;
  for (std::int32_t x = 0; x < planes; ++x) {
    for (std::int32_t y = 0; y < rows; ++y) tiles.push_back({block_key({x, y, 0}), false, 1.0});
  }
  return tiles;
}

// One part of a sweep as threads of random speed go through it, and what must hold of it.
class PartCheck {
 public:
  PartCheck(std::span<const SweepTile> tiles, const Sweep& sweep, bool boundary, std::int32_t period, bool updates)
      : tiles_(tiles),
        sweep_(sweep),
        part_(boundary ? sweep.boundary : sweep.interior),
        period_(period),
        board_(part_, updates),
        passes_(tiles.size(), 0),
        updates_(tiles.size(), 0) {
    for (const SweepTile& tile : tiles) passes_expected_.push_back(tile.boundary == boundary ? 1 : 0);
    updates_expected_.assign(tiles.size(), updates ? 1 : 0);
  }

  void run(int threads, std::mt19937& engine) {
    std::vector<std::optional<SweepWork>> at_work(static_cast<std::size_t>(threads));
    const auto busy = [](const auto& work) { return work.has_value(); };
    while (!board_.all_taken() || std::ranges::any_of(at_work, busy)) {
      const std::size_t t = engine() % at_work.size();
      if (at_work[t]) {
        end(*at_work[t]);
        at_work[t].reset();
      } else if ((at_work[t] = board_.take(static_cast<int>(t)))) {
        begin(*at_work[t]);
      } else {
        // Somebody works, or nothing would ever get ready.
        ASSERT_TRUE(board_.all_taken() || std::ranges::any_of(at_work, busy));
      }
    }
    EXPECT_EQ(passes_, passes_expected_);
    EXPECT_EQ(updates_, updates_expected_);
  }

 private:
  enum State { kBefore, kDuring, kAfter };

  [[nodiscard]] std::int32_t x(std::uint32_t tile) const { return block_coord(tiles_[tile].stack).x; }
  [[nodiscard]] bool near(std::int32_t a, std::int32_t b) const {
    const std::int32_t apart = std::abs(a - b);
    return apart == 1 || (period_ > 1 && apart == period_ - 1);
  }
  // Tiles that the part passes over.
  [[nodiscard]] std::span<const std::uint32_t> tiles_of(const SweepPlane& plane) const {
    return std::span(sweep_.order).subspan(plane.first, plane.last - plane.first);
  }
  // Calls visit(state, x) for the planes with something to pass over.
  template <class F>
  void for_each_plane(F&& visit) {
    state_.resize(part_.planes.size(), kBefore);
    for (std::size_t n = 0; n < part_.planes.size(); ++n) {
      if (!tiles_of(part_.planes[n]).empty()) visit(state_[n], x(part_.planes[n].first_tile));
    }
  }

  void begin(SweepWork work) {
    const SweepPlane& plane = part_.planes[work.plane];
    const std::int32_t own = x(plane.first_tile);
    const int turn = sweep_turn(own, period_);
    const bool pass = work.kind == Kind::kPass;
    for_each_plane([&](State state, std::int32_t other) {
      if (pass && near(own, other)) {
        // Of planes next to each other that of the lower turn is done before the other begins.
        EXPECT_NE(sweep_turn(other, period_), turn);
        EXPECT_EQ(state, sweep_turn(other, period_) < turn ? kAfter : kBefore) << own << " beside " << other;
      } else if (!pass && (own == other || near(own, other))) {
        // Nobody may read or add to the nodes of a plane after their update.
        EXPECT_EQ(state, kAfter) << "update of " << own << ", pass of " << other;
      }
    });
    if (pass) {
      state_[work.plane] = kDuring;
      for (const std::uint32_t tile : tiles_of(plane)) ++passes_[tile];
    } else {
      for (std::uint32_t tile = plane.first_tile; tile < plane.last_tile; ++tile) ++updates_[tile];
    }
  }

  void end(SweepWork work) {
    if (work.kind == Kind::kPass) state_[work.plane] = kAfter;
    board_.finish(work);
  }

  std::span<const SweepTile> tiles_;
  const Sweep& sweep_;
  const SweepPart& part_;
  std::int32_t period_;
  SweepBoard board_;
  std::vector<State> state_;  // of passes
  std::vector<int> passes_, passes_expected_;
  std::vector<int> updates_, updates_expected_;
};

void check(std::span<const SweepTile> tiles, std::int32_t period, int threads, std::mt19937& engine) {
  const Sweep sweep = plan_sweep(tiles, period, threads);
  PartCheck(tiles, sweep, true, period, false).run(threads, engine);
  PartCheck(tiles, sweep, false, period, false).run(threads, engine);
  PartCheck(tiles, sweep, false, period, true).run(threads, engine);
}

TEST(Sweep, FixesTheOrderOfSumsHoweverThreadsAreScheduled) {
  std::mt19937 engine(1);
  for (int round = 0; round < 200; ++round) {
    std::vector<SweepTile> tiles = random_tiles(engine, 1 + static_cast<std::int32_t>(engine() % 60));
    // Every other round without boundary; else whole planes at one end and single tiles.
    for (SweepTile& tile : tiles) {
      tile.boundary = round % 2 == 1 && (block_coord(tile.stack).x < -17 || engine() % 4 == 0);
    }
    for (const int threads : {1, 2, 3, 8}) check(tiles, 0, threads, engine);
  }
}

TEST(Sweep, FixesItOnAPeriodicAxis) {
  std::mt19937 engine(2);
  for (const std::int32_t period : {1, 2, 3, 5, 8}) {
    for (int round = 0; round < 20; ++round) check(even_tiles(period, 2), period, 3, engine);
  }
}

TEST(Sweep, IsNothingWithoutTiles) {
  const Sweep sweep = plan_sweep({}, 0, 3);
  SweepBoard board(sweep.interior, true);
  EXPECT_TRUE(board.all_taken());
  EXPECT_FALSE(board.take(2).has_value());
}

TEST(Sweep, UpdatesNodesSoonAfterTheyWereUsed) {
  const std::vector<SweepTile> tiles = even_tiles(7, 3);
  const Sweep sweep = plan_sweep(tiles, 0, 1);
  SweepBoard board(sweep.interior, true);
  std::vector<std::pair<Kind, std::uint32_t>> done;
  while (const auto work = board.take(0)) {
    done.emplace_back(work->kind, work->plane);
    board.finish(*work);
  }
  const std::vector<std::pair<Kind, std::uint32_t>> expected{
      {Kind::kPass, 0}, {Kind::kPass, 2},   {Kind::kPass, 1},   {Kind::kUpdate, 0}, {Kind::kUpdate, 1},
      {Kind::kPass, 4}, {Kind::kPass, 3},   {Kind::kUpdate, 2}, {Kind::kUpdate, 3}, {Kind::kPass, 6},
      {Kind::kPass, 5}, {Kind::kUpdate, 4}, {Kind::kUpdate, 5}, {Kind::kUpdate, 6}};
  EXPECT_EQ(done, expected);
}

TEST(Sweep, GivesEveryThreadAHomeOfItsOwn) {
  // Planes cost what their number of tiles says: 10 of 1, then 10 of 3.
  std::vector<SweepTile> tiles;
  for (std::int32_t x = 0; x < 20; ++x) tiles.push_back({block_key({x, 0, 0}), false, x < 10 ? 1.0 : 3.0});
  const auto homes = [&](int threads) { return plan_sweep(tiles, 0, threads).interior.homes; };
  EXPECT_EQ(homes(1), (std::vector<std::uint32_t>{0, 20}));
  // Half of the cost lies before plane 13.3, and a home begins with an even plane.
  EXPECT_EQ(homes(2), (std::vector<std::uint32_t>{0, 14, 20}));
  // More threads than planes: some have none of their own.
  const std::vector<std::uint32_t> many = homes(64);
  EXPECT_EQ(many.size(), 65U);
  EXPECT_TRUE(std::ranges::is_sorted(many));
  EXPECT_EQ(many.back(), 20U);
}

TEST(SweepBoard, LetsAThreadHelpFromTheOtherEnd) {
  const std::vector<SweepTile> tiles = even_tiles(12, 1);
  const Sweep sweep = plan_sweep(tiles, 0, 2);
  ASSERT_EQ(sweep.interior.homes, (std::vector<std::uint32_t>{0, 6, 12}));
  SweepBoard board(sweep.interior, false);
  // The second thread does all of its own. Then it takes what the first, which has not begun, would come to last.
  for (std::uint32_t n = 0; n < 6; ++n) {
    const auto work = board.take(1);
    ASSERT_TRUE(work.has_value());
    EXPECT_GE(work->plane, 6U);
    board.finish(*work);
  }
  EXPECT_EQ(board.take(1)->plane, 4U);
  EXPECT_EQ(board.take(0)->plane, 0U);
  EXPECT_EQ(board.take(1)->plane, 2U);
}

}  // namespace

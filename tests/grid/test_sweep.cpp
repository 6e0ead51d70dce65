// The order in which threads pass over the tiles: what fixes the sums on nodes that planes of blocks share.
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <random>
#include <thread>

#include "grid/sweep_board.hpp"
#include "grid/sweep_plan.hpp"

namespace {

using namespace breccia::grid;

struct Tiles {
  std::vector<BlockKey> keys;
  [[nodiscard]] std::int32_t plane(std::uint32_t tile) const { return block_coord(keys[tile]).x; }
};

// Planes of one to nine tiles from x = -20 on, a quarter of them empty.
Tiles random_tiles(std::mt19937& engine, std::int32_t planes) {
  Tiles tiles;
  for (std::int32_t x = -20; x < planes - 20; ++x) {
    if (engine() % 4 == 0) continue;
    const auto rows = static_cast<std::int32_t>(1 + engine() % 9);
    for (std::int32_t y = 0; y < rows; ++y) tiles.keys.push_back(block_key({x, y, 0}));
  }
  return tiles;
}

// [phase][task][plane]: planes that are certainly passed over before the task begins: those of the tasks it comes
// after, and what those came after themselves.
using Certain = std::vector<std::vector<std::vector<char>>>;

std::vector<char> planes_of_task(const Tiles& tiles, const Sweep& sweep, const SweepTask& task) {
  std::vector<char> planes(200, 0);
  for (const SweepStep& step : task.steps) {
    for (std::uint32_t n = step.first; !step.update && n < step.last; ++n) {
      planes[static_cast<std::size_t>(tiles.plane(sweep.order[n]) + 21)] = 1;
    }
  }
  return planes;
}

Certain what_is_certain(const Tiles& tiles, const Sweep& sweep) {
  Certain certain;
  for (std::size_t p = 0; p < sweep.interior.size(); ++p) {
    certain.emplace_back();
    for (const SweepTask& task : sweep.interior[p]) {
      std::vector<char> done(200, 0);
      for (std::size_t n = task.after_first; n < task.after_last; ++n) {
        const std::vector<char> own = planes_of_task(tiles, sweep, sweep.interior[p - 1].at(n));
        for (std::size_t x = 0; x < done.size(); ++x) done[x] = done[x] || own[x] || certain[p - 1][n][x];
      }
      certain.back().push_back(done);
    }
  }
  return certain;
}

// The planes of the tiles that are not of the boundary.
std::vector<char> interior_planes(const Tiles& tiles, const std::vector<char>& boundary) {
  std::vector<char> planes(200, 0);
  for (std::uint32_t t = 0; t < boundary.size(); ++t) {
    if (boundary[t] == 0) planes[static_cast<std::size_t>(tiles.plane(t) + 21)] = 1;
  }
  return planes;
}

// One sweep of the interior, and what must hold in it however threads are scheduled.
class InteriorCheck {
 public:
  InteriorCheck(const Tiles& tiles, const std::vector<char>& boundary, std::int32_t period, int threads)
      : tiles_(tiles),
        period_(period),
        sweep_(plan_sweep(tiles.keys, boundary, period, threads)),
        certain_(what_is_certain(tiles, sweep_)),
        exists_(interior_planes(tiles, boundary)),
        passes_(boundary.begin(), boundary.end()) {}

  void run() {
    for (std::size_t p = 0; p < sweep_.interior.size(); ++p) {
      for (std::size_t n = 0; n < sweep_.interior[p].size(); ++n) {
        std::vector<char> done = certain_[p][n];
        for (const SweepStep& step : sweep_.interior[p][n].steps) {
          for (std::uint32_t k = step.first; k < step.last; ++k) {
            step.update ? check_update(tiles_.plane(k), done) : check_pass(sweep_.order[k], done);
          }
          if (!step.update && step.first < step.last) done[place(tiles_.plane(sweep_.order[step.first]))] = 1;
        }
      }
    }
    for (const int count : passes_) EXPECT_EQ(count, 1);
  }

 private:
  static std::size_t place(std::int32_t plane) { return static_cast<std::size_t>(plane + 21); }
  [[nodiscard]] std::array<std::int32_t, 2> beside(std::int32_t x) const {
    if (period_ == 0) return {x - 1, x + 1};
    return {(x + period_ - 1) % period_, (x + 1) % period_};
  }

  // Of planes next to each other that of the lower turn must certainly be done first.
  void check_pass(std::uint32_t tile, const std::vector<char>& done) {
    const std::int32_t x = tiles_.plane(tile);
    ++passes_[tile];
    for (const std::int32_t near : beside(x)) {
      if (exists_[place(near)] == 0) continue;
      EXPECT_NE(sweep_turn(near, period_), sweep_turn(x, period_));
      const bool comes_first = sweep_turn(near, period_) < sweep_turn(x, period_);
      EXPECT_TRUE(!comes_first || done[place(near)]) << x << " before " << near;
    }
  }

  // Nobody may read or add to the nodes of a plane after their update.
  void check_update(std::int32_t x, const std::vector<char>& done) const {
    for (const std::int32_t near : {x - 1, x, x + 1}) EXPECT_TRUE(exists_[place(near)] == 0 || done[place(near)]);
  }

  const Tiles& tiles_;
  std::int32_t period_;
  Sweep sweep_;
  Certain certain_;
  std::vector<char> exists_;
  std::vector<int> passes_;
};

TEST(Sweep, FixesTheOrderOfSumsHoweverThreadsAreScheduled) {
  std::mt19937 engine(1);
  for (int round = 0; round < 200; ++round) {
    const Tiles tiles = random_tiles(engine, 1 + static_cast<std::int32_t>(engine() % 60));
    std::vector<char> boundary(tiles.keys.size(), 0);
    // Every other round without; else whole planes at one end and single tiles.
    for (std::uint32_t t = 0; round % 2 == 1 && t < boundary.size(); ++t) {
      boundary[t] = tiles.plane(t) < -17 || engine() % 4 == 0 ? 1 : 0;
    }
    for (const int threads : {1, 2, 3, 8}) InteriorCheck(tiles, boundary, 0, threads).run();
  }
}

TEST(Sweep, FixesItOnAPeriodicAxis) {
  for (const std::int32_t period : {5, 8}) {
    Tiles tiles;
    for (std::int32_t x = 0; x < period; ++x) tiles.keys.push_back(block_key({x, 0, 0}));
    InteriorCheck(tiles, std::vector<char>(tiles.keys.size(), 0), period, 2).run();
  }
}

TEST(Sweep, GivesEveryThreadSeveralTasks) {
  Tiles tiles;
  for (std::int32_t x = 0; x < 40; ++x) {
    for (std::int32_t y = 0; y < 10; ++y) tiles.keys.push_back(block_key({x, y, 0}));
  }
  const std::vector<char> boundary(tiles.keys.size(), 0);
  EXPECT_EQ(plan_sweep(tiles.keys, boundary, 0, 1).interior.at(0).size(), 1U);
  EXPECT_GE(plan_sweep(tiles.keys, boundary, 0, 2).interior.at(0).size(), 4U);
}

TEST(SweepBoard, HoldsATaskBackUntilThoseBeforeItAreDone) {
  const std::vector<SweepPhase> phases{SweepPhase(3), SweepPhase{{.steps = {}, .after_first = 1, .after_last = 3}}};
  SweepBoard board(phases);
  std::atomic<int> done{0};
  std::thread waiting([&] {
    board.wait_for_turn(1, phases[1][0]);
    EXPECT_EQ(done.load(), 2);
  });
  for (const std::size_t task : {1U, 2U}) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    ++done;
    board.finish(0, task);
  }
  waiting.join();
}

}  // namespace

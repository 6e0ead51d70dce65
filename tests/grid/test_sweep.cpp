// The order in which threads pass over the tiles: what fixes the sums on nodes that planes of blocks share.
#include <gtest/gtest.h>

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

// Planes next to each other: that of the lower turn must certainly be done first, however threads are scheduled.
void expect_fixed_order(const Tiles& tiles, const Sweep& sweep, std::int32_t period) {
  const Certain certain = what_is_certain(tiles, sweep);
  std::vector<char> exists(200, 0);
  for (const std::uint32_t t : sweep.order) exists[static_cast<std::size_t>(tiles.plane(t) + 21)] = 1;
  std::vector<int> passes(tiles.keys.size(), 0);
  for (std::size_t p = 0; p < sweep.interior.size(); ++p) {
    for (std::size_t n = 0; n < sweep.interior[p].size(); ++n) {
      std::vector<char> done = certain[p][n];
      for (const SweepStep& step : sweep.interior[p][n].steps) {
        if (step.update) {
          for (std::uint32_t t = step.first; t < step.last; ++t) {
            const auto x = static_cast<std::size_t>(tiles.plane(t) + 21);
            for (const std::size_t near : {x - 1, x, x + 1}) EXPECT_TRUE(!exists[near] || done[near]) << "update";
          }
          continue;
        }
        for (std::uint32_t k = step.first; k < step.last; ++k) {
          const std::int32_t x = tiles.plane(sweep.order[k]);
          ++passes[sweep.order[k]];
          for (const std::int32_t near : {x - 1, x + 1}) {
            const auto place = static_cast<std::size_t>(near + 21);
            if (!exists[place] || sweep_turn(near, period) >= sweep_turn(x, period)) continue;
            EXPECT_TRUE(done[place]) << "plane " << x << " before " << near;
          }
        }
        done[static_cast<std::size_t>(tiles.plane(sweep.order[step.first]) + 21)] = 1;
      }
    }
  }
  for (const int count : passes) EXPECT_EQ(count, 1);
}

TEST(Sweep, FixesTheOrderOfSumsHoweverThreadsAreScheduled) {
  std::mt19937 engine(1);
  for (int round = 0; round < 200; ++round) {
    const Tiles tiles = random_tiles(engine, 1 + static_cast<std::int32_t>(engine() % 60));
    const std::vector<char> boundary(tiles.keys.size(), 0);
    for (const int threads : {1, 2, 3, 8}) {
      expect_fixed_order(tiles, plan_sweep(tiles.keys, boundary, 0, threads), 0);
    }
  }
}

TEST(Sweep, FixesItOnAPeriodicAxis) {
  for (const std::int32_t period : {5, 8}) {
    Tiles tiles;
    for (std::int32_t x = 0; x < period; ++x) tiles.keys.push_back(block_key({x, 0, 0}));
    const std::vector<char> boundary(tiles.keys.size(), 0);
    expect_fixed_order(tiles, plan_sweep(tiles.keys, boundary, period, 2), period);
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

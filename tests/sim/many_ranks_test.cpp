// Many more ranks than the matter has planes of nodes: most own nothing, and the run is that of one rank, also where
// it goes on from the checkpoint of another number of ranks.
#include <gtest/gtest.h>

#include <filesystem>

#include "io/checkpoint.hpp"
#include "sim/run_state.hpp"
#include "sim/setup.hpp"
#include "tests/sim/collision.hpp"
#include "tests/sim/states.hpp"
#include "tests/support/shared_file.hpp"

namespace breccia::sim::test {
namespace {

constexpr std::uint64_t kCheckpoint = 8, kEnd = 16;

struct Ends {
  State start, end;
};

Ends run(TimeLoop& loop, const std::filesystem::path& checkpoint, const mpi::Comm& comm) {
  Ends ends;
  loop.run(
      [&](const TimeLoop& now) {
        if (ends.start.empty()) ends.start = gather(now.engine().observe(), comm);
        if (now.step() < kEnd) return true;
        ends.end = gather(now.engine().observe(), comm);
        return false;
      },
      [&](const TimeLoop& now) {
        if (now.step() != kCheckpoint || checkpoint.empty()) return true;
        RunState state;
        state.loop = now.state();
        io::write_checkpoint(checkpoint, {now.engine().save(), to_text(state)}, comm);
        return true;
      });
  return ends;
}

Ends start_anew(const Scene& scene, const std::filesystem::path& checkpoint, const mpi::Comm& comm) {
  TimeLoop loop(scene, resolve_effects(scene), 1, comm);
  return run(loop, checkpoint, comm);
}

Ends go_on(const Scene& scene, const std::filesystem::path& checkpoint, const mpi::Comm& comm) {
  const io::Checkpoint saved = io::read_checkpoint(checkpoint, comm);
  TimeLoop loop(scene, resolve_effects(scene), saved.engine, run_state_from(saved.run).loop, 1, comm);
  return run(loop, {}, comm);
}

// How far ranks lie apart between which a particle went.
int farthest_move(const Ends& ends) {
  int farthest = 0;
  for (std::size_t i = 0; i < ends.end.size(); ++i) {
    farthest = std::max(farthest, std::abs(ends.end[i].rank - ends.start[i].rank));
  }
  return farthest;
}

std::size_t busy_ranks(const State& state) {
  std::set<int> busy;
  for (const Sample& s : state) busy.insert(s.rank);
  return busy.size();
}

// What one rank finds, alone and from the checkpoint of all, against all, alone and from the checkpoint of one. Two
// spheres of four cells: some ten planes of nodes.
void expect_same(std::vector<std::string> overrides, double tolerance) {
  overrides.emplace_back("gravity.interval=8");
  const mpi::Comm comm;
  const mpi::Comm self(MPI_COMM_SELF);
  const breccia::test::SharedFile of_one("many_one", comm);
  const breccia::test::SharedFile of_all("many_all", comm);
  const Scene scene = load(collision(25e3), overrides);
  State root_alone;
  if (comm.is_root()) root_alone = start_anew(scene, of_one.path(), self).end;
  const State one = comm.allgather_arrays(std::span<const Sample>(root_alone));
  const Scale scale{200e3, 200.0};
  const Ends all = start_anew(scene, of_all.path(), comm);
  expect_equal(all.end, one, scale, tolerance);
  expect_equal(go_on(scene, of_one.path(), comm).end, one, scale, tolerance);
  if (comm.is_root()) expect_equal(go_on(scene, of_all.path(), self).end, one, scale, tolerance);
  EXPECT_LE(busy_ranks(all.start), 16U);
  EXPECT_GE(busy_ranks(all.start), std::min<std::size_t>(3, static_cast<std::size_t>(comm.size())));
}

// Rounding, as in ranks_test.cpp.
TEST(ManyRanks, DirectSum) { expect_same({"effects.gravity=direct"}, 1e-12); }

// Trees and meshes of other ranks' particles differ within their error: 2e-5 of 0.01 m/s2 over 40 s are 1e-5 m/s, 5e-8
// of the speeds, and 3e-4 m; where that makes pressure, waves cover the way in 10 s: 1e-9 of the bulk modulus.
TEST(ManyRanks, Tree) { expect_same({"effects.gravity=tree"}, 1e-7); }
TEST(ManyRanks, TreePm) { expect_same({"effects.gravity=treepm"}, 1e-7); }

// A body flies through a place where all cuts lie: particles go from the first rank to the last at one sorting, past
// ranks that own nothing.
TEST(ManyRanks, PastRanksThatOwnNothing) {
  const mpi::Comm comm;
  const Scene scene = load(scene_of(1e3, 0.05) + R"([[body]]
shape = "sphere"
radius = "4 km"
velocity = ["2 km/s", 0, 0]
[effects]
gravity = "off"
[parallel]
axis = "x"
[numerics]
precision = "double"
)");
  const auto fly = [&](const mpi::Comm& ranks, const std::vector<std::int32_t>& cuts) {
    const auto engine = make_loaded_engine(scene, resolve_effects(scene), 1, ranks);
    const double dt = *scene.time.step;
    Ends ends;
    for (int n = 0; n < 48; ++n) {
      if (n % 4 == 0) {
        engine->sort();
        if (n == 4) engine->cut(mpi::Slabs(0, cuts));
        engine->scatter(0.5 * dt);
      }
      engine->update_grid(dt);
      if (n == 8) ends.start = gather(engine->observe(), ranks);
      if (n % 4 == 3) {
        engine->gather(dt);
      } else {
        engine->gather_scatter(dt);
      }
    }
    engine->sort();
    engine->scatter(0.5 * dt);
    engine->update_grid(dt);
    ends.end = gather(engine->observe(), ranks);
    return ends;
  };
  State root_alone;
  if (comm.is_root()) root_alone = fly(mpi::Comm(MPI_COMM_SELF), {}).end;
  const State one = comm.allgather_arrays(std::span<const Sample>(root_alone));
  const Ends all = fly(comm, std::vector<std::int32_t>(static_cast<std::size_t>(comm.size()) - 1, 4));
  expect_equal(all.end, one, {8e3, 2000.0});
  EXPECT_EQ(busy_ranks(all.start), std::min<std::size_t>(2, static_cast<std::size_t>(comm.size())));
  EXPECT_EQ(farthest_move(all), comm.size() - 1);
  EXPECT_EQ(busy_ranks(all.end), std::min<std::size_t>(2, static_cast<std::size_t>(comm.size())));
}

}  // namespace
}  // namespace breccia::sim::test

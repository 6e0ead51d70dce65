// How often the host waits for the device in a run as the time loop makes it: not in a step, but for once in one of
// several ranks where MPI's messages cannot be left for later, and so many times where particles are sorted and a
// window begins.
#include <algorithm>

#include "breccia/error.hpp"
#include "sim/time_loop.hpp"
#include "tests/cuda/engine_cases.hpp"
#include "tests/cuda/variable.hpp"

namespace breccia::cuda {
namespace {

constexpr std::uint64_t kWindow = 8;  // steps
constexpr std::uint64_t kWindows = 4;

struct Counts {
  std::uint64_t waits = 0, allocations = 0;
};

std::unique_ptr<Engine> device_maker(const EngineSetup& setup, const mpi::Comm& comm) {
  return make_cuda_engine(setup, comm);
}

// Of each step: with the last of a window, what is between two windows.
std::vector<Counts> counts_of_steps(const mpi::Comm& comm) {
  Scene scene = small_impact(Precision::kMixed);
  scene.gravity.interval = static_cast<int>(kWindow);
  const sim::ResolvedEffects effects{.material = kRock, .decisions = {}};
  sim::TimeLoop loop(scene, effects, 1, comm, &device_maker);
  std::vector<Counts> steps;
  Counts before;
  loop.run([&](const sim::TimeLoop& l) {
    const Counts now{cuda_emulation::synchronisation_count(), cuda_emulation::allocation_count()};
    if (l.step() > 0) steps.push_back({now.waits - before.waits, now.allocations - before.allocations});
    before = now;
    return l.step() < kWindow * kWindows;
  });
  return steps;
}

// From the second window on: the first one makes the graph and the arrays. These grow at some sortings, and nowhere
// else. Of the rank that waits most: one with an empty list has nothing to upload.
void expect_waits(std::uint64_t in_a_step, std::uint64_t between_windows, const mpi::Comm& comm) {
  const std::vector<Counts> steps = counts_of_steps(comm);
  ASSERT_EQ(steps.size(), kWindow * kWindows);
  std::uint64_t fewest = steps.back().allocations;
  for (std::size_t n = kWindow; n < steps.size(); ++n) {
    const bool last = (n + 1) % kWindow == 0;
    EXPECT_EQ(comm.max(steps[n].waits), last ? between_windows : in_a_step) << "step " << n + 1;
    if (last) {
      fewest = std::min(fewest, steps[n].allocations);
    } else {
      EXPECT_EQ(steps[n].allocations, 0U) << "step " << n + 1;
    }
  }
  EXPECT_EQ(fewest, 0U);
}

// One rank: for the sums of the passes, twice for strays, for unbroken particles, the time step and four
// counts of the sorting.
TEST(Waits, OfOneRank) {
  const mpi::Comm world;
  if (world.size() == 1) expect_waits(0, 9, world);
}

// Several, of which no particle goes to another one: these, for the places of all particles, their blocks twice, the
// blocks of the grid and seven lists of what is shared; and for the messages of a window's steps, of which the host
// finds none there before, as streams are late.
TEST(Waits, OfSeveralRanksByEitherWayOfMpi) {
  const mpi::Comm world;
  if (world.size() == 1) return;
  for (const char* direct : {"0", "1"}) {
    const Variable way("BRECCIA_CUDA_AWARE_MPI", direct);
    expect_waits(0, 20 + kWindow, world);
  }
}

// Where a stream cannot wait for the host, or does not see what MPI has put into memory of the device, or is not to.
TEST(Waits, OfSeveralRanksThatWaitForMessages) {
  const mpi::Comm world;
  if (world.size() == 1) return;
  const auto expect_one = [&] { expect_waits(1, 20 + 1, world); };
  {
    const Variable driver("BRECCIA_EMULATED_DRIVER", "old");
    expect_one();
  }
  {
    const Variable way("BRECCIA_CUDA_AWARE_MPI", "1");
    const Variable ordering("BRECCIA_EMULATED_WRITES_ORDERING", "0");
    expect_one();
  }
  const Variable wanted("BRECCIA_MPI_AHEAD", "0");
  expect_one();
}

// An exception between two steps unwinds the run: gravity, which works on the same device, and the engine.
TEST(Waits, RunCanBeLeftInTheMidstOfAWindow) {
  const mpi::Comm world;
  const std::size_t memory = cuda_emulation::used_bytes();
  Scene scene = small_impact(Precision::kMixed);
  scene.gravity.interval = static_cast<int>(kWindow);
  const sim::ResolvedEffects effects{
      .material = kRock, .gravity = true, .gravity_method = GravityMethod::kDirect, .decisions = {}};
  const auto run = [&] {
    sim::TimeLoop loop(scene, effects, 1, world, &device_maker);
    loop.run([&](const sim::TimeLoop& l) {
      if (l.step() == kWindow / 2) throw UsageError("enough");
      return true;
    });
  };
  EXPECT_THROW(run(), UsageError);
  EXPECT_EQ(cuda_emulation::used_bytes(), memory);
  world.barrier();
}

}  // namespace
}  // namespace breccia::cuda

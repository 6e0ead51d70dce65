// Steps that are enqueued before MPI has brought what they need: the same numbers whenever it comes, whatever the host
// asks for meanwhile, and a device that can be left in the midst of them.
#include <functional>
#include <optional>

#include "cuda/mpi_messages.hpp"
#include "tests/cuda/engine_cases.hpp"
#include "tests/cuda/variable.hpp"

namespace breccia::cuda {
namespace {

class MpiAhead : public testing::Test {
 protected:
  void SetUp() override { cuda_emulation::set_order(Order::kForward); }

  [[nodiscard]] std::unique_ptr<Engine> engine() const {
    const Scene scene = small_impact(Precision::kMixed);
    auto made = make_cuda_engine(setup_for(scene), world_);
    fill(*made, scene, world_);
    made->scatter(0.5 * kStep);
    return made;
  }
  // Without a sorting: the particles move 0.05 cells in so many steps.
  static void step(Engine& engine, int steps) {
    for (int n = 0; n < steps; ++n) {
      engine.update_grid(kStep);
      engine.gather_scatter(kStep);
    }
    engine.update_grid(kStep);
  }
  const mpi::Comm world_;
};

std::uint64_t waits() { return cuda_emulation::synchronisation_count(); }

void expect_same(const ParticleOutput& a, const ParticleOutput& b) {
  ASSERT_EQ(a.id, b.id);
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a.position[i].x, b.position[i].x);
    EXPECT_EQ(a.velocity[i].y, b.velocity[i].y);
    EXPECT_EQ(a.pressure[i], b.pressure[i]);
  }
}

// A stream takes so many pieces of work and no more: from then on the host waits for the oldest messages. It finds
// those that are there if streams are not late.
TEST_F(MpiAhead, NoFurtherThanAStreamBears) {
  constexpr int kMost = 32;
  const auto ahead = engine();
  std::uint64_t before = waits();
  step(*ahead, kMost - 2);
  EXPECT_EQ(waits() - before, 0U);
  before = waits();
  ahead->gather_scatter(kStep);
  step(*ahead, 9);
  EXPECT_EQ(waits() - before, 10U);
  const ParticleOutput by_steps_ahead = ahead->observe();

  const Variable none("BRECCIA_MPI_AHEAD", "0");
  const auto behind = engine();
  before = waits();
  step(*behind, kMost - 2);
  EXPECT_EQ(waits() - before, kMost - 1U);
  behind->gather_scatter(kStep);
  step(*behind, 9);
  expect_same(by_steps_ahead, behind->observe());
}

// Each brings in what is under way before it waits for the device; else the emulation would say so.
TEST_F(MpiAhead, WhateverTheHostAsksForMeanwhile) {
  constexpr int kSteps = 3;
  const auto asked = engine();
  const std::function<void()> questions[] = {
      [&] { (void)asked->observe(); },        [&] { (void)asked->inspect(); },
      [&] { (void)asked->passes(); },         [&] { (void)asked->strayed(); },
      [&] { (void)asked->fastest(); },        [&] { (void)asked->volume_ratios(); },
      [&] { (void)asked->elastic_energy(); }, [&] { (void)asked->work_beyond_period(); },
  };
  for (const auto& question : questions) {
    step(*asked, kSteps - 1);
    question();
    asked->gather_scatter(kStep);
  }
  step(*asked, 0);
  const auto sort = [](Engine& sorted) {
    sorted.gather(kStep);
    (void)sorted.signal_speeds();
    sorted.sort();
    sorted.scatter(0.5 * kStep);
    step(sorted, 0);
  };
  sort(*asked);
  const ParticleOutput answered = asked->observe();
  const auto none = engine();
  step(*none, kSteps * static_cast<int>(std::size(questions)));
  sort(*none);
  expect_same(answered, none->observe());
}

// An exception unwinds what works on the device beside the engine first, then the engine.
TEST_F(MpiAhead, EngineCanBeLeftInTheMidstOfSteps) {
  const std::size_t memory = cuda_emulation::used_bytes();
  {
    const auto left = engine();
    const DeviceArray<int> other(5);
    step(*left, 3);
    left->abandon();
  }
  step(*engine(), 3);
  EXPECT_EQ(cuda_emulation::used_bytes(), memory);
  world_.barrier();
}

// One rank has its messages under way, its neighbour never comes to its own. MPI may still read what it was given, and
// what comes later goes to whom it is for.
TEST_F(MpiAhead, RankThatFailsLeavesAlone) {
  MPI_Comm handle = MPI_COMM_NULL;
  MPI_Comm_dup(world_.handle(), &handle);
  const mpi::Comm own(handle);
  constexpr std::size_t kBytes = 1 << 20;  // more than MPI takes along before the other side asks
  constexpr int kTag = 2;                  // as of all these messages
  const Stream stream;
  DeviceArray<std::byte> sent(kBytes), received(kBytes);
  sent.fill_bytes(7, stream);
  {
    MpiMessages messages(false, true, kBytes, own);
    if (own.rank() < 2) messages.set({{1 - own.rank(), 1}}, sent.data(), received.data());
    if (own.rank() == 0) {
      messages.start(stream);
      check(cudaStreamSynchronize(stream), "packed");
      messages.finish(stream);
      EXPECT_EQ(cudaStreamQuery(stream), cudaErrorNotReady);
    }
  }
  EXPECT_EQ(cudaStreamSynchronize(stream), cudaSuccess);
  std::vector<std::byte> came(kBytes);
  if (own.rank() == 1) {
    MPI_Recv(came.data(), kBytes, MPI_BYTE, 0, kTag, handle, MPI_STATUS_IGNORE);
    EXPECT_EQ(came, std::vector<std::byte>(kBytes, std::byte{7}));
    MPI_Send(came.data(), kBytes, MPI_BYTE, 0, kTag, handle);
  } else if (own.rank() == 0) {
    MPI_Recv(came.data(), kBytes, MPI_BYTE, 1, kTag, handle, MPI_STATUS_IGNORE);
    EXPECT_EQ(came.back(), std::byte{7});
  }
  MPI_Comm_free(&handle);
}

TEST_F(MpiAhead, AllRanksOrNone) {
  const auto way = [&] { return choose_messages(DeviceMessages::kMpi, world_); };
  EXPECT_TRUE(way().ahead);
  EXPECT_EQ(way().description, "MPI, by way of pinned host memory");
  std::optional<Variable> driver;
  if (world_.rank() == 1) driver.emplace("BRECCIA_EMULATED_DRIVER", "old");
  EXPECT_FALSE(way().ahead);
  EXPECT_EQ(way().description, "MPI, by way of pinned host memory, waited for in every step");
}

// Memory of a device that MPI has not seen yet is waited for once.
TEST_F(MpiAhead, NewMemoryIsSentBeforeTheHostGoesOn) {
  constexpr std::size_t kBytes = 64;
  Stream stream;
  DeviceArray<std::byte> sent(2 * kBytes), received(kBytes);
  MpiMessages messages(true, true, kBytes, world_);
  const int peer = world_.rank() ^ 1;
  if (peer >= world_.size()) {
    for (int n = 0; n < 3; ++n) messages.set({}, sent.data(), received.data());
    return;
  }
  const auto waits_of_step = [&] {
    const std::uint64_t before = waits();
    messages.start(stream);
    messages.finish(stream);
    return waits() - before;
  };
  // At first, not where all is as it was, and where the other rank's is another one.
  struct Setting {
    std::size_t place_on_first;
    std::uint64_t waits;
  };
  for (const auto [place, expected] : {Setting{0, 1}, Setting{0, 0}, Setting{kBytes, 1}}) {
    messages.set({{peer, 1}}, sent.data() + (world_.rank() == 0 ? place : 0), received.data());
    EXPECT_EQ(waits_of_step(), expected);
    EXPECT_EQ(waits_of_step(), 0U);
    messages.bring_in();
  }
  check(cudaStreamSynchronize(stream), "end");
}

}  // namespace
}  // namespace breccia::cuda

// Steps that are enqueued before MPI has brought what they need: the same numbers whenever it comes, whatever the host
// asks for meanwhile, and a device that can be left in the midst of them.
#include <functional>
#include <optional>
#include <utility>

#include "breccia/error.hpp"
#include "cuda/mpi_messages.hpp"
#include "tests/cuda/engine_cases.hpp"
#include "tests/cuda/variable.hpp"

namespace {

// As where MPI's own copies are in a queue of the device behind a stream that waits.
bool mpi_waits_for_streams = false;

}  // namespace

// In place of MPI's function, for the whole program.
extern "C" int MPI_Testall(int count, MPI_Request requests[], int* flag, MPI_Status statuses[]) {
  if (!mpi_waits_for_streams || !breccia::cuda_emulation::host_is_awaited())
    return PMPI_Testall(count, requests, flag, statuses);
  *flag = 0;
  int found = 0;  // to ask brings on what others exchange
  return PMPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_WORLD, &found, MPI_STATUS_IGNORE);
}

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
  // Without a sorting: in 80 steps particles move by less than half a cell.
  static void step(Engine& engine, int steps) {
    for (int n = 0; n < steps; ++n) {
      engine.update_grid(kStep);
      engine.gather_scatter(kStep);
    }
    engine.update_grid(kStep);
  }
  static ParticleOutput after_sorting(Engine& engine) {
    engine.gather(kStep);
    (void)engine.signal_speeds();
    engine.sort();
    engine.scatter(0.5 * kStep);
    step(engine, 0);
    return engine.observe();
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

// A stream takes so many pieces of work and no more: from then on the host waits for the oldest messages. A window of
// 32 steps stays below.
TEST_F(MpiAhead, NoFurtherThanAStreamBears) {
  constexpr int kMost = 48, kMore = 80;
  const auto ahead = engine();
  std::uint64_t before = waits();
  step(*ahead, kMost - 2);
  EXPECT_EQ(waits() - before, 0U);
  before = waits();
  ahead->gather_scatter(kStep);
  step(*ahead, kMore - kMost);
  EXPECT_EQ(waits() - before, kMore - kMost + 1U);
  const ParticleOutput by_steps_ahead = ahead->observe();

  const Variable none("BRECCIA_MPI_AHEAD", "0");
  const auto behind = engine();
  before = waits();
  step(*behind, kMore - 1);
  EXPECT_EQ(waits() - before, kMore);
  expect_same(by_steps_ahead, behind->observe());
}

// Each brings in what is under way before it waits for the device; else the emulation would say so.
TEST_F(MpiAhead, WhateverTheHostAsksForMeanwhile) {
  constexpr int kSteps = 24;
  const auto after_questions = [&] {
    const auto asked = engine();
    const std::function<void()> questions[] = {
        [&] { (void)asked->observe(); },        [&] { (void)asked->inspect(); },
        [&] { (void)asked->passes(); },         [&] { (void)asked->strayed(); },
        [&] { (void)asked->fastest(); },        [&] { (void)asked->volume_ratios(); },
        [&] { (void)asked->elastic_energy(); }, [&] { (void)asked->work_beyond_period(); },
    };
    for (const auto& question : questions) {
      step(*asked, kSteps / static_cast<int>(std::size(questions)) - 1);
      question();
      asked->gather_scatter(kStep);
    }
    step(*asked, 0);
    return after_sorting(*asked);
  };
  const auto none = engine();
  step(*none, kSteps);
  const ParticleOutput expected = after_sorting(*none);
  expect_same(after_questions(), expected);
  // Messages that the host finds there when it comes by, or some of them.
  cuda_emulation::set_order(Order::kRandom, 5);
  expect_same(after_questions(), expected);
}

TEST_F(MpiAhead, EngineCanBeLeftInTheMidstOfSteps) {
  const std::size_t memory = cuda_emulation::used_bytes();
  step(*engine(), 3);
  {
    const auto left = engine();
    const DeviceArray<int> other(5);  // freed before the engine's
    step(*left, 3);
    left->abandon();
  }
  const auto fail = [&] {
    const auto left = engine();
    step(*left, 3);
    throw UsageError("enough");
  };
  EXPECT_THROW(fail(), UsageError);
  EXPECT_EQ(cuda_emulation::used_bytes(), memory);
}

// Else the next engine would take a message of this one for its own.
TEST_F(MpiAhead, EndBringsInWhatIsUnderWay) {
  constexpr std::size_t kBytes = 64;
  const int peer = world_.rank() ^ 1;
  if (peer >= world_.size()) return;
  const Stream stream;
  DeviceArray<std::byte> sent(kBytes), received(kBytes);
  sent.fill_bytes(world_.rank(), stream);
  {
    MpiMessages messages(false, true, kBytes, world_);
    messages.set({{peer, 1}}, sent.data(), received.data());
    messages.start(stream);
    if (world_.rank() == 0) check(cudaStreamSynchronize(stream), "packed");  // the other one finds nothing to send yet
    messages.finish(stream);
  }
  EXPECT_EQ(received.download(1, stream)[0], static_cast<std::byte>(peer));
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
  check(cudaStreamSynchronize(stream), "filled");
  const auto fail = [&] {
    MpiMessages messages(false, true, kBytes, own);
    if (own.rank() < 2) messages.set({{1 - own.rank(), 1}}, sent.data(), received.data());
    if (own.rank() == 0) {
      messages.start(stream);
      check(cudaStreamSynchronize(stream), "packed");
      messages.finish(stream);
      EXPECT_EQ(cudaStreamQuery(stream), cudaErrorNotReady);
    }
    throw UsageError("alone");
  };
  EXPECT_THROW(fail(), UsageError);
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
  const std::pair<const char*, const char*> reasons[] = {{"BRECCIA_EMULATED_DRIVER", "old"},
                                                         {"BRECCIA_EMULATED_DRIVER", "hasty"},
                                                         {"BRECCIA_EMULATED_DRIVER", "serial"},
                                                         {"CUDA_LAUNCH_BLOCKING", "1"}};
  for (const auto& [variable, value] : reasons) {
    std::optional<Variable> of_one_rank;
    if (world_.rank() == 1) of_one_rank.emplace(variable, value);
    EXPECT_FALSE(way().ahead) << value;
    EXPECT_EQ(way().description, "MPI, by way of pinned host memory, waited for in every step");
  }
  EXPECT_TRUE(way().ahead);
}

// From device to device only where all can, and ahead only where MPI's own copies do not wait for a stream that waits.
TEST_F(MpiAhead, MessagesOfDevicesAreTriedBesideAWait) {
  const auto way = [&] { return choose_messages(DeviceMessages::kMpi, world_); };
  {
    std::optional<Variable> of_one_rank;
    if (world_.rank() == 1) of_one_rank.emplace("BRECCIA_CUDA_AWARE_MPI", "1");
    EXPECT_EQ(way().description, "MPI, by way of pinned host memory");
  }
  const Variable aware("BRECCIA_CUDA_AWARE_MPI", "1");
  EXPECT_TRUE(way().ahead);
  mpi_waits_for_streams = world_.rank() == 1;
  EXPECT_EQ(way().description, "MPI, from device to device, waited for in every step");
  mpi_waits_for_streams = false;
}

// What a CUDA-aware MPI does when it first sends from an array may need the device: after every set() it has time to.
TEST_F(MpiAhead, FirstMessageOfAnArrayIsWaitedFor) {
  constexpr std::size_t kBytes = 64;
  const Stream stream;
  const DeviceArray<std::byte> sent(kBytes), received(kBytes);
  MpiMessages messages(true, true, kBytes, world_);
  const int peer = world_.rank() ^ 1;
  const auto waits_of_step = [&] {
    const std::uint64_t before = waits();
    messages.start(stream);
    messages.finish(stream);
    return waits() - before;
  };
  for (const int times : {1, 2}) {
    for (int n = 0; n < times; ++n) {
      messages.set({{peer, peer < world_.size() ? 1U : 0U}}, sent.data(), const_cast<std::byte*>(received.data()));
    }
    if (peer >= world_.size()) continue;
    EXPECT_EQ(waits_of_step(), 1U);
    EXPECT_EQ(waits_of_step(), 0U);
    messages.bring_in();
  }
  check(cudaStreamSynchronize(stream), "end");
}

}  // namespace
}  // namespace breccia::cuda

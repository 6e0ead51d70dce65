// Sums of shared blocks by NCCL, here by its stand-in (nccl_stand_in.cpp): the same bits as by MPI, no wait of the host
// in a window, and an error for all that is missing, or goes wrong on the way.
#include <optional>

#include "breccia/error.hpp"
#include "cuda/nccl_messages.hpp"
#include "tests/cuda/engine_cases.hpp"
#include "tests/cuda/variable.hpp"

namespace breccia::cuda {
namespace {

class Nccl : public testing::Test {
 protected:
  void SetUp() override {
    cuda_emulation::set_order(Order::kForward);
    (void)cudaSetDevice(world_.rank());
  }
  void TearDown() override { (void)cudaSetDevice(0); }

  // The error that all ranks must end with, with this text.
  template <class E, class Stage>
  void expect_error(const std::string& text, Stage&& stage) const {
    std::string error;
    try {
      stage();
    } catch (const E& e) {
      error = e.what();
    }
    EXPECT_NE(error.find(text), std::string::npos) << "rank " << world_.rank() << ": " << error;
  }

  const mpi::Comm world_;
  const Variable library_{nccl::kFileVariable, BRECCIA_NCCL_STAND_IN};
};

class NcclEngine : public Nccl {
 protected:
  // Both bodies cross the planes between ranks, which lie across x.
  static Scene drifting(Precision precision) {
    Scene scene = small_impact(precision);
    for (BodyParameters& body : scene.bodies) body.velocity.x += 600.0;
    return scene;
  }
  [[nodiscard]] std::unique_ptr<Engine> engine_for(const Scene& scene, DeviceMessages messages) const {
    EngineSetup setup = setup_for(scene);
    setup.device_messages = messages;
    auto engine = make_cuda_engine(setup, world_);
    fill(*engine, scene, world_);
    return engine;
  }
  [[nodiscard]] EngineState state_after(const Scene& scene, DeviceMessages messages) const {
    const auto engine = engine_for(scene, messages);
    advance(*engine, 12, kStep);
    engine->gather(kStep);
    engine->sort();
    return engine->save();
  }
};
class NcclPrecisions : public NcclEngine, public testing::WithParamInterface<Precision> {};

TEST_P(NcclPrecisions, GivesTheBitsOfMpi) {
  const Scene scene = drifting(GetParam());
  const EngineState by_mpi = state_after(scene, DeviceMessages::kMpi);
  // Streams as late as waits and events allow, then whenever they may.
  for (const Order order : {Order::kForward, Order::kRandom}) {
    cuda_emulation::set_order(order, 5);
    const EngineState by_nccl = state_after(scene, DeviceMessages::kNccl);
    EXPECT_EQ(by_nccl.node, by_mpi.node);
    ASSERT_EQ(by_nccl.columns.size(), by_mpi.columns.size());
    for (std::size_t c = 0; c < by_mpi.columns.size(); ++c) {
      EXPECT_EQ(by_nccl.columns[c].values, by_mpi.columns[c].values) << by_mpi.columns[c].name;
    }
  }
}

// Five launches, and no wait, asking a stream for its end included.
TEST_P(NcclPrecisions, StepNeverWaits) {
  const auto engine = engine_for(small_impact(GetParam()), DeviceMessages::kNccl);
  engine->scatter(0.5 * kStep);
  engine->update_grid(kStep);
  ASSERT_GT(engine->stats().halo_bytes_per_step, 0U);
  const std::uint64_t launches = cuda_emulation::launch_count();
  const std::uint64_t waits = cuda_emulation::synchronisation_count();
  for (int n = 0; n < 5; ++n) {
    engine->gather_scatter(kStep);
    engine->update_grid(kStep);
  }
  EXPECT_LE(cuda_emulation::launch_count() - launches, 25U);
  EXPECT_EQ(cuda_emulation::synchronisation_count() - waits, 0U);
  EXPECT_FALSE(engine->passes().fault);
}

// Told where the host waits for the window's end, on every rank: on the one that misses the message, and on the others
// because that one goes no further.
TEST_F(NcclEngine, LostOrShortMessageEndsTheWindow) {
  const Variable patience("BRECCIA_NCCL_PATIENCE", "0.3");
  for (const char* fault : {"lost", "short"}) {
    const Variable planted("BRECCIA_NCCL_FAULT", fault);
    expect_error<IoError>("NCCL: messages between ranks: ", [&] {
      const auto engine = engine_for(small_impact(Precision::kMixed), DeviceMessages::kNccl);
      engine->scatter(0.5 * kStep);
      for (int n = 0; n < 6; ++n) {
        engine->update_grid(kStep);
        engine->gather_scatter(kStep);
      }
      (void)engine->passes();
    });
    world_.barrier();
  }
}

INSTANTIATE_TEST_SUITE_P(Precisions, NcclPrecisions, testing::Values(Precision::kMixed, Precision::kDouble),
                         [](const auto& p) { return p.param == Precision::kMixed ? "mixed" : "double"; });

TEST_F(Nccl, IsTakenWhereItCanBe) {
  for (const DeviceMessages wanted : {DeviceMessages::kNccl, DeviceMessages::kAuto}) {
    const MessageChoice choice = choose_messages(wanted, world_);
    EXPECT_EQ(choice.way, MessageWay::kNccl);
    EXPECT_EQ(choice.description, "NCCL 2.28.9");
  }
  EXPECT_EQ(choose_messages(DeviceMessages::kMpi, world_).description, "MPI, by way of pinned host memory");
  const Variable aware("BRECCIA_CUDA_AWARE_MPI", "1");
  EXPECT_EQ(choose_messages(DeviceMessages::kMpi, world_).description, "MPI, from device to device");
}

// On one rank there is nothing to send, and nothing that has to be there.
TEST_F(Nccl, OneRankNeedsNoLibrary) {
  const Variable none(nccl::kFileVariable, "/nowhere/libnccl.so.2");
  EXPECT_EQ(choose_messages(DeviceMessages::kNccl, self()).description, "");
}

class NcclMissing : public Nccl {
 protected:
  void expect_refused(const std::string& reason) const {
    expect_error<UsageError>("parallel.device_messages = \"nccl\": " + reason,
                             [&] { choose_messages(DeviceMessages::kNccl, world_); });
    const MessageChoice choice = choose_messages(DeviceMessages::kAuto, world_);
    EXPECT_EQ(choice.way, MessageWay::kPinnedMpi);
    EXPECT_EQ(choice.description.find("MPI, by way of pinned host memory (no NCCL: " + reason), 0U)
        << choice.description;
  }
};

TEST_F(NcclMissing, WithoutTheLibraryOnARank) {
  std::optional<Variable> none;
  if (world_.rank() == 1) none.emplace(nccl::kFileVariable, "/nowhere/libnccl.so.2");
  expect_refused("/nowhere/libnccl.so.2: cannot open");
}

TEST_F(NcclMissing, WhereTheLibraryIsAnotherOne) {
  const Variable other(nccl::kFileVariable, "libm.so.6");
  expect_refused("libm.so.6 has no ncclGetErrorString");
}

TEST_F(NcclMissing, WhereTheLibraryIsTooOld) {
  const Variable old("BRECCIA_NCCL_FAULT", "old");
  expect_refused(std::string(BRECCIA_NCCL_STAND_IN) + " is NCCL 2.6.4, which has no messages between two ranks");
}

TEST_F(NcclMissing, WhereRanksShareADevice) {
  (void)cudaSetDevice(0);
  expect_refused("up to " + std::to_string(world_.size()) + " ranks share a CUDA device");
}

TEST_F(Nccl, FirstMessageMustComeAsItWasSent) {
  const Variable wrong("BRECCIA_NCCL_FAULT", "wrong");
  expect_error<IoError>("the first message of rank 1 to rank ",
                        [&] { NcclMessages(nccl::load(), sizeof(double), world_); });
}

// An exception on one rank does not wait for the others, who know nothing of it yet.
TEST_F(Nccl, RankThatFailsLeavesAlone) {
  const Variable patience("BRECCIA_NCCL_PATIENCE", "1");
  const Variable planted("BRECCIA_NCCL_FAULT", "deserted");
  expect_error<UsageError>("alone", [&] {
    const NcclMessages messages(nccl::load(), sizeof(double), world_);
    if (world_.rank() > 0) world_.barrier();
    throw UsageError("alone");
  });
  if (world_.rank() == 0) world_.barrier();
}

TEST_F(Nccl, RanksMustAgreeOnWhatTheyShare) {
  NcclMessages messages(nccl::load(), sizeof(double), world_);
  std::vector<HaloPart> parts;
  if (world_.rank() < 2) parts.push_back({1 - world_.rank(), static_cast<std::size_t>(2 + world_.rank())});
  expect_error<NumericsError>("rank 0 shares 2 blocks with rank 1, which shares 3 with it",
                              [&] { messages.set(parts, nullptr, nullptr); });
}

}  // namespace
}  // namespace breccia::cuda

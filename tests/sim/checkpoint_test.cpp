// A run that goes on from a checkpoint file is the run that was not interrupted (physics.md 8, case 19).
#include "io/checkpoint.hpp"

#include <gtest/gtest.h>
#include <hdf5.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>

#include "breccia/error.hpp"
#include "io/checksum.hpp"
#include "sim/checkpoints.hpp"
#include "tests/sim/collision.hpp"
#include "tests/support/shared_file.hpp"

namespace breccia::sim::test {
namespace {

constexpr std::uint64_t kCheckpoint = 24, kEnd = 150;

// What is compared of a particle.
struct Sample {
  std::uint64_t id;
  Vec3d position, velocity;
  double damage, density, pressure, energy;
};

std::vector<Sample> samples(const ParticleOutput& p, const mpi::Comm& comm) {
  std::vector<Sample> mine;
  for (std::size_t i = 0; i < p.size(); ++i) {
    mine.push_back({p.id[i], p.position[i], p.velocity[i], p.damage[i], p.density[i], p.pressure[i],
                    p.internal_energy.empty() ? 0.0 : p.internal_energy[i]});
  }
  std::vector<Sample> all = comm.allgather_arrays(std::span<const Sample>(mine));
  std::sort(all.begin(), all.end(), [](const Sample& a, const Sample& b) { return a.id < b.id; });
  return all;
}

struct Outcome {
  std::vector<Sample> end;
  LoopState at_checkpoint;
  LostWork lost;
  BalanceState balance;
  double damage_at_checkpoint = 0.0;
};

TimeLoop::Visit until_end(Outcome& run, const mpi::Comm& comm) {
  return [&run, &comm](const TimeLoop& loop) {
    if (loop.step() == kCheckpoint) {
      const std::vector<Sample> now = samples(loop.engine().observe(), comm);
      for (const Sample& s : now) run.damage_at_checkpoint += s.damage / static_cast<double>(now.size());
    }
    if (loop.step() < kEnd) return true;
    run.end = samples(loop.engine().observe(), comm);
    run.lost = loop.lost_work();
    run.balance = loop.balance();
    return false;
  };
}

Outcome run_through(const Scene& scene, const std::filesystem::path& file, const mpi::Comm& comm, int threads = 1) {
  Outcome run;
  TimeLoop loop(scene, resolve_effects(scene), threads, comm);
  loop.run(until_end(run, comm), [&](const TimeLoop& now) {
    if (now.step() != kCheckpoint) return true;
    run.at_checkpoint = now.state();
    io::write_checkpoint(file, {now.engine().save(), "{}"}, comm);
    return true;
  });
  return run;
}

Outcome run_on(const Scene& scene, const std::filesystem::path& file, const LoopState& state, const mpi::Comm& comm,
               int threads = 1) {
  Outcome run;
  EXPECT_EQ(io::damage_of(file, comm), "");
  TimeLoop loop(scene, resolve_effects(scene), io::read_checkpoint(file, comm).engine, state, threads, comm);
  loop.run(until_end(run, comm));
  return run;
}

void expect_same_bits(const Outcome& one, const Outcome& other) {
  ASSERT_EQ(one.end.size(), other.end.size());
  ASSERT_GT(one.end.size(), 0U);
  for (std::size_t i = 0; i < one.end.size(); ++i) {
    ASSERT_EQ(std::memcmp(&one.end[i], &other.end[i], sizeof(Sample)), 0) << "particle " << i;
  }
  EXPECT_EQ(one.lost.plastic, other.lost.plastic);
  EXPECT_EQ(one.lost.viscous, other.lost.viscous);
}

// Sums of a node run in another order: rounding, which contact amplifies a little (ranks_test.cpp has the same bound);
// a particle that is lost or has a neighbour's flaws shows as 1e-6 and more.
void expect_near(const Outcome& one, const Outcome& other) {
  constexpr double kTolerance = 1e-12;
  ASSERT_EQ(one.end.size(), other.end.size());
  for (std::size_t i = 0; i < one.end.size(); ++i) {
    const Vec3d moved = one.end[i].position - other.end[i].position;
    const Vec3d faster = one.end[i].velocity - other.end[i].velocity;
    ASSERT_LE(std::sqrt(dot(moved, moved)), kTolerance * 200e3) << "particle " << i;
    ASSERT_LE(std::sqrt(dot(faster, faster)), kTolerance * 200.0) << "particle " << i;
    ASSERT_NEAR(one.end[i].damage, other.end[i].damage, kTolerance) << "particle " << i;
  }
}

void expect_bitwise(std::vector<std::string> overrides, bool breaking = false) {
  overrides.emplace_back("gravity.interval=8");
  const mpi::Comm comm;
  const breccia::test::SharedFile file("checkpoint", comm);
  const Scene scene = load(collision(9e3), overrides);
  const Outcome whole = run_through(scene, file.path(), comm);
  const Outcome parts = run_on(scene, file.path(), whole.at_checkpoint, comm);
  expect_same_bits(whole, parts);
  // No case may pass for want of damage that grows.
  if (breaking) {
    EXPECT_GT(whole.damage_at_checkpoint, 0.001);
    EXPECT_LT(whole.damage_at_checkpoint, 0.95);
  }
}

TEST(Checkpoint, EveryEffectDouble) { expect_bitwise({}, true); }
TEST(Checkpoint, EveryEffectMixed) { expect_bitwise({"numerics.precision=mixed"}, true); }
TEST(Checkpoint, TreeGravity) { expect_bitwise({"effects.gravity=tree", "numerics.precision=mixed"}); }
TEST(Checkpoint, ParticleMeshGravity) { expect_bitwise({"effects.gravity=treepm", "numerics.precision=mixed"}); }
TEST(Checkpoint, GravityByTheCheapestMethod) { expect_bitwise({"effects.gravity=auto", "numerics.precision=mixed"}); }
TEST(Checkpoint, WithoutGravity) { expect_bitwise({"effects.gravity=off"}); }
TEST(Checkpoint, AdaptiveStep) { expect_bitwise({"time.step=auto", "numerics.precision=mixed"}); }
TEST(Checkpoint, NoDamage) { expect_bitwise({"effects.damage=off"}); }
TEST(Checkpoint, FluidWithoutEnergy) {
  expect_bitwise({"effects.shear=off", "effects.strength=off", "effects.damage=off", "effects.energy=off"});
}

// Bodies so thin that most particles share no node with others and go without grid.
TEST(Checkpoint, LoneParticles) {
  expect_bitwise({"grid.cell=1500 m", "body[0].particles=300", "body[1].particles=300"});
}

// Slabs that are cut anew before and after the checkpoint, and the record of that.
TEST(Checkpoint, SlabsCutAnew) {
  const std::vector<std::string> overrides{"gravity.interval=8", "parallel.balance=always", "numerics.precision=mixed"};
  const mpi::Comm comm;
  const breccia::test::SharedFile file("checkpoint", comm);
  const Scene scene = load(collision(9e3), overrides);
  const Outcome whole = run_through(scene, file.path(), comm);
  const Outcome parts = run_on(scene, file.path(), whole.at_checkpoint, comm);
  expect_same_bits(whole, parts);
  EXPECT_EQ(whole.balance.recuts, comm.size() > 1 ? kEnd / 8 + 1 : 0);
  EXPECT_EQ(parts.balance.recuts, whole.balance.recuts);
  EXPECT_EQ(parts.balance.imbalance_sum, whole.balance.imbalance_sum);
}

// Neither the interrupted run nor the continued one depends on the threads.
TEST(Checkpoint, OtherNumberOfThreads) {
  const mpi::Comm comm;
  const breccia::test::SharedFile file("checkpoint", comm);
  const Scene scene = load(collision(9e3), {"gravity.interval=8", "numerics.precision=mixed"});
  const Outcome whole = run_through(scene, file.path(), comm, 3);
  expect_same_bits(whole, run_on(scene, file.path(), whole.at_checkpoint, comm, 2));
  expect_same_bits(whole, run_on(scene, file.path(), whole.at_checkpoint, comm, 1));
}

// What cannot be a state is refused on all ranks, though one rank alone holds it.
TEST(Checkpoint, StatesThatAreNone) {
  const mpi::Comm comm;
  const breccia::test::SharedFile file("checkpoint", comm);
  const Scene scene = load(collision(9e3), {"gravity.interval=8"});
  const Outcome whole = run_through(scene, file.path(), comm);
  const auto column = [](EngineState& state, const std::string& name) -> StateColumn& {
    return *std::ranges::find_if(state.columns, [&](const StateColumn& c) { return c.name == name; });
  };
  const std::vector<std::function<void(EngineState&)>> changes{
      [](EngineState& state) { state.slab_axis = 3; },
      [](EngineState& state) { state.slab_cuts.push_back(0); },
      [](EngineState& state) { state.node.front() = std::numeric_limits<std::int32_t>::min(); },
      [](EngineState& state) { state.columns.pop_back(); },
      [&](EngineState& state) { column(state, "velocity").values.pop_back(); },
      [&](EngineState& state) { column(state, "id_high").values[0] = std::byte{1}; },
      [&](EngineState& state) { column(state, "body_material").values[0] = std::byte{2}; },
      [&](EngineState& state) { column(state, "body_material").values[2] = std::byte{1}; },
      [&](EngineState& state) { column(state, "flaws_active").values[1] = std::byte{1}; },
  };
  for (std::size_t n = 0; n < changes.size(); ++n) {
    EngineState state = io::read_checkpoint(file.path(), comm).engine;
    if (comm.rank() == comm.size() - 1) changes[n](state);
    EXPECT_THROW(TimeLoop(scene, resolve_effects(scene), state, whole.at_checkpoint, 1, comm), IoError) << n;
  }
}

TEST(Checkpoint, RunStatesThatAreNone) {
  RunState run;
  run.loop.dt = run.loop.previous_dt = 0.25;
  EXPECT_NO_THROW(static_cast<void>(run_state_from(to_text(run))));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::function<void(RunState&)>> changes{
      [&](RunState& r) { r.loop.dt = nan; },
      [](RunState& r) { r.loop.previous_dt = 0.0; },
      [](RunState& r) { r.loop.time = -1.0; },
      [](RunState& r) { r.loop.sort_interval = 0; },
      [](RunState& r) { r.output.rows.next = -1e300; },
  };
  for (std::size_t n = 0; n < changes.size(); ++n) {
    RunState broken = run;
    changes[n](broken);
    EXPECT_THROW(static_cast<void>(run_state_from(to_text(broken))), IoError) << n;
  }
  EXPECT_THROW(static_cast<void>(run_state_from("{}")), IoError);
}

// A conversion to an integer that it does not fit into is undefined (found by the fuzzer).
TEST(Checkpoint, WholeNumbersOfTheRunStateAreWholeAndFit) {
  RunState run;
  run.loop.dt = run.loop.previous_dt = 0.25;
  run.loop.step = 24;
  const std::string text = to_text(run), step = "\"step\": 24";
  ASSERT_NE(text.find(step), std::string::npos);
  for (const char* value : {"6.6e25", "2.5", "-1", "1e300", "true", "\"24\""}) {
    std::string broken = text;
    broken.replace(text.find(step), step.size(), std::string("\"step\": ") + value);
    EXPECT_THROW(static_cast<void>(run_state_from(broken)), IoError) << value;
  }
}

// Mixed precision, damage growing: what there is most of. HDF5's own tables are some kB.
TEST(Checkpoint, BytesPerParticle) {
  const mpi::Comm comm;
  const breccia::test::SharedFile file("checkpoint", comm);
  const Scene scene = load(collision(5e3), {"gravity.interval=8", "numerics.precision=mixed"});
  TimeLoop loop(scene, resolve_effects(scene), 1, comm);
  const auto particles = static_cast<double>(comm.sum(loop.engine().stats().particles));
  loop.run([](const TimeLoop&) { return true; },
           [&](const TimeLoop& now) {
             io::write_checkpoint(file.path(), {now.engine().save(), "{}"}, comm);
             return false;
           });
  EXPECT_LE(static_cast<double>(std::filesystem::file_size(file.path())), 200.0 * particles);
}

// Damage that ended before the checkpoint: its fields are gone while the scene asks for them.
TEST(Checkpoint, DamageFinished) {
  const mpi::Comm comm;
  const breccia::test::SharedFile file("checkpoint", comm);
  Scene scene =
      load(collision(9e3), {"body[0].damage=1", "body[1].damage=1", "effects.damage=on", "gravity.interval=8"});
  const Outcome whole = run_through(scene, file.path(), comm);
  EXPECT_TRUE(io::read_checkpoint(file.path(), comm).engine.damage_finished);
  expect_same_bits(whole, run_on(scene, file.path(), whole.at_checkpoint, comm));
}

// Cut across another axis where it goes on: the same to rounding, as on another number of ranks.
TEST(Checkpoint, OtherAxisOfSlabs) {
  const mpi::Comm comm;
  const breccia::test::SharedFile file("checkpoint", comm);
  const Scene scene = load(collision(9e3), {"gravity.interval=8"});
  const Outcome whole = run_through(scene, file.path(), comm);
  const Scene across = load(collision(9e3), {"gravity.interval=8", "parallel.axis=z"});
  EXPECT_EQ(TimeLoop(across, resolve_effects(across), io::read_checkpoint(file.path(), comm).engine,
                     whole.at_checkpoint, 1, comm)
                .engine()
                .slabs()
                .axis(),
            2);
  expect_near(whole, run_on(across, file.path(), whole.at_checkpoint, comm));
}

// A file as a program of that format would have left it, as far as the number goes.
void set_format(const std::filesystem::path& path, std::int64_t format, const mpi::Comm& comm) {
  if (comm.is_root()) {
    const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    const hid_t scalar = H5Screate(H5S_SCALAR);
    EXPECT_GE(H5Adelete_by_name(file, "/Engine", "Format", H5P_DEFAULT), 0);
    const hid_t attribute =
        H5Acreate_by_name(file, "/Engine", "Format", H5T_NATIVE_INT64, scalar, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    EXPECT_GE(H5Awrite(attribute, H5T_NATIVE_INT64, &format), 0);
    H5Aclose(attribute);
    H5Sclose(scalar);
    H5Fclose(file);
  }
  comm.barrier();
}

// Format 2 has other cuts, which are chosen anew: the same run to rounding. Older and newer ones are refused by number.
TEST(Checkpoint, OtherFormats) {
  const mpi::Comm comm;
  const breccia::test::SharedFile file("checkpoint", comm);
  const Scene scene = load(collision(9e3), {"gravity.interval=8", "parallel.balance=off"});
  const Outcome whole = run_through(scene, file.path(), comm);
  EXPECT_TRUE(io::read_checkpoint(file.path(), comm).engine.same_ranks);
  set_format(file.path(), 2, comm);
  EngineState state = io::read_checkpoint(file.path(), comm).engine;
  EXPECT_FALSE(state.same_ranks);
  // Taken as they are they would leave all to one rank.
  state.slab_cuts.assign(state.slab_cuts.size(), 1000);
  Outcome parts;
  TimeLoop loop(scene, resolve_effects(scene), state, whole.at_checkpoint, 1, comm);
  EXPECT_GT(loop.engine().stats().particles, 0U);
  loop.run(until_end(parts, comm));
  expect_near(whole, parts);
  for (const std::int64_t format : {1, 4}) {
    set_format(file.path(), format, comm);
    try {
      static_cast<void>(io::read_checkpoint(file.path(), comm));
      ADD_FAILURE() << "format " << format << " was read";
    } catch (const IoError& error) {
      const std::string expected = "format " + std::to_string(format) + ", but this program reads 2 and 3";
      EXPECT_NE(std::string(error.what()).find(expected), std::string::npos) << error.what();
    }
  }
}

// One is taken that is whole but for its meaning, and none of another format's: the program that wrote it can go on.
TEST(Checkpoint, OneOfAnotherFormatIsNotPassedOver) {
  const mpi::Comm comm;
  const breccia::test::SharedFile place("checkpoints", comm);
  const std::filesystem::path& folder = place.path();
  if (comm.is_root()) std::filesystem::create_directory(folder);
  comm.barrier();
  const Scene scene = load(collision(9e3), {"gravity.interval=8"});
  TimeLoop loop(scene, resolve_effects(scene), 1, comm);
  loop.run([](const TimeLoop&) { return true; },
           [&](const TimeLoop& now) {
             const RunState run{now.state(), {}, {}, {}};
             io::write_checkpoint(folder / "checkpoint_0000.h5", {now.engine().save(), to_text(run)}, comm);
             io::write_checkpoint(folder / "checkpoint_0001.h5", {now.engine().save(), "{}"}, comm);
             return false;
           });
  const auto found = find_restart("auto", folder, scene, {}, comm);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->next_number, 1U);
  set_format(folder / "checkpoint_0001.h5", 4, comm);
  io::append_checksum(folder / "checkpoint_0001.h5", comm);
  EXPECT_THROW(static_cast<void>(find_restart("auto", folder, scene, {}, comm)), io::UnknownFormat);
}

TEST(Checkpoint, OtherNumberOfRanks) {
  const mpi::Comm comm;
  const mpi::Comm self(MPI_COMM_SELF);
  const breccia::test::SharedFile file("checkpoint", comm);
  const Scene scene = load(collision(9e3), {"gravity.interval=8"});
  const Outcome whole = run_through(scene, file.path(), comm);
  const Outcome alone = run_on(scene, file.path(), whole.at_checkpoint, self);
  expect_near(whole, alone);
}

// Format 3 was written before these were counted: nothing counted is 0, anything else that is missing is an error.
TEST(Checkpoint, StateWithoutWhatWasNotCountedYetIsRead) {
  RunState state;
  state.loop.dt = state.loop.previous_dt = 1.0;
  state.loop.lost = {{1.0, 2.0, 3, 4.0}};
  state.budget.first.affine_energy = 5.0;
  state.budget.first.kinetic_energy = 6.0;
  nlohmann::ordered_json json = nlohmann::ordered_json::parse(to_text(state));
  EXPECT_EQ(run_state_from(json.dump()).loop.lost.at(0).periods, 4.0);
  EXPECT_EQ(run_state_from(json.dump()).budget.first.affine_energy, 5.0);
  json["loop"]["lost_work"][0].erase(3);
  json["budget"]["first"].erase("affine_energy");
  const RunState earlier = run_state_from(json.dump());
  EXPECT_EQ(earlier.loop.lost.at(0).clamped, 3U);
  EXPECT_EQ(earlier.loop.lost.at(0).periods, 0.0);
  EXPECT_EQ(earlier.budget.first.affine_energy, 0.0);
  EXPECT_EQ(earlier.budget.first.kinetic_energy, 6.0);
  json["budget"]["first"].erase("kinetic_energy");
  EXPECT_THROW(static_cast<void>(run_state_from(json.dump())), IoError);
}

}  // namespace
}  // namespace breccia::sim::test

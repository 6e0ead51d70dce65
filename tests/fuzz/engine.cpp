// The restart behind a checkpoint's file: any state of any particles is refused with one line, or runs for some steps
// without touching memory that is not its own. Numbers that go wrong are the guard's business, and no finding.
#include <cstring>
#include <memory>

#include "breccia/error.hpp"
#include "scene/orbit.hpp"
#include "sim/effects.hpp"
#include "sim/time_loop.hpp"
#include "tests/fuzz/target.hpp"

namespace {

using namespace breccia;

Scene small_scene() {
  Scene scene;
  scene.name = "fuzz";
  scene.materials.resize(1);
  scene.cell = 20e3;
  scene.time.step = 0.5;
  scene.gravity.interval = 2;
  scene.effects.gravity = GravityMethod::kDirect;
  scene.effects.damage = Switch::kOn;
  for (std::uint64_t b = 0; b < 2; ++b) {
    BodyParameters body;
    body.name = b == 0 ? "target" : "impactor";
    body.semi_axes = {50e3, 50e3, 50e3};
    body.particles = 24;
    body.first_id = b * body.particles;
    body.mass = 1.4e18;
    body.position = {b == 0 ? 0.0 : 102e3, 0.0, 0.0};
    scene.bodies.push_back(body);
  }
  return scene;
}

struct Start {
  Scene scene = small_scene();
  sim::ResolvedEffects effects = sim::resolve_effects(scene);
  EngineState engine;
  sim::LoopState loop;
};

const Start& start() {
  static const Start saved = [] {
    Start s;
    sim::TimeLoop loop(s.scene, s.effects, 1, mpi::Comm());
    loop.run([](const sim::TimeLoop&) { return true; },
             [&](const sim::TimeLoop& now) {
               s.engine = now.engine().save();
               s.loop = now.state();
               return false;
             });
    return s;
  }();
  return saved;
}

// Reads the input as a list of changes.
class Changes {
 public:
  Changes(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}
  [[nodiscard]] bool done() const { return left_ == 0; }
  std::uint64_t number(std::size_t bytes) {
    std::uint64_t value = 0;
    for (; bytes > 0 && left_ > 0; --bytes, --left_) value = value << 8 | *data_++;
    return value;
  }
  std::size_t below(std::size_t limit) { return limit == 0 ? 0 : number(2) % limit; }

 private:
  const std::uint8_t* data_;
  std::size_t left_;
};

void change(EngineState& engine, sim::LoopState& loop, Changes& changes) {
  switch (changes.number(1) % 9) {
    case 0: {  // bytes of a field
      StateColumn& column = engine.columns[changes.below(engine.columns.size())];
      const std::size_t at = changes.below(column.values.size());
      if (at < column.values.size()) column.values[at] = static_cast<std::byte>(changes.number(1));
      break;
    }
    case 1: {  // a whole number of a field
      StateColumn& column = engine.columns[changes.below(engine.columns.size())];
      if (column.values.size() < 8) break;
      const std::uint64_t value = changes.number(8);
      const std::size_t at = changes.below(column.values.size() / 8) * 8;
      std::memcpy(column.values.data() + at, &value, 8);
      break;
    }
    case 2:
      if (!engine.node.empty()) {
        engine.node[changes.below(engine.node.size())] = static_cast<std::int32_t>(changes.number(4));
      }
      break;
    case 3: {  // a field of another size
      StateColumn& column = engine.columns[changes.below(engine.columns.size())];
      column.values.resize(changes.below(2 * column.values.size() + 1));
      break;
    }
    case 4:
      engine.columns.erase(engine.columns.begin() + static_cast<std::ptrdiff_t>(changes.below(engine.columns.size())));
      if (engine.columns.empty()) engine.columns = start().engine.columns;
      break;
    case 5:
      engine.particles = changes.below(100);
      break;
    case 6:
      engine.slab_axis = static_cast<int>(changes.number(1)) - 3;
      engine.slab_cuts.assign(changes.below(4), static_cast<std::int32_t>(changes.number(4)));
      engine.same_ranks = changes.number(1) % 2 == 0;
      break;
    case 7:
      loop.sort_interval = static_cast<int>(changes.number(4));
      loop.step = changes.number(8);
      loop.lost.resize(changes.below(5));
      break;
    default: {
      const std::uint64_t bits = changes.number(8);
      std::memcpy(changes.number(1) % 2 == 0 ? &loop.dt : &loop.previous_dt, &bits, 8);
      engine.damage_finished = changes.number(1) % 4 == 0;
    }
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::start_mpi();
  const Start& from = start();
  EngineState engine = from.engine;
  sim::LoopState state = from.loop;
  Changes changes(data, size);
  for (int n = 0; n < 8 && !changes.done(); ++n) change(engine, state, changes);
  const std::uint64_t first = state.step;
  try {
    // As it comes out of a file.
    sim::RunState run;
    run.loop = state;
    state = sim::run_state_from(sim::to_text(run)).loop;
    sim::TimeLoop loop(from.scene, from.effects, engine, state, 1, mpi::Comm());
    loop.run([&](const sim::TimeLoop& now) { return now.step() - first < 4; });
  } catch (const UsageError&) {
    std::abort();
  } catch (const Error&) {
  }
  return 0;
}

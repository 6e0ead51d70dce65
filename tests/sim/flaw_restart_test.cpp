// What a restarted run knows of flaws follows from how many of them grow: the threshold of the next one, which no file
// holds, is that after those. In an impact few particles are between two flaws for more than a step; here all are.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "sim/setup.hpp"
#include "tests/sim/simulation.hpp"

namespace breccia::sim::test {
namespace {

const char* const kRestingBody = R"([scene]
end = "1 s"
[grid]
cell = "2 km"
[time]
step = "1 us"
[effects]
gravity = "off"
damage = "on"
[[body]]
shape = "sphere"
radius = "10 km"
)";

std::byte* column(EngineState& state, const char* name) {
  return std::ranges::find_if(state.columns, [&](const StateColumn& c) { return c.name == name; })->values.data();
}

// F F^T - I of the same stretch along all axes.
template <class Real>
void set_strain(EngineState& state, std::size_t particle, double strain) {
  const auto stretch = static_cast<Real>(std::expm1(2.0 * strain));
  const Real total[6] = {stretch, stretch, stretch, 0, 0, 0};
  std::memcpy(column(state, "total_strain") + particle * sizeof total, total, sizeof total);
}

TEST(FlawRestart, NextFlawIsTheOneAfterThoseThatGrow) {
  const mpi::Comm comm;
  for (const char* precision : {"mixed", "double"}) {
    const Scene scene = load(kRestingBody, {std::string("numerics.precision=") + precision});
    const ResolvedEffects effects = resolve_effects(scene);
    const auto engine = make_loaded_engine(scene, effects, 1, comm);
    EngineState state = engine->save();
    const material::FlawLists flaws = engine->flaws();
    std::size_t between = 0;
    for (std::size_t i = 0; i < state.particles; ++i) {
      const std::span<const float> own = flaws.of(i);
      if (own.size() < 2 || !(own[1] > 1.01F * own[0])) continue;
      const std::uint32_t one = 1;
      std::memcpy(column(state, "flaws_active") + i * sizeof one, &one, sizeof one);
      const double strain = 0.5 * (static_cast<double>(own[0]) + static_cast<double>(own[1]));
      scene.numerics.precision == Precision::kMixed ? set_strain<float>(state, i, strain)
                                                    : set_strain<double>(state, i, strain);
      ++between;
    }
    ASSERT_GT(between, state.particles / 4);

    const auto restored = make_restored_engine(scene, effects, state, 1, comm);
    const double dt = *scene.time.step;
    restored->scatter(0.5 * dt);
    restored->update_grid(dt);
    restored->gather(dt);
    restored->sort();
    EngineState after = restored->save();
    std::size_t growing = 0;
    for (std::size_t i = 0; i < after.particles; ++i) {
      std::uint32_t active = 0;
      std::memcpy(&active, column(after, "flaws_active") + i * sizeof active, sizeof active);
      growing += active;
    }
    EXPECT_EQ(growing, between) << precision;
  }
}

}  // namespace
}  // namespace breccia::sim::test

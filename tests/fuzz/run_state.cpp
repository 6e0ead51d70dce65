// The JSON of a checkpoint: refused with one line, or read to a state that is written and read back as the same.
#include "sim/run_state.hpp"

#include "sim/same_scene.hpp"
#include "tests/fuzz/target.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace breccia;
  fuzz::expect_user_errors([&] {
    const sim::RunState state = sim::run_state_from(std::string(fuzz::text_of(data, size)));
    const std::string once = sim::to_text(state);
    if (sim::to_text(sim::run_state_from(once)) != once) std::abort();
    sim::require_same_scene(state.scene, {{"grid.cell", "10 km"}, {"scene.end", "1 s"}}, "checkpoint");
  });
  return 0;
}

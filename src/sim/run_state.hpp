// What a run knows besides its particles, as a checkpoint holds it: JSON, every double with the digits that give it
// back.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "breccia/scene.hpp"
#include "io/diagnostics.hpp"
#include "io/summary.hpp"

namespace breccia::sim {

/// What the particles do not tell of the energy since the start, of this rank.
struct LostWork {
  double plastic = 0.0;       ///< work turned to heat by yielding [J]
  double viscous = 0.0;       ///< and by artificial viscosity [J]
  std::uint64_t clamped = 0;  ///< volume changes that were cut (PassReport::clamped)
  double periods = 0.0;       ///< work of the uniform field over the periods that matter was put back by [J]
};

/// Of the balance of loads, since the start or since the number of ranks changed. Imbalance is the largest over the
/// mean counted work of the ranks.
struct BalanceState {
  std::uint64_t windows = 0;   ///< at whose start work was counted
  std::uint64_t recuts = 0;    ///< times that slabs were cut anew
  double imbalance = 1.0;      ///< in the last window
  double imbalance_sum = 0.0;  ///< of all windows
  double imbalance_max = 1.0;
};

/// Of the time loop at a window start: the window's phase and the steps since the last sorting are 0 there.
struct LoopState {
  double time = 0.0;
  double dt = 0.0;
  double previous_dt = 0.0;
  std::uint64_t step = 0;
  int sort_interval = 1;
  std::vector<LostWork> lost;  ///< of each rank
  BalanceState balance;
};

/// Of the conservation budget.
struct BudgetState {
  bool started = false;
  io::DiagnosticsRow first;
  double momentum_scale = 0.0;  ///< largest sum m |v|
  double angular_scale = 0.0;   ///< largest sum m |x cross v|
  double energy_scale = 0.0;    ///< largest kinetic + |potential|
  io::Conservation drift;
};

/// An output schedule.
struct ScheduleState {
  double interval = 0.0;
  double next = 0.0;
};

/// Of what a run writes.
struct OutputState {
  ScheduleState snapshots;
  ScheduleState rows;
  std::uint64_t next_analysis = 0;
  std::uint64_t snapshot_number = 0;
  double wall_seconds = 0.0;  ///< of the steps so far
};

struct RunState {
  LoopState loop;
  BudgetState budget;
  OutputState output;
  std::vector<ResolvedKey> scene;  ///< every key as resolved
};

[[nodiscard]] std::string to_text(const RunState& state);
/// Throws IoError if `text` is not what to_text() makes.
[[nodiscard]] RunState run_state_from(const std::string& text);

}  // namespace breccia::sim

// The time step as a script: grid, particles, and at the start of a window sorting, gravity and the choice of dt, which
// a shock may shorten at a sorting inside the window.
#pragma once

#include <functional>
#include <memory>

#include "gravity/resident.hpp"
#include "gravity/solver.hpp"
#include "gravity/window.hpp"
#include "grid/engine.hpp"
#include "sim/balance.hpp"
#include "sim/diagnostics.hpp"
#include "sim/effects.hpp"
#include "sim/gravity_record.hpp"
#include "sim/guard.hpp"
#include "sim/stage_timers.hpp"
#include "sim/step_size.hpp"

namespace breccia::sim {

class TimeLoop {
 public:
  using Visit = std::function<bool(const TimeLoop&)>;

  /// Makes the engine with its particles, evaluates gravity, sets v^{-1/2} and scatters for the first time. Collective.
  TimeLoop(const Scene& scene, const ResolvedEffects& effects, int threads, const mpi::Comm& comm,
           grid::EngineMaker make = &grid::make_host_engine);

  /// Goes on from a state that engine().save() and state() gave, without anything being computed anew. Collective.
  TimeLoop(const Scene& scene, const ResolvedEffects& effects, const EngineState& engine, const LoopState& state,
           int threads, const mpi::Comm& comm, grid::EngineMaker make = &grid::make_host_engine);
  ~TimeLoop() { engine_->abandon(); }
  TimeLoop(const TimeLoop&) = delete;
  TimeLoop& operator=(const TimeLoop&) = delete;

  /// Steps until `at_time_step` returns false; it is called at every t_n, when the grid holds v^{n-1/2} and v^{n+1/2}
  /// and observe() is meaningful. Collective.
  /// `at_window_start` is called at the state boundary where a window begins, after sorting, gravity and the choice of
  /// dt: there engine().save() and state() are the whole run. It may end the run as well.
  /// Throws NumericsError, the same on all ranks, if the numbers went wrong (guard.hpp).
  void run(
      const Visit& at_time_step, const Visit& at_window_start = [](const TimeLoop&) { return true; });

  /// Only at a window start. Collective.
  [[nodiscard]] LoopState state() const;

  [[nodiscard]] double time() const { return time_; }
  [[nodiscard]] std::uint64_t step() const { return step_; }
  [[nodiscard]] double dt() const { return dt_; }
  [[nodiscard]] const grid::Engine& engine() const { return *engine_; }
  [[nodiscard]] gravity::Solver* solver() const { return solver_.get(); }
  [[nodiscard]] LostWork lost_work() const { return lost_with(engine_->passes()); }
  [[nodiscard]] const GravityRecord& gravity_record() const { return gravity_record_; }
  [[nodiscard]] const Guard& guard() const { return guard_; }
  [[nodiscard]] const BalanceState& balance() const { return balance_.state(); }
  [[nodiscard]] StageTimers& timers() const { return timers_; }
  /// Waits for a device, which is behind what it has been told to do: its steps are no part of what comes next.
  grid::PassReport finish_steps() const;
  /// Notes in `timeline` what is done when.
  void record(Timeline& timeline);

 private:
  bool one_step(const Visit& at_window_start);
  void make_solver(const ResolvedEffects& effects, int threads);
  void count_step();
  void between_steps();
  grid::PassReport check();  // of the guard; what it was shown
  [[nodiscard]] LostWork lost_with(const grid::PassReport& passes) const;
  void begin_window();
  void shorten_step();
  [[nodiscard]] double stable_step_now();
  void evaluate_gravity();
  void balance_ranks();
  [[nodiscard]] bool sorting_due() const { return steps_since_sort_ + 1 >= sort_interval_; }
  void set_sort_interval(double cells_per_step);

  const Scene& scene_;
  bool viscosity_;
  bool adaptive_;
  mpi::Comm comm_;
  std::unique_ptr<grid::Engine> engine_;
  std::unique_ptr<gravity::Solver> solver_;            // null: no self-gravity
  std::unique_ptr<gravity::ResidentSolver> resident_;  // in its place where the engine can evaluate gravity itself
  gravity::Window window_;
  GravityRecord gravity_record_;
  Guard guard_;
  Balance balance_;
  LostWork lost_;  // up to the last sorting
  double time_ = 0.0;
  double dt_ = 0.0;           // of the step that comes
  double previous_dt_ = 0.0;  // of the step that was
  std::uint64_t step_ = 0;
  int sort_interval_ = 1;
  int steps_since_sort_ = 0;
  mutable StageTimers timers_;
  Timeline* timeline_ = nullptr;
};

}  // namespace breccia::sim

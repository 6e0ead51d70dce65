#include "sim/time_loop.hpp"

#include <algorithm>
#include <cmath>

#include "sim/setup.hpp"

namespace breccia::sim {
namespace {

double step_at_rest(const Scene& scene, const ResolvedEffects& effects) {
  return stable_step(scene, initial_speeds(scene, effects.material.shear), effects.material.viscosity).seconds;
}

LostWork sum_of(const std::vector<LostWork>& ranks) {
  LostWork sum;
  for (const LostWork& work : ranks) {
    sum.plastic += work.plastic;
    sum.viscous += work.viscous;
    sum.clamped += work.clamped;
    sum.periods += work.periods;
  }
  return sum;
}

}  // namespace

TimeLoop::TimeLoop(const Scene& scene, const ResolvedEffects& effects, int threads, const mpi::Comm& comm,
                   grid::EngineMaker make)
    : scene_(scene),
      viscosity_(effects.material.viscosity),
      adaptive_(!scene.time.step),
      comm_(comm),
      engine_(make_loaded_engine(scene, effects, threads, comm, make)),
      window_(scene.gravity.interval),
      guard_(scene, step_at_rest(scene, effects), comm),
      balance_(scene, comm) {
  lost_.periods = -engine_->work_beyond_period();  // of matter that the start itself has put back
  const grid::SignalSpeeds speeds = engine_->signal_speeds();
  dt_ = previous_dt_ = stable_step(scene_, speeds, viscosity_).seconds;
  set_sort_interval(speeds.particle * dt_ / scene_.cell);
  make_solver(effects, threads);
  if (solver_) evaluate_gravity();
  balance_ranks();
  engine_->kick_velocities(0.5 * dt_);
  timers_("stress, p2g", [&] { engine_->scatter(0.5 * dt_); });
}

TimeLoop::TimeLoop(const Scene& scene, const ResolvedEffects& effects, const EngineState& engine,
                   const LoopState& state, int threads, const mpi::Comm& comm, grid::EngineMaker make)
    : scene_(scene),
      viscosity_(effects.material.viscosity),
      adaptive_(!scene.time.step),
      comm_(comm),
      engine_(make_restored_engine(scene, effects, engine, threads, comm, make)),
      window_(scene.gravity.interval),
      guard_(scene, step_at_rest(scene, effects), comm),
      balance_(scene, comm),
      time_(state.time),
      dt_(state.dt),
      previous_dt_(state.previous_dt),
      step_(state.step),
      sort_interval_(state.sort_interval) {
  make_solver(effects, threads);
  const auto rank = static_cast<std::size_t>(comm.rank());
  if (state.lost.size() == static_cast<std::size_t>(comm.size())) {
    lost_ = state.lost[rank];
    balance_.restore(state.balance);
  } else {
    if (comm.is_root()) lost_ = sum_of(state.lost);
    // Gravity was evaluated elsewhere: what it cost is counted from the next window on.
    timers_("balance", [&] { balance_.at_window_start(*engine_, nullptr); });
  }
  timers_("stress, p2g", [&] { engine_->scatter(0.5 * previous_dt_); });
}

void TimeLoop::make_solver(const ResolvedEffects& effects, int threads) {
  if (!effects.gravity) return;
  const gravity::Parameters parameters{
      .softening = scene_.gravity.softening,
      .precision = scene_.numerics.precision,
      .mesh = {.particle_spacing = mean_spacing(scene_), .cell = scene_.gravity.mesh, .split = scene_.gravity.split},
      .error = scene_.gravity.error,
      .opening = scene_.gravity.opening};
  solver_ = gravity::make_solver(effects.gravity_method, parameters, comm_, threads);
  auto* particles = dynamic_cast<gravity::ResidentParticles*>(engine_.get());
  if (particles != nullptr) resident_ = particles->make_resident_solver(effects.gravity_method, parameters);
}

void TimeLoop::record(Timeline& timeline) {
  timeline_ = &timeline;
  engine_->record(&timeline);
  timers_.record(&timeline);
}

LoopState TimeLoop::state() const {
  return {time_, dt_, previous_dt_, step_, sort_interval_, comm_.allgather(lost_), balance_.state()};
}

void TimeLoop::run(const Visit& at_time_step, const Visit& at_window_start) {
  for (;;) {
    if (timeline_ != nullptr) timeline_->begin_step();
    // Kick with the mean of two unequal steps: the leapfrog stays second order where dt changes.
    timers_("grid", [&] { engine_->update_grid(0.5 * (previous_dt_ + dt_)); });
    if (!at_time_step(*this)) {
      check();
      return;
    }
    if (!one_step(at_window_start)) return;
  }
}

bool TimeLoop::one_step(const Visit& at_window_start) {
  window_.advance();
  if (window_.due() || sorting_due()) {
    timers_("g2p", [&] { engine_->gather(dt_); });
    between_steps();
    if (window_.due() && !at_window_start(*this)) return false;
    timers_("stress, p2g", [&] { engine_->scatter(0.5 * previous_dt_); });
  } else {
    timers_("g2p, stress, p2g", [&] { engine_->gather_scatter(dt_); });
    count_step();
  }
  return true;
}

void TimeLoop::count_step() {
  previous_dt_ = dt_;
  ++step_;
  ++steps_since_sort_;
  // A fixed step must not add up rounding over a million steps.
  time_ = adaptive_ ? time_ + dt_ : static_cast<double>(step_) * dt_;
}

void TimeLoop::between_steps() {
  count_step();
  const grid::PassReport passes = check();
  steps_since_sort_ = 0;
  lost_ = lost_with(passes);
  const double largest_move = comm_.max(passes.largest_move);
  timers_("damage", [&] { engine_->finish_damage(); });
  timers_("sort", [&] { lost_.periods += engine_->sort(); });
  if (window_.due()) {
    begin_window();
  } else if (adaptive_) {
    shorten_step();
  }
  set_sort_interval(largest_move * dt_ / previous_dt_);
}

void TimeLoop::begin_window() {
  if (adaptive_) {
    dt_ = stable_step_now();
    guard_.check_step(dt_, *engine_);
  }
  if (solver_) evaluate_gravity();
  balance_ranks();
}

void TimeLoop::balance_ranks() {
  // Where the engine evaluates gravity itself, the solver knows nothing of what its particles cost now.
  const gravity::Solver* counted = resident_ ? nullptr : solver_.get();
  timers_("balance", [&] { balance_.at_window_start(*engine_, counted); });
}

// Inside a window dt stays, for which gravity was predicted, unless a shock has used up a quarter of the margin that
// cfl leaves.
void TimeLoop::shorten_step() {
  const double stable = stable_step_now(), limit = stable / scene_.time.cfl;
  if (dt_ <= stable + 0.25 * (limit - stable)) return;
  dt_ = stable;
  guard_.check_step(dt_, *engine_);
}

double TimeLoop::stable_step_now() {
  double step = 0.0;
  timers_("time step", [&] { step = stable_step(scene_, engine_->signal_speeds(), viscosity_).seconds; });
  return step;
}

void TimeLoop::evaluate_gravity() {
  const double time = window_.prediction_time(dt_);
  timers_("gravity", [&] {
    if (resident_) return resident_->evaluate_and_hold(time);
    std::vector<Vec3d> position;
    std::vector<double> mass;
    engine_->predict(time, position, mass);
    std::vector<Vec3d> acceleration(position.size());
    solver_->evaluate({position, mass}, acceleration, {});
    engine_->hold_gravity(acceleration);
  });
  const gravity::Stats& stats = resident_ ? resident_->last() : solver_->last();
  const gravity::Phases& phases = stats.phases;
  for (std::size_t k = 0; k < phases.seconds.size(); ++k) {
    if (phases.seconds[k] > 0.0) timers_.add_part("gravity", gravity::kPhaseNames[k], phases.seconds[k]);
  }
  gravity_record_.add(stats);
}

grid::PassReport TimeLoop::finish_steps() const {
  return timers_("checks", [&] { return engine_->passes(); });
}

grid::PassReport TimeLoop::check() {
  const grid::PassReport passes = finish_steps();
  const auto steps_after = static_cast<std::uint64_t>(steps_since_sort_) - passes.fault_step;
  guard_.note(passes, step_ - steps_after, time_ - static_cast<double>(steps_after) * previous_dt_);
  guard_.check(*engine_);
  return passes;
}

LostWork TimeLoop::lost_with(const grid::PassReport& passes) const {
  return {lost_.plastic + passes.plastic_work, lost_.viscous + passes.viscous_work, lost_.clamped + passes.clamped,
          lost_.periods};
}

void TimeLoop::set_sort_interval(double cells_per_step) {
  // Particles may drift one cell between sortings: half of it with their speed and the uniform field, v n + g n^2/2 =
  // 1/2 in cells and steps, and half is left for what else speeds them up meanwhile.
  const double field = std::sqrt(dot(scene_.gravity.uniform, scene_.gravity.uniform)) * dt_ * dt_ / scene_.cell;
  const double rate = cells_per_step + std::sqrt(cells_per_step * cells_per_step + field);
  const double steps = rate > 0.0 ? 1.0 / rate : scene_.numerics.sort_interval;
  sort_interval_ = std::clamp(static_cast<int>(std::min(steps, 1e6)), 1, scene_.numerics.sort_interval);
}

}  // namespace breccia::sim

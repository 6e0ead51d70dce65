#include "sim/run_state.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

#include "breccia/error.hpp"

namespace breccia::sim {
namespace {

using Json = nlohmann::ordered_json;

// JSON has no infinity: an output that never comes is null.
Json finite_or_null(double x) { return std::isfinite(x) ? Json(x) : Json(); }
double null_is_never(const Json& json) { return json.is_null() ? HUGE_VAL : json.get<double>(); }

template <class T>
T whole(const Json& json) {
  const bool fits = json.is_number_unsigned() ? std::in_range<T>(json.get<std::uint64_t>())
                                              : json.is_number_integer() && std::in_range<T>(json.get<std::int64_t>());
  if (!fits) throw IoError(fmt::format("the state of the run has {} where a whole number is meant", json.dump()));
  return json.get<T>();
}

// The library would take 1e30 for an integer.
template <class T>
void read(const Json& json, T& value) {
  if constexpr (std::is_integral_v<T> && !std::is_same_v<T, bool>) {
    value = whole<T>(json);
  } else {
    json.get_to(value);
  }
}

Json row_json(const io::DiagnosticsRow& row) {
  Json json;
  for (const io::DiagnosticsColumn& column : io::diagnostics_columns()) {
    std::visit([&](auto member) { json[column.name] = row.*member; }, column.value);
  }
  return json;
}

// Affine energy and work over periods were not counted by programs that wrote the same format: 0 there.
io::DiagnosticsRow row_from(const Json& json) {
  io::DiagnosticsRow row;
  for (const io::DiagnosticsColumn& column : io::diagnostics_columns()) {
    if (std::string_view(column.name) == "affine_energy" && !json.contains(column.name)) continue;
    std::visit([&](auto member) { read(json.at(column.name), row.*member); }, column.value);
  }
  return row;
}

Json balance_json(const BalanceState& balance) {
  return {{"windows", balance.windows},
          {"recuts", balance.recuts},
          {"imbalance", balance.imbalance},
          {"imbalance_sum", balance.imbalance_sum},
          {"imbalance_max", balance.imbalance_max}};
}

BalanceState balance_from(const Json& json) {
  BalanceState balance;
  json.at("windows").get_to(balance.windows);
  json.at("recuts").get_to(balance.recuts);
  json.at("imbalance").get_to(balance.imbalance);
  json.at("imbalance_sum").get_to(balance.imbalance_sum);
  json.at("imbalance_max").get_to(balance.imbalance_max);
  return balance;
}

Json loop_json(const LoopState& loop) {
  Json lost = Json::array();
  for (const LostWork& work : loop.lost) lost.push_back({work.plastic, work.viscous, work.clamped, work.periods});
  return {{"time", loop.time},
          {"dt", loop.dt},
          {"previous_dt", loop.previous_dt},
          {"step", loop.step},
          {"sort_interval", loop.sort_interval},
          {"lost_work", lost},
          {"balance", balance_json(loop.balance)}};
}

LoopState loop_from(const Json& json) {
  LoopState loop;
  read(json.at("time"), loop.time);
  read(json.at("dt"), loop.dt);
  read(json.at("previous_dt"), loop.previous_dt);
  read(json.at("step"), loop.step);
  read(json.at("sort_interval"), loop.sort_interval);
  for (const Json& work : json.at("lost_work")) {
    loop.lost.push_back({work.at(0).get<double>(), work.at(1).get<double>(), whole<std::uint64_t>(work.at(2)),
                         work.size() > 3 ? work.at(3).get<double>() : 0.0});
  }
  loop.balance = balance_from(json.at("balance"));
  const bool steps = loop.dt > 0.0 && loop.previous_dt > 0.0 && std::isfinite(loop.dt + loop.previous_dt);
  if (!steps || !(loop.time >= 0.0) || !std::isfinite(loop.time) || loop.sort_interval < 1) {
    throw IoError("the state of the run has times that are none");
  }
  return loop;
}

Json budget_json(const BudgetState& budget) {
  return {{"started", budget.started},
          {"first", row_json(budget.first)},
          {"momentum_scale", budget.momentum_scale},
          {"angular_scale", budget.angular_scale},
          {"energy_scale", budget.energy_scale},
          {"drift", {budget.drift.mass, budget.drift.momentum, budget.drift.angular_momentum, budget.drift.energy}}};
}

BudgetState budget_from(const Json& json) {
  BudgetState budget;
  read(json.at("started"), budget.started);
  budget.first = row_from(json.at("first"));
  read(json.at("momentum_scale"), budget.momentum_scale);
  read(json.at("angular_scale"), budget.angular_scale);
  read(json.at("energy_scale"), budget.energy_scale);
  const Json& drift = json.at("drift");
  budget.drift = {drift.at(0).get<double>(), drift.at(1).get<double>(), drift.at(2).get<double>(),
                  drift.at(3).get<double>()};
  return budget;
}

Json schedule_json(const ScheduleState& schedule) {
  return {{"interval", schedule.interval}, {"next", finite_or_null(schedule.next)}};
}

ScheduleState schedule_from(const Json& json) {
  const ScheduleState schedule{json.at("interval").get<double>(), null_is_never(json.at("next"))};
  if (!(schedule.next >= 0.0)) throw IoError("the state of the run has an output at a time that is none");
  return schedule;
}

Json output_json(const OutputState& output) {
  return {{"snapshots", schedule_json(output.snapshots)},
          {"rows", schedule_json(output.rows)},
          {"next_analysis", output.next_analysis},
          {"snapshot_number", output.snapshot_number},
          {"wall_seconds", output.wall_seconds}};
}

OutputState output_from(const Json& json) {
  OutputState output;
  output.snapshots = schedule_from(json.at("snapshots"));
  output.rows = schedule_from(json.at("rows"));
  read(json.at("next_analysis"), output.next_analysis);
  read(json.at("snapshot_number"), output.snapshot_number);
  read(json.at("wall_seconds"), output.wall_seconds);
  return output;
}

}  // namespace

std::string to_text(const RunState& state) {
  Json scene = Json::object();
  for (const ResolvedKey& key : state.scene) scene[key.key] = key.value;
  const Json json{{"loop", loop_json(state.loop)},
                  {"budget", budget_json(state.budget)},
                  {"output", output_json(state.output)},
                  {"scene", scene}};
  return json.dump(1);
}

RunState run_state_from(const std::string& text) {
  try {
    const Json json = Json::parse(text);
    RunState state;
    state.loop = loop_from(json.at("loop"));
    state.budget = budget_from(json.at("budget"));
    state.output = output_from(json.at("output"));
    for (const auto& [key, value] : json.at("scene").items()) state.scene.push_back({key, value.get<std::string>()});
    return state;
  } catch (const nlohmann::json::exception& error) {
    throw IoError(std::string("the state of the run cannot be read: ") + error.what());
  }
}

}  // namespace breccia::sim

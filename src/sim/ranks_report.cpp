#include "sim/ranks_report.hpp"

#include <fmt/format.h>

namespace breccia::sim {

std::optional<io::HaloTiming> halo_timing(const grid::Engine& engine, const mpi::Comm& comm) {
  if (comm.size() == 1) return std::nullopt;
  const grid::EngineStats stats = engine.stats();
  io::HaloTiming halo;
  halo.in_flight_seconds = comm.sum(stats.halo_in_flight);
  halo.waited_seconds = comm.sum(stats.halo_waited);
  if (halo.in_flight_seconds > 0.0) halo.hidden_fraction = 1.0 - halo.waited_seconds / halo.in_flight_seconds;
  halo.bytes_per_step = comm.sum(stats.halo_bytes_per_step);
  halo.key_exchanges = comm.max(stats.key_exchanges);
  return halo;
}

void print_halo(const io::HaloTiming& halo) {
  fmt::print("messages of nodes: {:.1f} % of their {:.3g} s under way hidden behind other work, {:.3g} s waited\n",
             100.0 * halo.hidden_fraction, halo.in_flight_seconds, halo.waited_seconds);
  fmt::print("  all ranks: {:.3g} MB a step; keys exchanged at {} sortings\n",
             1e-6 * static_cast<double>(halo.bytes_per_step), halo.key_exchanges);
}

nlohmann::json slabs_json(const TimeLoop& loop, const mpi::Comm& comm) {
  const BalanceState& balance = loop.balance();
  const auto windows = static_cast<double>(balance.windows);
  const std::uint64_t bytes = loop.engine().stats().halo_bytes_per_step;
  return {{"axis", std::string(1, "xyz"[loop.engine().slabs().axis()])},
          {"imbalance_mean", balance.windows > 0 ? balance.imbalance_sum / windows : 1.0},
          {"imbalance_max", balance.imbalance_max},
          {"imbalance", balance.imbalance},
          {"recuts", balance.recuts},
          {"windows", balance.windows},
          {"halo_bytes_mean", static_cast<double>(comm.sum(bytes)) / comm.size()},
          {"halo_bytes_max", comm.max(bytes)}};
}

void print_slabs(const nlohmann::json& slabs) {
  const auto number = [&](const char* key) { return slabs[key].get<double>(); };
  fmt::print(
      "slabs across {}: imbalance of the counted work {:.3f} on average, {:.3f} at most; cut anew {} times in {} "
      "windows; {:.3g} kB of halo sent by a rank in a step, {:.3g} at most\n",
      slabs["axis"].get<std::string>(), number("imbalance_mean"), number("imbalance_max"),
      slabs["recuts"].get<std::uint64_t>(), slabs["windows"].get<std::uint64_t>(), 1e-3 * number("halo_bytes_mean"),
      1e-3 * number("halo_bytes_max"));
}

}  // namespace breccia::sim

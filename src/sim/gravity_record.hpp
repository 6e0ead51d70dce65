// What the evaluations of gravity in a run came to: methods, interactions, bytes, net force.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "gravity/solver.hpp"

namespace breccia::sim {

class GravityRecord {
 public:
  void add(const gravity::Stats& stats);

  /// `evaluations` (of each method), `reason` and `boxes` of the last one; `pairs`, `cell_interactions`, `expansions`
  /// and `bytes_sent` of all ranks; the most `cells_imported` and `particles_imported` by one rank for one evaluation;
  /// `cells_missing` (Stats); `net_force`, the largest |sum(m a)| over sum(m |a|) found before it was taken off.
  /// Null where there was no evaluation. Collective.
  [[nodiscard]] nlohmann::json summary(const mpi::Comm& comm) const;

  /// The method last used and why, if the program chose it; empty where there was no evaluation.
  [[nodiscard]] std::string decision() const;

 private:
  std::map<std::string, std::uint64_t> evaluations_;
  gravity::Stats sums_;  // of what adds up; the last one's method, reason and boxes; the largest net force
};

}  // namespace breccia::sim

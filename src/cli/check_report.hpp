// What `breccia check` says about a scene, for people and for programs.
#pragma once

#include <string>

#include "cli/json_output.hpp"
#include "scene/parse.hpp"
#include "sim/plan.hpp"

namespace breccia::cli {

struct CheckReport {
  scene::LoadedScene loaded;
  sim::Plan plan;
  int ranks = 1;
  double seconds_per_step = 0.0;  ///< wall time of one step on one core [s]

  /// Steps to the end of the scene if the first time step stays.
  [[nodiscard]] double steps() const;
  /// Particle memory of each rank if they share evenly [bytes].
  [[nodiscard]] double memory_per_rank() const;
  /// Wall time of the whole run if the ranks share the work evenly [s].
  [[nodiscard]] double wall_seconds() const;
};

std::string as_text(const CheckReport& report);
/// The keys of docs/usage.md, SI.
Json as_json(const CheckReport& report);

}  // namespace breccia::cli

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
  sim::Calibration calibration{};

  /// Steps to the end of the scene if the first time step stays.
  [[nodiscard]] double steps() const;
  /// Wall time of the whole run if the ranks share the work evenly [s].
  [[nodiscard]] double wall_seconds() const;
};

std::string as_text(const CheckReport& report);
/// The keys of docs/usage.md, SI.
Json as_json(const CheckReport& report);

}  // namespace breccia::cli

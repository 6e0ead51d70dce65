// Speed of an engine on standard states, as a table and as JSON.
#pragma once

#include <string>
#include <vector>

namespace breccia::bench {

/// What to measure; empty lists mean the standard choice.
struct EngineBenchOptions {
  bool quick = false;                ///< the paper's state with all effects only
  std::vector<std::string> cases;    ///< names of engine_cases()
  std::vector<std::string> effects;  ///< names of effect_choices()
  std::string precision;             ///< mixed or double; empty: both
  std::vector<int> cores;            ///< threads
  std::string device = "host";       ///< or cuda: then threads mean nothing
  bool reproducible = false;         ///< each state a second time with numerics.reproducible
  double seconds = 6.0;              ///< least time of a measurement
  std::string json;                  ///< file for the results, "-" for standard output, empty for none
};

/// Measures particle-steps/s and bytes per particle on all ranks together and prints a line for each combination.
/// Collective. Throws UsageError for a name that is unknown or where there is no device, and IoError if the file cannot
/// be written.
void run_engine_bench(const EngineBenchOptions& options);

}  // namespace breccia::bench

// Speed of the host engine on standard states, as a table and as JSON.
#pragma once

#include <string>

namespace breccia::bench {

struct EngineBenchOptions {
  bool quick = false;  ///< small cases, about a minute
  std::string json;    ///< file for the results, "-" for standard output, empty for none
};

/// Measures particle-steps/s and bytes per particle: paper spheres (94,648 particles at 1.41 per cell) and 1e6 at 8 per
/// cell, mixed and double precision, one and two threads. Throws IoError if the file cannot be written.
void run_engine_bench(const EngineBenchOptions& options);

}  // namespace breccia::bench

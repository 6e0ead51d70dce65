// Speed and errors of the gravity solvers on standard states, as a table and as JSON.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace breccia::bench {

struct GravityBenchOptions {
  bool quick = false;                   ///< 94,648 particles only
  std::string states = "abc";           ///< of gravity_states.hpp
  std::vector<std::string> methods;     ///< to measure; empty: all
  std::vector<std::int64_t> particles;  ///< empty: 94,648 and, unless quick, 1e6
  std::vector<double> openings;         ///< of the tree; empty: fast, default and tight
  bool body = false;                    ///< the net force on the first body at more than 100,000 particles too
  int threads = 1;
  int pairs = 5;                    ///< evaluations, each followed by a slice of the direct sum
  std::string device = "host";      ///< "cuda": the device's own solvers, in wall time, against its own direct sum
  std::string precision = "mixed";  ///< of the device's sums
  std::string json;                 ///< file for the results, "-" for standard output, empty for none
};

/// Measures seconds of user CPU time, ratio to the float direct sum of the same run and errors against direct sums in
/// double. Throws IoError if the file cannot be written.
void run_gravity_bench(const GravityBenchOptions& options);

}  // namespace breccia::bench

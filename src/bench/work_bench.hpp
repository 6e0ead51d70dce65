// What the counts by which slabs are balanced stand for: time of one step against counted work, state by state.
#pragma once

#include <string>

namespace breccia::bench {

struct WorkBenchOptions {
  double seconds = 1.0;  ///< least time of a measurement
  std::string json;      ///< file for the results, - for standard output
};

/// Prints and writes the table. The relations of measured to counted time should be the same in all rows: they are what
/// grid/work_weights.hpp and sim/balance.hpp were made from.
void run_work_bench(const WorkBenchOptions& options);

}  // namespace breccia::bench

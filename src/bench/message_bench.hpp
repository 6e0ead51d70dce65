// Latency and bandwidth between two ranks, for the performance model of docs/scaling.md.
#pragma once

#include <string>

namespace breccia::bench {

struct MessageBenchOptions {
  std::string json;  ///< file for the results, - for standard output
};

/// Rank 0 and the last rank exchange messages, as neighbours do; best of several. Collective. Throws UsageError on one
/// rank.
void run_message_bench(const MessageBenchOptions& options);

}  // namespace breccia::bench

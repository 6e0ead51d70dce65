// Durations and sizes as people say them.
#pragma once

#include <string>

namespace breccia::cli {

/// "850 us", "4.2 s", "12 min", "3.5 h", "2.1 d".
std::string human_duration(double seconds);
/// "812 B", "3.4 MiB", "17 GiB".
std::string human_bytes(double bytes);

}  // namespace breccia::cli

#include "cli/human_units.hpp"

#include <fmt/core.h>

#include <span>

namespace breccia::cli {
namespace {

struct Scale {
  double size;
  const char* unit;
};

// The largest scale that `value` reaches, else the first; `scales` ascend.
std::string human(double value, std::span<const Scale> scales) {
  const Scale* best = scales.data();
  for (const Scale& scale : scales) {
    if (value >= scale.size) best = &scale;
  }
  const double scaled = value / best->size;
  return fmt::format("{:.{}f} {}", scaled, scaled < 10.0 ? 1 : 0, best->unit);
}

}  // namespace

std::string human_duration(double seconds) {
  constexpr Scale kScales[] = {{1e-6, "us"}, {1e-3, "ms"}, {1.0, "s"}, {60.0, "min"}, {3600.0, "h"}, {86400.0, "d"}};
  return human(seconds, kScales);
}

std::string human_bytes(double bytes) {
  constexpr double kKibi = 1024.0;
  constexpr Scale kScales[] = {{1.0, "B"},
                               {kKibi, "KiB"},
                               {kKibi * kKibi, "MiB"},
                               {kKibi * kKibi * kKibi, "GiB"},
                               {kKibi * kKibi * kKibi * kKibi, "TiB"}};
  return human(bytes, kScales);
}

}  // namespace breccia::cli

// What the benchmarks share: errors at several resolutions, the observed order, and the record tools/verify reads.
#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "tests/sim/simulation.hpp"

namespace breccia::sim::test {

/// One line of the record, on standard output: case, quantity, resolution, measured, expected, source.
inline void record(const char* name, const char* quantity, double resolution, double measured, double expected,
                   const char* source) {
  std::printf("verification|%s|%s|%.6g|%.8g|%.8g|%s\n", name, quantity, resolution, measured, expected, source);
}

/// Resolutions to run: `quick` always, `finer` as well where tools/verify asks for them.
inline std::vector<int> levels(std::vector<int> quick, const std::vector<int>& finer) {
  if (std::getenv("BRECCIA_FINER_LEVELS") != nullptr) quick.insert(quick.end(), finer.begin(), finer.end());
  return quick;
}

/// Least-squares slope of log|error| over log h, the observed order of convergence. `h_error`: pairs of both.
inline double observed_order(const std::vector<std::pair<double, double>>& h_error) {
  double sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0;
  for (const auto& [h, error] : h_error) {
    const double x = std::log(h), y = std::log(std::abs(error));
    sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  const auto n = static_cast<double>(h_error.size());
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

inline std::string plane(Vec3d point, const char* normal, const std::string& kind) {
  return "[[boundary]]\npoint = [\"" + metres(point.x) + "\", \"" + metres(point.y) + "\", \"" + metres(point.z) +
         "\"]\nnormal = " + normal + "\nkind = \"" + kind + "\"\n";
}

/// Planes that make [0, width] along the axis of `normal` endless.
inline std::string endless(double width, const std::string& normal) {
  const Vec3d far = normal == "[1, 0, 0]"   ? Vec3d{width, 0, 0}
                    : normal == "[0, 1, 0]" ? Vec3d{0, width, 0}
                                            : Vec3d{0, 0, width};
  std::string back = normal;
  back.insert(back.find('1'), "-");
  return plane({}, normal.c_str(), "periodic") + plane(far, back.c_str(), "periodic");
}

/// Planes that make a width of [0, width] in y and z endless.
inline std::string endless_across(double width) { return endless(width, "[0, 1, 0]") + endless(width, "[0, 0, 1]"); }

}  // namespace breccia::sim::test

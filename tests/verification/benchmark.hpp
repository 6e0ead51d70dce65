// What the benchmarks share: errors at several resolutions, the observed order, and the record tools/verify reads.
#pragma once

#include <gtest/gtest.h>

#include <cstdio>
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

/// Planes that make a width of [0, width] in y and z endless.
inline std::string endless_across(double width) {
  return plane({}, "[0, 1, 0]", "periodic") + plane({0, width, 0}, "[0, -1, 0]", "periodic") +
         plane({}, "[0, 0, 1]", "periodic") + plane({0, 0, width}, "[0, 0, -1]", "periodic");
}

}  // namespace breccia::sim::test

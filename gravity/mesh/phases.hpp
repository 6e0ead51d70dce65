// Time and bytes of the parts of an evaluation.
#pragma once

#include <mpi.h>

#include <array>

namespace breccia::gravity {

/// kSort is all that grows with the particles alone: sorting, clusters, trees and their moments. kPairs is the near
/// field or the direct sum, kExchange the choice and transport of locally essential trees, kTree the walk.
enum class Phase { kBoxes, kSort, kAssign, kTransform, kInterpolate, kPairs, kExchange, kTree, kCount };
inline constexpr int kPhases = static_cast<int>(Phase::kCount);
inline constexpr std::array<const char*, kPhases> kPhaseNames{"boxes",       "sort",  "assign",   "transform",
                                                              "interpolate", "pairs", "exchange", "tree"};

struct Phases {
  std::array<double, kPhases> seconds{};
  double bytes_sent = 0.0;

  [[nodiscard]] double& operator[](Phase phase) { return seconds[static_cast<std::size_t>(phase)]; }

  template <class F>
  void time(Phase phase, F&& work) {
    const double start = MPI_Wtime();
    work();
    (*this)[phase] += MPI_Wtime() - start;
  }
};

}  // namespace breccia::gravity

// Time and bytes of the parts of an evaluation.
#pragma once

#include <mpi.h>

#include <array>

namespace breccia::gravity {

enum class Phase { kBoxes, kSort, kAssign, kTransform, kInterpolate, kNear, kUnsplit, kCount };
inline constexpr int kPhases = static_cast<int>(Phase::kCount);
inline constexpr std::array<const char*, kPhases> kPhaseNames{"boxes",       "sort",       "assign", "transform",
                                                              "interpolate", "near field", "tree"};

struct Phases {
  std::array<double, kPhases> seconds{};
  double bytes_sent = 0.0;

  template <class F>
  void time(Phase phase, F&& work) {
    const double start = MPI_Wtime();
    work();
    seconds[static_cast<std::size_t>(phase)] += MPI_Wtime() - start;
  }
};

}  // namespace breccia::gravity

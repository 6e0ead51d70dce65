// Time as the measurements count it: user CPU time of one thread, wall time of several.
#pragma once

#include <mpi.h>
#include <sys/resource.h>

namespace breccia::bench {

struct Timing {
  double user, wall;
};

inline Timing now() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return {static_cast<double>(usage.ru_utime.tv_sec) + 1e-6 * static_cast<double>(usage.ru_utime.tv_usec), MPI_Wtime()};
}

/// One thread's CPU time does not count what other programs take; of several threads it would count the waiting.
inline double since(Timing start, int threads) {
  const Timing end = now();
  return threads == 1 ? end.user - start.user : end.wall - start.wall;
}

}  // namespace breccia::bench

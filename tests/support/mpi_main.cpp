// gtest under MPI: every rank runs every test, rank 0 prints, one failing rank fails all.
#include <gtest/gtest.h>

#include <cstdio>

#include "mpi/comm.hpp"

namespace {

// Failures of ranks other than 0 must be seen too.
class OtherRankPrinter : public testing::EmptyTestEventListener {
  void OnTestPartResult(const testing::TestPartResult& result) override {
    if (!result.failed()) return;
    std::fprintf(stderr, "rank %d: %s:%d: %s\n", breccia::mpi::Comm().rank(),
                 result.file_name() != nullptr ? result.file_name() : "?", result.line_number(), result.message());
  }
};

}  // namespace

int main(int argc, char** argv) {
  const breccia::mpi::Environment environment(&argc, &argv);
  testing::InitGoogleTest(&argc, argv);
  const breccia::mpi::Comm comm;
  if (!comm.is_root()) {
    auto& listeners = testing::UnitTest::GetInstance()->listeners();
    delete listeners.Release(listeners.default_result_printer());
    listeners.Append(new OtherRankPrinter);
  }
  const int failed = RUN_ALL_TESTS();
  return comm.any(failed != 0) ? 1 : 0;
}

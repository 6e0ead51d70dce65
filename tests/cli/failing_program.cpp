// A program whose ranks fail as its argument says, for test_exit_status.py.
#include <unistd.h>

#include <chrono>
#include <stdexcept>
#include <string>

#include "breccia/error.hpp"
#include "cli/exit_status.hpp"
#include "mpi/ending.hpp"

namespace {

void fail(const std::string& how, const breccia::mpi::Comm& comm) {
  const bool last_rank = comm.rank() == comm.size() - 1;
  if (how == "defect") throw std::runtime_error("two\nlines");
  const bool one_fails = how == "one" || how == "last";
  if (how == "all" || (one_fails && last_rank)) throw breccia::NumericsError("the numbers went wrong");
  if (how == "one") comm.barrier();
}

}  // namespace

int main(int argc, char** argv) {
  const breccia::mpi::Environment environment(&argc, &argv);
  breccia::mpi::set_patience_at_end(std::chrono::seconds(1));
  const breccia::mpi::Comm comm;
  const std::string how = argc > 1 ? argv[1] : "none";
  const int status = breccia::cli::exit_status([&] { fail(how, comm); }, comm, std::chrono::seconds(2));
  // A rank that is lost after the last thing that all do together, unseen by the launcher.
  if (how == "lost" && comm.rank() == 1) pause();
  return status;
}

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
  const breccia::mpi::Comm comm;
  const std::string how = argc > 1 ? argv[1] : "none";
  // Little patience only where a rank waits in vain: elsewhere a machine that stalls for a second must not be told as
  // a rank that is lost.
  const std::chrono::seconds little{1};
  const std::chrono::seconds patience = how == "one" ? little : std::chrono::seconds(60);
  if (how == "lost") breccia::mpi::set_patience_at_end(little);
  const int status = breccia::cli::exit_status([&] { fail(how, comm); }, comm, patience);
  // A rank that is lost after the last thing that all do together, unseen by the launcher.
  if (how == "lost" && comm.rank() == 1) pause();
  return status;
}

// A program whose ranks fail as its argument says, for test_exit_status.py.
#include <stdexcept>
#include <string>

#include "breccia/error.hpp"
#include "cli/exit_status.hpp"

namespace {

void fail(const std::string& how, const breccia::mpi::Comm& comm) {
  const bool last_rank = comm.rank() == comm.size() - 1;
  if (how == "defect") throw std::runtime_error("two\nlines");
  if (how == "all" || (how != "none" && last_rank)) throw breccia::NumericsError("the numbers went wrong");
  if (how == "one") comm.barrier();
}

}  // namespace

int main(int argc, char** argv) {
  const breccia::mpi::Environment environment(&argc, &argv);
  const breccia::mpi::Comm comm;
  const std::string how = argc > 1 ? argv[1] : "none";
  return breccia::cli::exit_status([&] { fail(how, comm); }, comm);
}

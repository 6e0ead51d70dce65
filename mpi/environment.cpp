// Start and end of MPI.
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>

#include "mpi/comm.hpp"
#include "mpi/ending.hpp"

namespace breccia::mpi {
namespace {

std::chrono::seconds patience{20};

// What a rank says that waits in vain: made before, as a signal handler may do little more than write it.
char last_words[128] = "";

extern "C" void give_up(int) {
  // Nobody is left to tell that this failed.
  [[maybe_unused]] const auto written = write(STDERR_FILENO, last_words, std::strlen(last_words));
  _exit(1);
}

// Opening a file, Open MPI makes a shared file pointer that nobody here uses. Where all ranks are on one node, a
// semaphore named after the file alone guards it (component sm): a process killed while it holds it leaves it taken,
// and whoever writes a file of that name on that node afterwards waits forever; another user's cannot be opened at all.
// Without that component it is a lock of a file, as it is between nodes, which ends with its process. What the user
// says goes first.
void avoid_named_semaphores() { setenv("OMPI_MCA_sharedfp", "^sm", 0); }

}  // namespace

void set_patience_at_end(std::chrono::seconds seconds) { patience = seconds; }

Environment::Environment(int* argc, char*** argv) {
  avoid_named_semaphores();
  int provided = 0;
  MPI_Init_thread(argc, argv, MPI_THREAD_FUNNELED, &provided);
}

Environment::~Environment() {
  // A rank that gives up ends at once: what it has printed must be out before.
  std::fflush(nullptr);
  std::cout.flush();
  const long long seconds = patience.count();
  std::snprintf(
      last_words, sizeof last_words,
      "breccia: error: rank %d: the end of all other ranks did not come within %lld s; one was killed or hangs\n",
      Comm().rank(), seconds);
  std::signal(SIGALRM, give_up);
  alarm(static_cast<unsigned>(seconds));
  MPI_Finalize();
  alarm(0);
}

}  // namespace breccia::mpi

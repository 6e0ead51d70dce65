// Writes more than the disk takes without having reserved it. HDF5 does not survive that; what is promised is that the
// program ends by itself, with the exit code of an IoError, and that no half file is left. Run by midway.cmake.
#include <sys/resource.h>

#include <csignal>
#include <vector>

#include "io/hdf5.hpp"

int main(int argc, char** argv) {
  const breccia::mpi::Environment environment(&argc, &argv);
  const breccia::mpi::Comm comm;
  std::signal(SIGXFSZ, SIG_IGN);
  const rlimit limit{100000, RLIM_INFINITY};
  setrlimit(RLIMIT_FSIZE, &limit);

  const std::uint64_t each = 20000;
  const breccia::io::h5::Rows rows{each * static_cast<std::uint64_t>(comm.rank()), each};
  std::vector<double> values;
  for (std::uint64_t i = 0; i < each; ++i) values.push_back(1.0 / static_cast<double>(rows.first + i + 3));
  auto file = breccia::io::h5::File::create(argv[1], comm);
  file.write_rows<double>("/values", {each * static_cast<std::uint64_t>(comm.size()), 1, 1024}, rows, values);
  file.close();
  return 0;
}

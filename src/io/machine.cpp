#include "io/machine.hpp"

#include <fmt/format.h>
#include <hdf5.h>
#include <mpi.h>

#include <fstream>
#include <thread>

#include "breccia/isa.hpp"

namespace breccia::io {

namespace {

std::string cpu_model() {
  std::ifstream cpuinfo("/proc/cpuinfo");
  for (std::string line; std::getline(cpuinfo, line);) {
    const std::size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown";
}

std::string compiler() {
#if defined(__clang__)
  return "clang " __clang_version__;
#else
  return "g++ " __VERSION__;
#endif
}

std::string mpi_library() {
  char text[MPI_MAX_LIBRARY_VERSION_STRING] = {};
  int length = 0;
  MPI_Get_library_version(text, &length);
  const std::string version(text, static_cast<std::size_t>(length));
  return version.substr(0, version.find(','));
}

std::string hdf5_library() {
  unsigned major = 0;
  unsigned minor = 0;
  unsigned release = 0;
  H5get_libversion(&major, &minor, &release);
  return fmt::format("{}.{}.{}", major, minor, release);
}

}  // namespace

Machine this_machine() {
  return {cpu_model(), isa_name(active_isa()), static_cast<int>(std::thread::hardware_concurrency())};
}

std::vector<std::pair<std::string, std::string>> library_versions() {
  return {{"breccia", BRECCIA_VERSION}, {"compiler", compiler()}, {"mpi", mpi_library()}, {"hdf5", hdf5_library()}};
}

}  // namespace breccia::io

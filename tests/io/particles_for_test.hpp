// Particles whose every value follows from the id, so that a file can be checked without a second copy, and a folder
// that goes away with the test.
#pragma once

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "breccia/particle_arrays.hpp"
#include "mpi/comm.hpp"

namespace breccia::io::test {

/// The particle `id`; values that use all 52 bits of the mantissa.
inline void append_particle(ParticleOutput& out, std::uint64_t id) {
  const double x = static_cast<double>(id);
  out.id.push_back(id);
  out.position.push_back({1.0e5 * std::sin(x), -4.0e7 * std::cos(x), std::sqrt(x)});
  out.velocity.push_back({std::sin(3.0 * x), 1.0 / (x + 3.0), -x / 7.0});
  out.mass.push_back(1.0e12 / (x + 1.0));
  out.body.push_back(static_cast<std::uint32_t>(id % 2));
  out.material.push_back(static_cast<std::uint32_t>(id % 3));
  out.damage.push_back(0.5 + 0.5 * std::sin(5.0 * x));
  out.density.push_back(2700.0 * (1.0 + 1.0e-12 * x));
  out.grid_density.push_back(1300.0 / (x + 0.1));
  out.internal_energy.push_back(std::exp(-x / 100.0));
  out.pressure.push_back(-1.0e6 * std::cos(x));
  out.shear_stress.push_back(1.0e5 + x);
}

/// The share of this rank of `total` particles, dealt out in a shuffled order; the last of several ranks gets none.
inline ParticleOutput scattered_particles(std::uint64_t total, const mpi::Comm& comm) {
  const auto holders = static_cast<std::uint64_t>(std::max(1, comm.size() - 1));
  ParticleOutput out;
  for (std::uint64_t i = 0; i < total; ++i) {
    const std::uint64_t id = i * 7919 % total;  // the prime visits every id once unless it divides total
    if ((id * 2654435761U) % 1000 % holders == static_cast<std::uint64_t>(comm.rank())) append_particle(out, id);
  }
  return out;
}

/// An empty folder below the build folder, the same on all ranks, removed at the end of the scope.
class ScratchFolder {
 public:
  ScratchFolder(const std::string& name, const mpi::Comm& comm)
      : comm_(comm),
        path_(std::filesystem::path(BRECCIA_BINARY_DIR) / "tests" / (name + "_on_" + std::to_string(comm.size()))) {
    if (comm_.is_root()) {
      std::filesystem::remove_all(path_);
      std::filesystem::create_directories(path_);
    }
    comm_.barrier();
  }
  ~ScratchFolder() {
    comm_.barrier();
    std::error_code ignored;
    if (comm_.is_root()) std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  mpi::Comm comm_;
  std::filesystem::path path_;
};

/// Names in a folder, sorted.
inline std::vector<std::string> names_in(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace breccia::io::test

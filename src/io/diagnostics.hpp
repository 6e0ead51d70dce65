// diagnostics.csv: one line of global figures per output step.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <variant>

#include "breccia/linalg.hpp"
#include "mpi/comm.hpp"

namespace breccia::io {

/// Figures of all ranks together at one time. SI; momenta and energies are sums over the particles.
struct DiagnosticsRow {
  double time = 0.0;
  std::uint64_t step = 0;
  double dt = 0.0;
  std::uint64_t particles = 0;
  double mass = 0.0;
  double momentum_x = 0.0, momentum_y = 0.0, momentum_z = 0.0;
  double angular_momentum_x = 0.0, angular_momentum_y = 0.0, angular_momentum_z = 0.0;
  double kinetic_energy = 0.0;
  double affine_energy = 0.0;
  double internal_energy = 0.0;
  double elastic_energy = 0.0;
  double plastic_energy = 0.0;
  double viscous_energy = 0.0;
  double gravitational_energy = 0.0;
  double energy_residual = 0.0;
  double max_speed = 0.0;
  double min_J = 0.0;
  double max_J = 0.0;
  std::uint64_t clamped_volumes = 0;
  double damaged_fraction = 0.0;
  std::uint64_t active_blocks = 0;
  std::uint64_t particles_per_rank_min = 0;
  std::uint64_t particles_per_rank_max = 0;
  double imbalance = 1.0;
  std::uint64_t recuts = 0;
  double wall_seconds = 0.0;
};

/// One column of diagnostics.csv.
struct DiagnosticsColumn {
  const char* name;
  const char* unit;  ///< "1": a number without unit
  const char* meaning;
  std::variant<double DiagnosticsRow::*, std::uint64_t DiagnosticsRow::*> value;
};

/// All columns in the order of the file.
std::span<const DiagnosticsColumn> diagnostics_columns();

/// The table of the documentation, Markdown.
std::string diagnostics_table();

/// Writes diagnostics.csv; the root has the file, every rank calls.
class DiagnosticsWriter {
 public:
  /// Starts a new file with the line of column names and units. Collective.
  /// Throws IoError, the same on all ranks.
  DiagnosticsWriter(const std::filesystem::path& path, const mpi::Comm& comm);
  /// Continues the file with rows from `first_step` on; what it holds from there is dropped. A new file if there is
  /// none. Collective. Throws IoError, the same on all ranks.
  DiagnosticsWriter(const std::filesystem::path& path, std::uint64_t first_step, const mpi::Comm& comm);

  /// Adds a line, every double with the 17 digits that give it back exactly, and hands it to the operating system.
  /// The root's `row` counts. Collective. Throws IoError (disk full), the same on all ranks.
  void write(const DiagnosticsRow& row);

 private:
  void put(const std::string& line);

  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::filesystem::path path_;
  mpi::Comm comm_;
  std::unique_ptr<std::FILE, Close> file_;  // empty on the other ranks
};

}  // namespace breccia::io

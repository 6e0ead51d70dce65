#include "io/diagnostics.hpp"

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>

#include "breccia/error.hpp"
#include "io/collectively.hpp"
#include "io/durable_file.hpp"

namespace breccia::io {

namespace {

using Row = DiagnosticsRow;

const std::array kColumns{
    DiagnosticsColumn{"time", "s", "simulated time", &Row::time},
    DiagnosticsColumn{"step", "1", "steps done", &Row::step},
    DiagnosticsColumn{"dt", "s", "time step", &Row::dt},
    DiagnosticsColumn{"particles", "1", "number of particles", &Row::particles},
    DiagnosticsColumn{"mass", "kg", "total mass", &Row::mass},
    DiagnosticsColumn{"momentum_x", "kg m/s", "total linear momentum", &Row::momentum_x},
    DiagnosticsColumn{"momentum_y", "kg m/s", "", &Row::momentum_y},
    DiagnosticsColumn{"momentum_z", "kg m/s", "", &Row::momentum_z},
    DiagnosticsColumn{"angular_momentum_x", "kg m2/s",
                      "total angular momentum about the origin, with what the transfer keeps in C",
                      &Row::angular_momentum_x},
    DiagnosticsColumn{"angular_momentum_y", "kg m2/s", "", &Row::angular_momentum_y},
    DiagnosticsColumn{"angular_momentum_z", "kg m2/s", "", &Row::angular_momentum_z},
    DiagnosticsColumn{"kinetic_energy", "J", "sum of m v2 / 2", &Row::kinetic_energy},
    DiagnosticsColumn{"affine_energy", "J",
                      "kinetic energy that the transfer keeps in C: sum of (1 - alpha) m (dx2/4) C:C / 2",
                      &Row::affine_energy},
    DiagnosticsColumn{"internal_energy", "J", "sum of m e", &Row::internal_energy},
    DiagnosticsColumn{"elastic_energy", "J", "stored in elastic shear", &Row::elastic_energy},
    DiagnosticsColumn{"plastic_energy", "J", "dissipated by yielding since the start", &Row::plastic_energy},
    DiagnosticsColumn{"viscous_energy", "J", "dissipated by artificial viscosity since the start",
                      &Row::viscous_energy},
    DiagnosticsColumn{"gravitational_energy", "J",
                      "potential energy of self-gravity and of the uniform field; matter that goes through a periodic "
                      "plane falls on",
                      &Row::gravitational_energy},
    DiagnosticsColumn{"energy_residual", "J", "what the energy budget misses since the start", &Row::energy_residual},
    DiagnosticsColumn{"max_speed", "m/s", "largest particle speed", &Row::max_speed},
    DiagnosticsColumn{"min_J", "1", "smallest volume ratio J", &Row::min_J},
    DiagnosticsColumn{"max_J", "1", "largest volume ratio J", &Row::max_J},
    DiagnosticsColumn{"clamped_volumes", "1",
                      "volume changes since the start that were cut, det(I + dt L) being 0.1 or less",
                      &Row::clamped_volumes},
    DiagnosticsColumn{"damaged_fraction", "1", "mass-weighted mean of the damage D", &Row::damaged_fraction},
    DiagnosticsColumn{"active_blocks", "1", "grid blocks in use, all ranks", &Row::active_blocks},
    DiagnosticsColumn{"particles_per_rank_min", "1", "particles of the emptiest rank", &Row::particles_per_rank_min},
    DiagnosticsColumn{"particles_per_rank_max", "1", "particles of the fullest rank", &Row::particles_per_rank_max},
    DiagnosticsColumn{"imbalance", "1",
                      "largest over mean work of the ranks, counted at the start of the gravity window",
                      &Row::imbalance},
    DiagnosticsColumn{"recuts", "1", "times that slabs were cut anew, on this number of ranks", &Row::recuts},
    DiagnosticsColumn{"wall_seconds", "s", "wall time since the start of the program", &Row::wall_seconds},
};

std::string header_line() {
  std::string line;
  for (const DiagnosticsColumn& column : kColumns) {
    line += fmt::format("{}{} [{}]", line.empty() ? "" : ",", column.name, column.unit);
  }
  return line;
}

std::string text_of(double value) { return fmt::format("{:.17g}", value); }
std::string text_of(std::uint64_t value) { return fmt::format("{}", value); }

std::string line_of(const DiagnosticsRow& row) {
  std::string line;
  for (const DiagnosticsColumn& column : kColumns) {
    if (!line.empty()) line += ',';
    line += std::visit([&](auto member) { return text_of(row.*member); }, column.value);
  }
  return line;
}

// Header and rows of the steps before `first_step`. A line that the end of a run cut off is none.
std::string rows_before(const std::filesystem::path& path, std::uint64_t first_step) {
  std::string kept = header_line() + '\n';
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line) && !file.eof()) {
    const std::size_t comma = line.find(',');
    if (comma == std::string::npos) continue;
    if (std::strtoull(line.c_str() + comma + 1, nullptr, 10) < first_step) kept += line + '\n';
  }
  return kept;
}

}  // namespace

std::span<const DiagnosticsColumn> diagnostics_columns() { return kColumns; }

std::string diagnostics_table() {
  std::string table = "| Column | Unit | Meaning |\n|---|---|---|\n";
  for (const DiagnosticsColumn& column : kColumns) {
    table += fmt::format("| `{}` | {} | {} |\n", column.name, column.unit,
                         *column.meaning != '\0' ? column.meaning : "same");
  }
  return table;
}

DiagnosticsWriter::DiagnosticsWriter(const std::filesystem::path& path, const mpi::Comm& comm)
    : path_(path), comm_(comm) {
  on_root(comm_, [&] {
    file_.reset(std::fopen(path_.c_str(), "w"));
    if (!file_) throw IoError(fmt::format("{}: cannot create: {}", path_.string(), std::strerror(errno)));
    put(header_line());
  });
}

DiagnosticsWriter::DiagnosticsWriter(const std::filesystem::path& path, std::uint64_t first_step, const mpi::Comm& comm)
    : path_(path), comm_(comm) {
  on_root(comm_, [&] {
    write_file(path_, rows_before(path_, first_step));
    file_.reset(std::fopen(path_.c_str(), "a"));
    if (!file_) throw IoError(fmt::format("{}: cannot open: {}", path_.string(), std::strerror(errno)));
  });
}

void DiagnosticsWriter::write(const DiagnosticsRow& row) {
  on_root(comm_, [&] { put(line_of(row)); });
}

void DiagnosticsWriter::put(const std::string& line) {
  const bool written = std::fputs((line + '\n').c_str(), file_.get()) >= 0;
  if (written && std::fflush(file_.get()) == 0) return;
  throw IoError(fmt::format("{}: cannot write: {}", path_.string(), std::strerror(errno)));
}

}  // namespace breccia::io

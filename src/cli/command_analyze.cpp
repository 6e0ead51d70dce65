#include <fmt/core.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "analysis/remnants.hpp"
#include "breccia/error.hpp"
#include "cli/command.hpp"
#include "cli/json_output.hpp"
#include "io/remnants_json.hpp"
#include "io/snapshot.hpp"
#include "scene/units.hpp"

namespace breccia::cli {
namespace {

constexpr double kHour = 3600.0;

struct Options {
  std::string snapshot;
  std::string link = "3";
  std::string json;
};

// "3" counts grid cells, "7.5 km" is a length.
double link_length(const std::string& text, const io::SnapshotHeader& header, const std::string& file) {
  try {
    const scene::Quantity link = scene::parse_quantity(text);
    if (link.dimension == scene::kLength) return link.value;
    if (link.dimension != scene::kPure) throw UsageError("\"" + text + "\" is not a number of cells nor a length");
    if (header.cell <= 0.0) throw UsageError(file + " does not say its grid cell; give a length such as \"7.5 km\"");
    return link.value * header.cell;
  } catch (const UsageError& error) {
    throw UsageError("--link: " + std::string(error.what()));
  }
}

// Particles keep the number of the body they began in, so the heaviest initial body is known at any time.
double heaviest_body(const ParticleArrays& particles, const mpi::Comm& comm) {
  std::uint32_t last = 0;
  for (const std::uint32_t body : particles.body) last = std::max(last, body);
  std::vector<double> mass(comm.max(last) + 1UL, 0.0);
  for (std::size_t i = 0; i < particles.size(); ++i) mass[particles.body[i]] += particles.mass[i];
  comm.sum(std::span(mass));
  return *std::ranges::max_element(mass);
}

void print_remnants(const std::vector<analysis::Remnant>& remnants, double time, double link) {
  fmt::print("t = {:.6g} s, particles within {:.6g} m linked; remnants: {}\n", time, link, remnants.size());
  fmt::print("{:>9} {:>12} {:>11} {:>8} {:>6} {:>6} {:>9}  {}\n", "particles", "mass/kg", "mass/target", "a/km", "b/a",
             "c/a", "period/h", "class");
  for (const analysis::Remnant& r : remnants) {
    fmt::print("{:>9} {:>12.5g} {:>11.5f} {:>8.2f} {:>6.3f} {:>6.3f} {:>9.3g}  {}\n", r.particles, r.mass,
               r.mass_over_target, r.a / 1e3, r.b_over_a, r.c_over_a, r.spin_period / kHour,
               analysis::class_name(r.shape));
  }
}

void analyze(const Options& options, const mpi::Comm& comm) {
  const auto [header, particles] = io::read_snapshot(options.snapshot, comm);
  const double link = link_length(options.link, header, options.snapshot);
  const double target_mass = header.target_mass > 0.0 ? header.target_mass : heaviest_body(particles, comm);
  const std::vector<analysis::Remnant> remnants = analysis::find_remnants(particles, link, target_mass, comm);
  if (comm.is_root() && !is_standard_output(options.json)) print_remnants(remnants, header.time, link);
  write_json(
      {{"time", header.time}, {"link", link}, {"target_mass", target_mass}, {"remnants", io::remnants_json(remnants)}},
      options.json, comm);
}

}  // namespace

void add_analyze(CLI::App& app, Action& action) {
  CLI::App& command = *app.add_subcommand("analyze", "Find the fragments of a snapshot and their shapes");
  const auto options = std::make_shared<Options>();
  command.add_option("snapshot", options->snapshot, "snap_NNNN.hdf, or any HDF5 file with /PartType0")
      ->required()
      ->type_name("SNAPSHOT");
  command.add_option("--link", options->link, "Particles closer than this belong together: cells, or a length [3]")
      ->option_text("CELLS");
  add_json_option(command, options->json);
  command.callback([options, &action] { action = [options](const mpi::Comm& comm) { analyze(*options, comm); }; });
}

}  // namespace breccia::cli

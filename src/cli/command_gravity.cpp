#include <fmt/core.h>

#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "breccia/error.hpp"
#include "cli/command.hpp"
#include "cli/json_output.hpp"
#include "gravity/solver.hpp"
#include "gravity/verify.hpp"
#include "io/foreign_file.hpp"
#include "io/hdf5.hpp"
#include "scene/units.hpp"

namespace breccia::cli {
namespace {

struct Options {
  std::string particles;
  std::string method = "auto";
  std::vector<std::string> settings;
  std::string out;
  std::optional<std::int64_t> verify;
  int threads = 1;
  std::string json;
};

GravityMethod method_named(const std::string& name) {
  if (name == "direct") return GravityMethod::kDirect;
  if (name == "tree") return GravityMethod::kTree;
  if (name == "auto") return GravityMethod::kAuto;
  if (name == "treepm") return GravityMethod::kTreePm;
  throw UsageError("--method " + name + ": there are direct, tree, treepm and auto");
}

double quantity(const std::string& text, const scene::Dimension& dimension, const char* wanted) {
  const scene::Quantity q = scene::parse_quantity(text);
  if (q.dimension != dimension && q.value != 0.0) throw UsageError("\"" + text + "\" is not " + wanted);
  return q.value;
}

// One --set key=value.
void apply(const std::string& setting, gravity::Parameters& parameters) {
  const std::size_t equals = setting.find('=');
  if (equals == std::string::npos) throw UsageError("--set " + setting + ": write --set gravity.key=value");
  const std::string key = setting.substr(0, equals);
  const std::string value = setting.substr(equals + 1);
  try {
    if (key == "gravity.softening") {
      parameters.softening = quantity(value, scene::kLength, "a length such as \"125 m\"");
    } else if (key == "gravity.error") {
      parameters.error = quantity(value, scene::kPure, "a number");
    } else if (key == "gravity.opening") {
      parameters.opening = quantity(value, scene::kPure, "a number");
    } else if (key == "gravity.mesh") {
      parameters.mesh.cell = quantity(value, scene::kLength, "a length such as \"2 km\"");
    } else if (key == "gravity.split") {
      parameters.mesh.split = quantity(value, scene::kPure, "a number");
    } else if (key == "numerics.precision" && (value == "mixed" || value == "double")) {
      parameters.precision = value == "mixed" ? Precision::kMixed : Precision::kDouble;
    } else {
      throw UsageError(
          "there are gravity.softening, gravity.error, gravity.opening, gravity.mesh, gravity.split and "
          "numerics.precision (mixed or double)");
    }
  } catch (const UsageError& error) {
    throw UsageError("--set " + setting + ": " + error.what());
  }
}

// This rank's part of a particle file.
struct Particles {
  std::uint64_t all = 0;
  io::h5::Rows rows;
  std::vector<Vec3d> position;
  std::vector<double> mass;
};

std::uint64_t count_particles(const io::h5::File& file, const std::string& path) {
  for (const char* name : {"/PartType0/Coordinates", "/PartType0/Masses"}) {
    if (!file.exists(name)) throw IoError(path + ": " + name + " is missing");
  }
  const auto coordinates = file.shape("/PartType0/Coordinates");
  const auto masses = file.shape("/PartType0/Masses");
  if (coordinates.size() != 2 || coordinates[1] != 3) {
    throw IoError(path + ": /PartType0/Coordinates must have the shape (N, 3)");
  }
  if (masses.size() != 1 || masses[0] != coordinates[0]) {
    throw IoError(path + ": /PartType0/Masses must have the shape (N), as long as Coordinates");
  }
  return masses[0];
}

Particles read(const std::string& path, const mpi::Comm& comm) {
  io::require_harmless(path, comm);
  const io::h5::File file = io::h5::File::open(path, comm);
  Particles p;
  p.all = count_particles(file, path);
  const auto rank = static_cast<std::uint64_t>(comm.rank());
  const auto ranks = static_cast<std::uint64_t>(comm.size());
  p.rows.first = p.all * rank / ranks;
  p.rows.count = p.all * (rank + 1) / ranks - p.rows.first;
  const auto x = file.read_rows<double>("/PartType0/Coordinates", p.rows, 3);
  p.mass = file.read_rows<double>("/PartType0/Masses", p.rows);
  bool sound = true;
  for (std::size_t i = 0; i < p.mass.size(); ++i) {
    p.position.push_back({x[3 * i], x[3 * i + 1], x[3 * i + 2]});
    sound =
        sound && std::isfinite(x[3 * i] + x[3 * i + 1] + x[3 * i + 2]) && p.mass[i] >= 0.0 && std::isfinite(p.mass[i]);
  }
  if (comm.any(!sound)) throw UsageError(path + ": a particle has a coordinate or mass that is negative or not finite");
  return p;
}

void write(const std::string& path, const Particles& p, std::span<const Vec3d> acceleration,
           std::span<const double> potential, const mpi::Comm& comm) {
  std::vector<double> rows;
  rows.reserve(3 * acceleration.size());
  for (const Vec3d& a : acceleration) rows.insert(rows.end(), {a.x, a.y, a.z});
  io::h5::File file = io::h5::File::create(path, comm);
  file.create_group("/PartType0");
  const auto dataset = [&](const std::string& name, std::uint64_t components, std::span<const double> values,
                           const std::string& units) {
    file.write_rows("/PartType0/" + name, {.rows = p.all, .components = components}, p.rows, values);
    file.write_attribute("/PartType0/" + name, "Units", units);
  };
  dataset("Acceleration", 3, rows, "m/s2");
  dataset("Potential", 1, potential, "J/kg");
  file.close();
}

void report(const Options& options, const Particles& p, const gravity::Stats& stats,
            const std::optional<gravity::FieldErrors>& errors, const mpi::Comm& comm) {
  const double pairs = comm.sum(stats.pairs);
  const double seconds = comm.max(stats.seconds);
  nlohmann::ordered_json json{{"particles", p.all},
                              {"method", options.method},
                              {"ranks", comm.size()},
                              {"threads", options.threads},
                              {"seconds", seconds},
                              {"pairs", pairs},
                              {"net_force", stats.momentum_error}};
  if (errors) {
    json["verify"] = {{"targets", errors->targets},
                      {"rms", errors->rms},
                      {"median", errors->median},
                      {"p99", errors->p99},
                      {"max", errors->max}};
  }
  if (comm.is_root() && !is_standard_output(options.json)) {
    fmt::print("{} particles, {}: {:.3g} s, {:.3g} pairs, net force {:.1e} of sum m|a|\n", p.all, options.method,
               seconds, pairs, stats.momentum_error);
    if (errors) {
      fmt::print("error against direct sums of {} particles: rms {:.2e}, median {:.2e}, 99 % {:.2e}, max {:.2e}\n",
                 errors->targets, errors->rms, errors->median, errors->p99, errors->max);
    }
  }
  write_json(json, options.json, comm);
}

void compute(const Options& options, const mpi::Comm& comm) {
  gravity::Parameters parameters;
  for (const std::string& setting : options.settings) apply(setting, parameters);
  const auto solver = gravity::make_solver(method_named(options.method), parameters, comm, options.threads);
  const Particles p = read(options.particles, comm);
  std::vector<Vec3d> acceleration(p.position.size());
  std::vector<double> potential(p.position.size());
  const gravity::ParticlesView view{p.position, p.mass};
  solver->evaluate(view, acceleration, potential);
  write(options.out, p, acceleration, potential, comm);
  std::optional<gravity::FieldErrors> errors;
  if (options.verify) {
    errors = gravity::verify(view, acceleration, parameters.softening, *options.verify, comm, options.threads);
  }
  report(options, p, solver->last(), errors, comm);
}

}  // namespace

void add_gravity(CLI::App& app, Action& action) {
  CLI::App& command = *app.add_subcommand("gravity", "Accelerations and potentials of a particle file");
  const auto options = std::make_shared<Options>();
  command.add_option("particles", options->particles, "HDF5 file with /PartType0/Coordinates [m] and Masses [kg]")
      ->required()
      ->type_name("PARTICLES");
  command.add_option("--method", options->method, "direct, tree, treepm or auto [auto]")->option_text("METHOD");
  command
      .add_option("--set", options->settings,
                  "gravity.softening, gravity.error, gravity.opening, gravity.mesh, gravity.split; may be repeated")
      ->option_text("KEY=VALUE");
  command.add_option("--out", options->out, "File for /PartType0/Acceleration [m/s2] and Potential [J/kg]")
      ->required()
      ->option_text("FILE");
  command.add_option("--verify", options->verify, "Compare so many random particles with direct sums in double")
      ->check(CLI::PositiveNumber)
      ->option_text("M");
  command.add_option("--threads", options->threads, "Threads per rank [1]")->check(CLI::Range(1, 1024));
  add_json_option(command, options->json);
  command.callback([options, &action] { action = [options](const mpi::Comm& comm) { compute(*options, comm); }; });
}

}  // namespace breccia::cli

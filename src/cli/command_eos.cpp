#include <fmt/core.h>

#include <memory>
#include <string>

#include "breccia/error.hpp"
#include "breccia/material_parameters.hpp"
#include "cli/command.hpp"
#include "cli/json_output.hpp"
#include "material/eos.hpp"

namespace breccia::cli {
namespace {

struct Options {
  std::string material;
  double density = 0.0;  ///< [kg/m3]
  double energy = 0.0;   ///< specific [J/kg]
  std::string json;
};

// The presets of scene files are the materials known by name.
MaterialParameters preset(const std::string& name) {
  MaterialParameters basalt;
  if (name != basalt.name) throw UsageError("unknown material \"" + name + "\"; known: " + basalt.name);
  return basalt;
}

void print_state(const Options& options, const mpi::Comm& comm) {
  const material::EosPoint point =
      material::evaluate_eos(preset(options.material).eos, options.density, options.energy);
  if (comm.is_root() && !is_standard_output(options.json)) {
    fmt::print("pressure             {:.17g} Pa\n", point.pressure);
    fmt::print("sound speed          {:.17g} m/s\n", point.sound_speed);
    fmt::print("sound speed squared  {:.17g} m2/s2 (not floored)\n", point.sound_speed_squared);
    fmt::print("branch               {}\n", material::eos_branch_name(point.branch));
  }
  write_json({{"pressure", point.pressure},
              {"sound_speed", point.sound_speed},
              {"sound_speed_squared", point.sound_speed_squared},
              {"branch", material::eos_branch_name(point.branch)}},
             options.json, comm);
}

}  // namespace

void add_eos(CLI::App& app, Action& action) {
  CLI::App& command = *app.add_subcommand("eos", "Print pressure and sound speed of a material at one state");
  const auto options = std::make_shared<Options>();
  command.add_option("material", options->material, "Name of a preset: basalt")->required()->type_name("MATERIAL");
  command.add_option("--density", options->density, "Density in kg/m3")->required()->type_name("RHO");
  command.add_option("--energy", options->energy, "Specific internal energy in J/kg")->required()->type_name("E");
  add_json_option(command, options->json);
  command.callback([options, &action] { action = [options](const mpi::Comm& comm) { print_state(*options, comm); }; });
}

}  // namespace breccia::cli

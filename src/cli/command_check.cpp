#include <fmt/core.h>

#include <memory>
#include <string>

#include "cli/check_report.hpp"
#include "cli/command.hpp"
#include "cli/json_output.hpp"
#include "cli/scene_options.hpp"
#include "io/collectively.hpp"
#include "sim/plan.hpp"

namespace breccia::cli {
namespace {

struct Options {
  SceneOptions scene;
  std::string json;
};

CheckReport make_report(const SceneOptions& options, const mpi::Comm& comm) {
  CheckReport report{.loaded = load(options, comm), .plan = {}, .ranks = comm.size(), .calibration = {}};
  report.plan = sim::make_plan(report.loaded.scene);
  // The calibration is a short run on one core; the other ranks keep still meanwhile.
  io::on_root(comm, [&] { report.calibration = sim::calibrate(report.loaded.scene, comm.size()); });
  return report;
}

void check(const Options& options, const mpi::Comm& comm) {
  const CheckReport report = make_report(options.scene, comm);
  if (comm.is_root() && !is_standard_output(options.json)) fmt::print("{}", as_text(report));
  write_json(as_json(report), options.json, comm);
}

}  // namespace

void add_check(CLI::App& app, Action& action) {
  CLI::App& command = *app.add_subcommand("check", "Validate a scene and print the plan, without running it");
  const auto options = std::make_shared<Options>();
  add_scene_options(command, options->scene);
  add_json_option(command, options->json);
  command.callback([options, &action] { action = [options](const mpi::Comm& comm) { check(*options, comm); }; });
}

}  // namespace breccia::cli

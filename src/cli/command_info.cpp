#include <fmt/core.h>

#include "breccia/precision.hpp"
#include "cli/command.hpp"
#include "gravity/mesh/fft_plan.hpp"
#include "grid/device.hpp"
#include "io/machine.hpp"

namespace breccia::cli {
namespace {

void print_info(const mpi::Comm& comm) {
  const io::Machine machine = io::this_machine();
  if (!comm.is_root()) return;
  for (const auto& [name, version] : io::library_versions()) fmt::print("{:<9} {}\n", name, version);
  fmt::print("fftw      {}\n", gravity::fft_library());
  fmt::print("simd      {}: {} floats or {} doubles at a time\n", machine.instruction_set, MixedPrecision::kLanes,
             DoublePrecision::kLanes);
  fmt::print("cuda      {}\n", grid::describe_cuda());
  fmt::print("devices   host: {}, {} hardware threads\n", machine.cpu_model, machine.cores);
}

}  // namespace

void add_info(CLI::App& app, Action& action) {
  CLI::App& command = *app.add_subcommand("info", "Print versions, instruction set and devices");
  command.callback([&action] { action = print_info; });
}

}  // namespace breccia::cli

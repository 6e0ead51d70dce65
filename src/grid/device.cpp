#include "grid/device.hpp"

#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>
#include <utility>

#include "breccia/error.hpp"
#include "cuda/device_plan.hpp"
#include "cuda/plugin_interface.hpp"

namespace breccia::grid {
namespace {

struct Plugin {
  const cuda::PluginInterface* interface = nullptr;
  std::string why_not;
  bool in_this_build = true;
};

std::string library_path() {
  const char* given = std::getenv("BRECCIA_CUDA_LIBRARY");
  if (given != nullptr) return given;
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  return (program.parent_path() / cuda::kLibrary).string();
}

Plugin load_plugin() {
  const std::string path = library_path();
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return {nullptr, "this build has no CUDA engine", false};
  void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);  // stays: engines come from it
  if (library == nullptr) return {nullptr, dlerror()};
  using Entry = const cuda::PluginInterface* (*)();
  const auto entry = reinterpret_cast<Entry>(dlsym(library, cuda::kEntry));
  if (entry == nullptr) return {nullptr, path + " is not a CUDA engine of breccia"};
  if (std::string(entry()->version) != BRECCIA_VERSION) return {nullptr, path + " belongs to another version"};
  return {entry(), ""};
}

// Once: a failed attempt would fail again.
const Plugin& plugin() {
  static const Plugin the_plugin = load_plugin();
  return the_plugin;
}

int rank_on_node(const mpi::Comm& comm) {
  MPI_Comm node = MPI_COMM_NULL;
  MPI_Comm_split_type(comm.handle(), MPI_COMM_TYPE_SHARED, comm.rank(), MPI_INFO_NULL, &node);
  int rank = 0;
  MPI_Comm_rank(node, &rank);
  MPI_Comm_free(&node);
  return rank;
}

// The device of this process and why it has none.
std::pair<std::string, std::string> select(int local_rank, Precision precision) {
  if (plugin().interface == nullptr) return {"", plugin().why_not};
  std::string name;
  const char* why_not = plugin().interface->select_device(local_rank, precision, name);
  return {name, why_not == nullptr ? "" : why_not};
}

// Ranks that share a device take turns.
std::string warning_of_sharing(const mpi::Comm& comm) {
  const auto most = comm.max(static_cast<std::uint64_t>(plugin().interface->ranks_on_device(comm)));
  if (most == 1) return "";
  return "up to " + std::to_string(most) +
         " ranks share a CUDA device and wait for each other: one rank for each "
         "device is faster";
}

std::unique_ptr<Engine> make_cuda_engine(const EngineSetup& setup, const mpi::Comm& comm) {
  return std::unique_ptr<Engine>(plugin().interface->make_engine(setup, comm));
}

}  // namespace

EngineChoice choose_engine(Device wanted, Precision precision, const mpi::Comm& comm, DeviceMessages messages) {
  if (wanted == Device::kHost) return {&make_host_engine, "host", "", "", ""};
  auto [name, why_not] = select(rank_on_node(comm), precision);
  if (!comm.any(!why_not.empty())) {
    return {&make_cuda_engine, "cuda", warning_of_sharing(comm), name,
            plugin().interface->describe_messages(messages, comm)};
  }
  if (why_not.empty()) why_not = "other ranks have no CUDA device";
  if (wanted == Device::kCuda) {
    throw UsageError("--device cuda: " + why_not + "; use --device host or auto");
  }
  return {&make_host_engine, "host", "", plugin().in_this_build ? why_not : "", ""};
}

bool device_memory(const cuda::DevicePlan& plan, cuda::DeviceMemory& memory) {
  if (plugin().interface == nullptr) return false;
  memory = plugin().interface->memory_of(plan);
  return true;
}

std::string describe_cuda() {
  const auto [name, why_not] = select(0, Precision::kMixed);
  return why_not.empty() ? name : why_not;
}

}  // namespace breccia::grid

// What the library of the CUDA engine exports. Read by the program (grid/device.cpp), which needs nothing of CUDA.
#pragma once

#include "grid/engine.hpp"

namespace breccia::cuda {

/// Name of the library, beside the program. BRECCIA_CUDA_LIBRARY names another file.
inline constexpr const char* kLibrary = "libbreccia_cuda.so";

struct DevicePlan;
struct DeviceMemory;

struct PluginInterface {
  /// Of the program that the library was built with: classes are shared, so it must be the same.
  const char* version;
  /// Why no device can be used in this precision, or null. `name` gets the device of this process, the `local_rank`-th
  /// on its node.
  const char* (*select_device)(int local_rank, Precision precision, std::string& name);
  /// How many ranks use the selected device. Collective.
  int (*ranks_on_device)(const mpi::Comm& comm);
  /// How `wanted` lets devices of several ranks exchange sums, in words; empty on one rank. Collective. Throws
  /// UsageError if it cannot be.
  std::string (*describe_messages)(DeviceMessages wanted, const mpi::Comm& comm);
  /// What a run will take of a device (device_plan.hpp). Needs none.
  DeviceMemory (*memory_of)(const DevicePlan& plan);
  /// On the selected device; for the caller to delete.
  grid::Engine* (*make_engine)(const grid::EngineSetup& setup, const mpi::Comm& comm);
};

/// The one symbol that is looked up: const PluginInterface* breccia_cuda_plugin().
inline constexpr const char* kEntry = "breccia_cuda_plugin";

}  // namespace breccia::cuda

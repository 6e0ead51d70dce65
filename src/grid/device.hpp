// Where a run computes. The CUDA engine is a library of its own that is loaded at run time: the program starts and runs
// without toolkit, driver and device.
#pragma once

#include <string>

#include "grid/engine.hpp"

namespace breccia::cuda {
struct DevicePlan;
struct DeviceMemory;
}  // namespace breccia::cuda

namespace breccia::grid {

enum class Device { kAuto, kHost, kCuda };

struct EngineChoice {
  EngineMaker make;
  std::string device;   ///< "host" or "cuda"
  std::string warning;  ///< to be printed; the same on all ranks
  std::string reason;   ///< of a device: its name; of the host: why no CUDA device, empty where none was to be expected
  std::string messages;  ///< what carries sums between the devices of several ranks; empty where there are none
};

/// The engine to use, the same on all ranks: that of this node's CUDA devices, if every rank can have one, for kAuto
/// and kCuda. Collective. Throws UsageError if kCuda cannot be had, or on devices `messages`.
EngineChoice choose_engine(Device wanted, Precision precision, const mpi::Comm& comm,
                           DeviceMessages messages = DeviceMessages::kMpi);

/// What a run will take of CUDA devices (cuda/device_plan.hpp), whether there are any or not. False: this build has no
/// CUDA engine that could tell.
bool device_memory(const cuda::DevicePlan& plan, cuda::DeviceMemory& memory);

/// The CUDA device of this process as `breccia info` names it, or why there is none.
std::string describe_cuda();

}  // namespace breccia::grid

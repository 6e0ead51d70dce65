#include "cuda/halo_messages.hpp"

#include "breccia/error.hpp"
#include "cuda/device_memory.hpp"
#include "cuda/device_mpi.hpp"
#include "cuda/mpi_messages.hpp"
#include "cuda/nccl_messages.hpp"
#include "mpi/together.hpp"

namespace breccia::cuda {
namespace {

// "NCCL 2.28.9". Throws UsageError on all ranks, with what is missing.
std::string require_nccl(const mpi::Comm& comm) {
  std::string version;
  mpi::together<UsageError>(comm, [&] { version = nccl::describe(nccl::load()); });
  const auto sharing = comm.max(static_cast<std::int32_t>(ranks_on_device(comm)));
  if (sharing > 1) {
    throw UsageError("up to " + std::to_string(sharing) + " ranks share a CUDA device, and NCCL needs one for each");
  }
  return version;
}

MessageChoice by_mpi() {
  if (mpi_takes_device_memory()) return {MessageWay::kDeviceMpi, "MPI, from device to device"};
  return {MessageWay::kPinnedMpi, "MPI, by way of pinned host memory"};
}

}  // namespace

MessageChoice choose_messages(DeviceMessages wanted, const mpi::Comm& comm) {
  if (comm.size() == 1) return {MessageWay::kPinnedMpi, ""};
  if (wanted == DeviceMessages::kMpi) return by_mpi();
  try {
    return {MessageWay::kNccl, require_nccl(comm)};
  } catch (const UsageError& error) {
    if (wanted == DeviceMessages::kNccl) {
      throw UsageError(std::string("parallel.device_messages = \"nccl\": ") + error.what() +
                       "; use \"mpi\" or \"auto\"");
    }
    MessageChoice choice = by_mpi();
    choice.description += std::string(" (no NCCL: ") + error.what() + ")";
    return choice;
  }
}

std::unique_ptr<HaloMessages> make_halo_messages(MessageWay way, std::size_t block_bytes, const mpi::Comm& comm) {
  if (way == MessageWay::kNccl) return std::make_unique<NcclMessages>(nccl::load(), block_bytes, comm);
  return std::make_unique<MpiMessages>(way == MessageWay::kDeviceMpi, block_bytes, comm);
}

}  // namespace breccia::cuda

#include "cuda/halo_messages.hpp"

#include <cstdlib>
#include <string_view>

#include "breccia/error.hpp"
#include "cuda/device_memory.hpp"
#include "cuda/device_mpi.hpp"
#include "cuda/mpi_messages.hpp"
#include "cuda/nccl_messages.hpp"
#include "cuda/stream_signal.hpp"
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

bool is_set_to(const char* variable, std::string_view value) {
  const char* found = std::getenv(variable);
  return found != nullptr && found == value;
}

// Not where the host waits for every launch: it would for one behind messages that it has still to exchange.
bool stream_can_wait() {
  return !is_set_to("BRECCIA_MPI_AHEAD", "0") && !is_set_to("CUDA_LAUNCH_BLOCKING", "1") && StreamSignal::works();
}

// The same on all ranks, so that each waits for the others at the same steps.
bool can_be_ahead(bool direct, const mpi::Comm& comm) {
  if (comm.any(!stream_can_wait() || (direct && !device_sees_messages()))) return false;
  return !direct || mpi_goes_on_beside_a_wait(comm);
}

MessageChoice by_mpi(const mpi::Comm& comm) {
  const bool direct = !comm.any(!mpi_takes_device_memory());
  MessageChoice choice{direct ? MessageWay::kDeviceMpi : MessageWay::kPinnedMpi,
                       direct ? "MPI, from device to device" : "MPI, by way of pinned host memory"};
  choice.ahead = can_be_ahead(direct, comm);
  if (!choice.ahead) choice.description += ", waited for in every step";
  return choice;
}

}  // namespace

MessageChoice choose_messages(DeviceMessages wanted, const mpi::Comm& comm) {
  if (comm.size() == 1) return {MessageWay::kPinnedMpi, ""};
  if (wanted == DeviceMessages::kMpi) return by_mpi(comm);
  try {
    return {MessageWay::kNccl, require_nccl(comm)};
  } catch (const UsageError& error) {
    if (wanted == DeviceMessages::kNccl) {
      throw UsageError(std::string("parallel.device_messages = \"nccl\": ") + error.what() +
                       "; use \"mpi\" or \"auto\"");
    }
    MessageChoice choice = by_mpi(comm);
    choice.description += std::string(" (no NCCL: ") + error.what() + ")";
    return choice;
  }
}

std::unique_ptr<HaloMessages> make_halo_messages(const MessageChoice& choice, std::size_t block_bytes,
                                                 const mpi::Comm& comm) {
  if (choice.way == MessageWay::kNccl) return std::make_unique<NcclMessages>(nccl::load(), block_bytes, comm);
  return std::make_unique<MpiMessages>(choice.way == MessageWay::kDeviceMpi, choice.ahead, block_bytes, comm);
}

}  // namespace breccia::cuda

#include "cuda/nccl_messages.hpp"

#include <chrono>
#include <cstring>
#include <exception>
#include <future>
#include <set>
#include <thread>
#include <utility>

#include "breccia/error.hpp"
#include "cuda/device_array.hpp"
#include "cuda/stream.hpp"
#include "mpi/together.hpp"

namespace breccia::cuda {
namespace {

// What is under way on this device ends as soon as the call has begun, and must before memory of the device is given
// back, which waits for all of it. The call itself returns only after all ranks of the node have made it: it gets a
// thread of its own, which is left to the end of the program where they do not come.
void abandon(const nccl::Library& library, nccl::Handle handle) {
  constexpr std::chrono::seconds kPatience{2};
  std::packaged_task<void()> task([abort = library.comm_abort, handle] { (void)abort(handle); });
  const std::future<void> done = task.get_future();
  std::thread(std::move(task)).detach();
  (void)done.wait_for(kPatience);
}

}  // namespace

NcclCommunicator::NcclCommunicator(const nccl::Library& library, const mpi::Comm& comm)
    : library_(library), exceptions_(std::uncaught_exceptions()) {
  nccl::UniqueId id{};
  mpi::together<IoError>(comm, [&] {
    if (comm.is_root()) library_.check(library_.get_unique_id(&id), "start");
  });
  MPI_Bcast(&id, sizeof id, MPI_BYTE, 0, comm.handle());
  library_.check(library_.comm_init_rank(&handle_, comm.size(), id, comm.rank()), "communicator");
}

NcclCommunicator::~NcclCommunicator() {
  if (handle_ == nullptr) return;
  if (std::uncaught_exceptions() == exceptions_) {
    (void)library_.comm_destroy(handle_);
  } else {
    abandon(library_, handle_);
  }
}

void NcclCommunicator::exchange(const std::vector<HaloPart>& parts, std::size_t block_bytes, const void* from, void* to,
                                cudaStream_t stream) const {
  const auto* out = static_cast<const std::byte*>(from);
  auto* in = static_cast<std::byte*>(to);
  library_.check(library_.group_start(), "messages");
  for (const HaloPart& part : parts) {
    const std::size_t bytes = part.blocks * block_bytes;
    library_.check(library_.send(out, bytes, nccl::kBytes, part.rank, handle_, stream), "message to another rank");
    library_.check(library_.recv(in, bytes, nccl::kBytes, part.rank, handle_, stream), "message of another rank");
    out += bytes;
    in += bytes;
  }
  library_.check(library_.group_end(), "messages");
}

void NcclCommunicator::look_for_errors() {
  nccl::Result error = nccl::kSuccess;
  library_.check(library_.comm_get_async_error(handle_, &error), "state of the messages");
  if (error == nccl::kSuccess) return;
  abandon(library_, std::exchange(handle_, nullptr));
  throw IoError(std::string("NCCL: messages between ranks: ") + library_.get_error_string(error) +
                "; go on from the last checkpoint with --restart auto");
}

NcclMessages::NcclMessages(const nccl::Library& library, std::size_t block_bytes, const mpi::Comm& comm)
    : block_bytes_(block_bytes), comm_(comm), communicator_(library, comm) {
  greet_neighbours();
}

// Connections are made at first use: most of the memory that they take of a device is taken here, before what is free
// is counted.
void NcclMessages::greet_neighbours() {
  const int ranks = comm_.size();
  std::vector<HaloPart> parts;
  for (const int rank : std::set{(comm_.rank() + 1) % ranks, (comm_.rank() + ranks - 1) % ranks}) {
    parts.push_back({rank, 1});
  }
  const std::vector<int> own(parts.size(), comm_.rank());
  Stream stream;
  DeviceArray<int> sent(parts.size()), received(parts.size());
  sent.upload(own, stream);
  received.fill_bytes(0xff, stream);
  communicator_.exchange(parts, sizeof(int), sent.data(), received.data(), stream);
  watch(stream);
  const std::vector<int> came = received.download(parts.size(), stream);
  mpi::together<IoError>(comm_, [&] {
    for (std::size_t n = 0; n < parts.size(); ++n) {
      if (came[n] == parts[n].rank) continue;
      throw IoError("NCCL: the first message of rank " + std::to_string(parts[n].rank) + " to rank " +
                    std::to_string(comm_.rank()) +
                    " did not come as it was sent; run with parallel.device_messages = \"mpi\"");
    }
  });
}

void NcclMessages::set(std::vector<HaloPart> parts, const void* sent, void* received) {
  parts_ = std::move(parts);
  sent_ = sent;
  received_ = received;
  // MPI tells messages of different length, NCCL waits for ever or leaves the rest.
  std::vector<std::vector<std::uint64_t>> mine(static_cast<std::size_t>(comm_.size()), std::vector<std::uint64_t>{0});
  for (const HaloPart& part : parts_) mine[static_cast<std::size_t>(part.rank)][0] = part.blocks;
  const auto theirs = comm_.alltoall(mine);
  mpi::together<NumericsError>(comm_, [&] {
    for (std::size_t rank = 0; rank < mine.size(); ++rank) {
      if (theirs[rank] == mine[rank]) continue;
      throw NumericsError("internal error: rank " + std::to_string(comm_.rank()) + " shares " +
                          std::to_string(mine[rank][0]) + " blocks with rank " + std::to_string(rank) +
                          ", which shares " + std::to_string(theirs[rank][0]) + " with it");
    }
  });
}

void NcclMessages::start(cudaStream_t stream) {
  communicator_.exchange(parts_, block_bytes_, sent_, received_, stream);
}

// A message of a rank that is gone never comes, and neither does the end of the stream.
void NcclMessages::watch(cudaStream_t stream) {
  for (;;) {
    const cudaError_t status = cudaStreamQuery(stream);
    communicator_.look_for_errors();
    if (status != cudaErrorNotReady) return check(status, "messages between ranks");
    std::this_thread::yield();
  }
}

}  // namespace breccia::cuda

// NCCL as the engine calls it, for the emulated device: what a group sends and receives is carried out by MPI when the
// stream gets there. A message that is missing, shorter or longer than expected is an asynchronous error, after a
// while. BRECCIA_NCCL_FAULT plants one: old (the library is), lost (a message of rank 1 is never sent, its third
// group's first), short (that message has a byte less), wrong (the first message of all holds something else).
#include <mpi.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <memory>
#include <string_view>
#include <thread>
#include <vector>

#include "cuda/nccl_library.hpp"

using breccia::cuda::nccl::kSuccess;
using breccia::cuda::nccl::OpaqueComm;
using breccia::cuda::nccl::Result;
using breccia::cuda::nccl::UniqueId;

namespace {

constexpr Result kInvalidArgument = 4;
constexpr Result kInvalidUsage = 5;
constexpr Result kRemoteError = 6;
constexpr std::uint64_t kFaultyGroup = 3;

// BRECCIA_NCCL_PATIENCE [s]: how long a message may take.
double patience() {
  const char* wanted = std::getenv("BRECCIA_NCCL_PATIENCE");
  return wanted == nullptr ? 60.0 : std::strtod(wanted, nullptr);
}

bool planted(std::string_view fault) {
  const char* wanted = std::getenv("BRECCIA_NCCL_FAULT");
  return wanted != nullptr && wanted == fault;
}

struct Ranks {
  MPI_Comm comm = MPI_COMM_NULL;
  int rank = 0;
  int size = 0;
  std::uint64_t groups = 0;
  Result error = kSuccess;
};

struct Message {
  void* memory;
  std::size_t bytes;
  int peer;
  bool is_sent;
};

// What is called between group_start and group_end, of one stream.
struct Group {
  bool open = false;
  std::vector<Message> messages;
  std::shared_ptr<Ranks> ranks;
  EmulatedStream* stream = nullptr;
};
Group group;

void spoil(Ranks& ranks, std::vector<Message>& messages) {
  if (ranks.rank != 1) return;
  if (planted("lost") && ranks.groups == kFaultyGroup) messages.erase(messages.begin());
  if (planted("short") && ranks.groups == kFaultyGroup) --messages.front().bytes;
  if (planted("wrong") && ranks.groups == 1) *static_cast<char*>(messages.front().memory) ^= 1;
}

bool all_done(std::vector<MPI_Request>& requests, std::vector<MPI_Status>& states) {
  const auto begin = std::chrono::steady_clock::now();
  const auto count = static_cast<int>(requests.size());
  int done = 0;
  while (done == 0) {
    if (MPI_Testall(count, requests.data(), &done, states.data()) != MPI_SUCCESS) return false;
    const std::chrono::duration<double> since = std::chrono::steady_clock::now() - begin;
    if (since.count() > patience()) return false;
  }
  return true;
}

void carry_out(Ranks& ranks, std::vector<Message> messages) {
  if (ranks.error != kSuccess) return;  // as nothing happens any more on a communicator that is broken
  ++ranks.groups;
  spoil(ranks, messages);
  std::vector<MPI_Request> requests(messages.size());
  std::vector<MPI_Status> states(messages.size());
  for (std::size_t n = 0; n < messages.size(); ++n) {
    const Message& m = messages[n];
    const auto bytes = static_cast<int>(m.bytes);
    const auto tag = static_cast<int>(ranks.groups % 32768);  // so that no later message passes for a lost one
    if (m.is_sent) {
      MPI_Isend(m.memory, bytes, MPI_BYTE, m.peer, tag, ranks.comm, &requests[n]);
    } else {
      MPI_Irecv(m.memory, bytes, MPI_BYTE, m.peer, tag, ranks.comm, &requests[n]);
    }
  }
  if (!all_done(requests, states)) {
    for (MPI_Request& request : requests) {
      if (request == MPI_REQUEST_NULL) continue;
      MPI_Cancel(&request);
      MPI_Request_free(&request);
    }
    ranks.error = kRemoteError;
    return;
  }
  for (std::size_t n = 0; n < messages.size(); ++n) {
    int came = 0;
    MPI_Get_count(&states[n], MPI_BYTE, &came);
    if (!messages[n].is_sent && came != static_cast<int>(messages[n].bytes)) ranks.error = kInvalidUsage;
  }
}

}  // namespace

struct breccia::cuda::nccl::OpaqueComm {
  std::shared_ptr<Ranks> ranks;
};

namespace {

Result add(Message message, OpaqueComm* comm, EmulatedStream* stream) {
  const bool of_group = group.open && (group.stream == nullptr || group.stream == stream);
  if (!of_group || message.peer < 0 || message.peer >= comm->ranks->size) return kInvalidUsage;
  group.messages.push_back(message);
  group.ranks = comm->ranks;
  group.stream = stream;
  return kSuccess;
}

}  // namespace

#define NCCL_FUNCTION extern "C" __attribute__((visibility("default")))

// NOLINTBEGIN(readability-identifier-naming): NCCL's names
NCCL_FUNCTION Result ncclGetVersion(int* version) {
  *version = planted("old") ? 2604 : 22809;
  return kSuccess;
}

NCCL_FUNCTION Result ncclGetUniqueId(UniqueId* id) {
  std::memset(id->internal, 7, sizeof id->internal);
  return kSuccess;
}

NCCL_FUNCTION Result ncclCommInitRank(OpaqueComm** comm, int ranks, UniqueId id, int rank) {
  auto of_world = std::make_shared<Ranks>();
  MPI_Comm_dup(MPI_COMM_WORLD, &of_world->comm);
  MPI_Comm_set_errhandler(of_world->comm, MPI_ERRORS_RETURN);
  MPI_Comm_rank(of_world->comm, &of_world->rank);
  MPI_Comm_size(of_world->comm, &of_world->size);
  // An id that was not broadcast, or other ranks than all, in their order.
  for (const char c : id.internal) {
    if (c != 7) return kInvalidArgument;
  }
  if (of_world->size != ranks || of_world->rank != rank) return kInvalidArgument;
  *comm = new OpaqueComm{of_world};
  return kSuccess;
}

NCCL_FUNCTION Result ncclCommDestroy(OpaqueComm* comm) {
  std::vector<MPI_Request> all_here(1);
  std::vector<MPI_Status> states(1);
  MPI_Ibarrier(comm->ranks->comm, all_here.data());
  if (!all_done(all_here, states)) {
    std::fputs("nccl_stand_in: a communicator is destroyed by some ranks only\n", stderr);
    MPI_Abort(MPI_COMM_WORLD, 1);
  }
  MPI_Comm_free(&comm->ranks->comm);
  comm->ranks->error = kInvalidUsage;  // for what is still in a stream
  delete comm;
  return kSuccess;
}

NCCL_FUNCTION Result ncclCommAbort(OpaqueComm* comm) {
  comm->ranks->error = kRemoteError;
  // Where other ranks of the node do not abort, NCCL frees what waits but does not return.
  while (planted("deserted")) std::this_thread::sleep_for(std::chrono::hours(1));
  delete comm;
  return kSuccess;
}

NCCL_FUNCTION Result ncclCommGetAsyncError(OpaqueComm* comm, Result* error) {
  *error = comm->ranks->error;
  return kSuccess;
}

NCCL_FUNCTION const char* ncclGetErrorString(Result result) {
  switch (result) {
    case kSuccess:
      return "no error";
    case kInvalidArgument:
      return "invalid argument";
    case kInvalidUsage:
      return "invalid usage";
    case kRemoteError:
      return "remote process exited or there was a network error";
    default:
      return "unknown result code";
  }
}

NCCL_FUNCTION Result ncclGroupStart() {
  if (group.open) return kInvalidUsage;
  group.open = true;
  return kSuccess;
}

NCCL_FUNCTION Result ncclGroupEnd() {
  if (!group.open) return kInvalidUsage;
  if (group.stream != nullptr) {
    group.stream->enqueue([ranks = group.ranks, messages = group.messages] { carry_out(*ranks, messages); });
  }
  group = {};
  return kSuccess;
}

NCCL_FUNCTION Result ncclSend(const void* from, std::size_t count, int type, int peer, OpaqueComm* comm,
                              EmulatedStream* stream) {
  if (type != breccia::cuda::nccl::kBytes) return kInvalidArgument;
  return add({const_cast<void*>(from), count, peer, true}, comm, stream);
}

NCCL_FUNCTION Result ncclRecv(void* to, std::size_t count, int type, int peer, OpaqueComm* comm,
                              EmulatedStream* stream) {
  if (type != breccia::cuda::nccl::kBytes) return kInvalidArgument;
  return add({to, count, peer, false}, comm, stream);
}
// NOLINTEND(readability-identifier-naming)

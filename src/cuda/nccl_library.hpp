// NCCL: messages between devices in the order of a stream. Its library is looked for at run time, so that neither a
// build nor a start needs it. What is called of it is declared here, as in its nccl.h from version 2.7 on: that header
// comes with NCCL alone, in no package of the CUDA toolkit.
#pragma once

#include <cstddef>
#include <string>

#include "cuda/device_runtime.hpp"

namespace breccia::cuda::nccl {

/// Names another file than libnccl.so.2 where the dynamic linker looks.
inline constexpr const char* kFileVariable = "BRECCIA_NCCL_LIBRARY";
/// First version with ncclSend and ncclRecv, as ncclGetVersion tells it.
inline constexpr int kFirstVersion = 2700;

// C enumerations, passed as int.
using Result = int;
inline constexpr Result kSuccess = 0;
inline constexpr int kBytes = 1;  // ncclUint8
struct UniqueId {
  char internal[128];
};
using Handle = struct OpaqueComm*;  // ncclComm_t, which nobody looks into

/// Its functions, by their names without "nccl".
struct Library {
  int version = 0;
  Result (*get_version)(int* version) = nullptr;
  Result (*get_unique_id)(UniqueId* id) = nullptr;
  Result (*comm_init_rank)(Handle* comm, int ranks, UniqueId id, int rank) = nullptr;
  Result (*comm_destroy)(Handle comm) = nullptr;
  Result (*comm_abort)(Handle comm) = nullptr;
  Result (*comm_get_async_error)(Handle comm, Result* error) = nullptr;
  const char* (*get_error_string)(Result result) = nullptr;
  Result (*group_start)() = nullptr;
  Result (*group_end)() = nullptr;
  Result (*send)(const void* from, std::size_t count, int type, int peer, Handle comm, cudaStream_t stream) = nullptr;
  Result (*recv)(void* to, std::size_t count, int type, int peer, Handle comm, cudaStream_t stream) = nullptr;

  /// Throws IoError with what NCCL says unless `result` is success.
  void check(Result result, const char* what) const;
};

/// The library, which stays loaded. Throws UsageError if there is none or it is too old, with the reason.
Library load();
/// "NCCL 2.28.9".
std::string describe(const Library& library);

}  // namespace breccia::cuda::nccl

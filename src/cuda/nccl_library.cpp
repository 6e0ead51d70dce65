#include "cuda/nccl_library.hpp"

#include <dlfcn.h>

#include <cstdlib>

#include "breccia/error.hpp"

namespace breccia::cuda::nccl {
namespace {

template <class Function>
void find(void* library, const std::string& file, const char* name, Function*& function) {
  function = reinterpret_cast<Function*>(dlsym(library, name));
  if (function == nullptr) throw UsageError(file + " has no " + name + ": it is not NCCL 2.7 or later");
}

// 2.7.8 is 2708, 2.28.9 is 22809.
std::string in_words(int version) {
  const int thousands = version < 10000 ? 1000 : 10000;
  return std::to_string(version / thousands) + "." + std::to_string(version % thousands / 100) + "." +
         std::to_string(version % 100);
}

}  // namespace

void Library::check(Result result, const char* what) const {
  if (result != kSuccess) throw IoError(std::string("NCCL: ") + what + ": " + get_error_string(result));
}

Library load() {
  const char* given = std::getenv(kFileVariable);
  const std::string file = given == nullptr ? "libnccl.so.2" : given;
  void* handle = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (handle == nullptr) throw UsageError(dlerror());
  Library library;
  find(handle, file, "ncclGetErrorString", library.get_error_string);
  find(handle, file, "ncclGetVersion", library.get_version);
  if (const Result result = library.get_version(&library.version); result != kSuccess) {
    throw UsageError(file + " does not tell its version: " + library.get_error_string(result));
  }
  if (library.version < kFirstVersion) {
    throw UsageError(file + " is " + describe(library) + ", which has no messages between two ranks: 2.7 is the first");
  }
  find(handle, file, "ncclGetUniqueId", library.get_unique_id);
  find(handle, file, "ncclCommInitRank", library.comm_init_rank);
  find(handle, file, "ncclCommDestroy", library.comm_destroy);
  find(handle, file, "ncclCommAbort", library.comm_abort);
  find(handle, file, "ncclCommGetAsyncError", library.comm_get_async_error);
  find(handle, file, "ncclGroupStart", library.group_start);
  find(handle, file, "ncclGroupEnd", library.group_end);
  find(handle, file, "ncclSend", library.send);
  find(handle, file, "ncclRecv", library.recv);
  return library;
}

std::string describe(const Library& library) { return "NCCL " + in_words(library.version); }

}  // namespace breccia::cuda::nccl

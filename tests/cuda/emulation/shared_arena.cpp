#include "tests/cuda/emulation/shared_arena.hpp"

#include <sys/mman.h>

#include <cstdlib>

namespace breccia::cuda_emulation {
namespace {

constexpr std::byte kFill{0xff};
#if defined(__SANITIZE_ADDRESS__)
constexpr std::size_t kGuard = 0;  // the sanitizer sees every access beyond the end
#else
constexpr std::size_t kGuard = 1024;
#endif

// Not memset: the thread sanitizer would take it for an access by the kernel's caller.
void fill(std::byte* from, std::size_t bytes) {
  for (std::size_t n = 0; n < bytes; ++n) *static_cast<volatile std::byte*>(from + n) = kFill;
}

}  // namespace

SharedArena::~SharedArena() { free(); }

#if defined(BRECCIA_EMULATION_TSAN)
// Unmapped memory has no history: what two blocks do with theirs is no race.
void SharedArena::free() {
  if (start_ != nullptr) munmap(start_, bytes_ + kGuard);
}
void SharedArena::renew(std::size_t bytes) {
  free();
  bytes_ = bytes;
  start_ = static_cast<std::byte*>(
      mmap(nullptr, bytes + kGuard, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
  if (start_ == MAP_FAILED) std::abort();
  fill(start_, bytes_ + kGuard);
}
#else
void SharedArena::free() { std::free(start_); }
void SharedArena::renew(std::size_t bytes) {
  if (bytes != bytes_ || start_ == nullptr) {
    free();
    bytes_ = bytes;
    start_ = static_cast<std::byte*>(std::malloc(bytes + kGuard));
  }
  fill(start_, bytes_ + kGuard);
}
#endif

bool SharedArena::intact() const {
  for (std::size_t n = 0; n < kGuard; ++n) {
    if (start_[bytes_ + n] != kFill) return false;
  }
  return true;
}

}  // namespace breccia::cuda_emulation

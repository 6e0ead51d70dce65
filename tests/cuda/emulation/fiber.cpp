#include "tests/cuda/emulation/fiber.hpp"

#include <sys/mman.h>

#include <cstdlib>

#if defined(__SANITIZE_ADDRESS__)
#include <sanitizer/asan_interface.h>
#include <sanitizer/common_interface_defs.h>
#endif
#if defined(BRECCIA_EMULATION_TSAN)
#include <sanitizer/tsan_interface.h>
#endif

// Saves what a call must preserve, changes the stack, restores.
asm(R"(
.text
.type breccia_switch_stack,@function
breccia_switch_stack:
  pushq %rbp
  pushq %rbx
  pushq %r12
  pushq %r13
  pushq %r14
  pushq %r15
  movq %rsp, (%rdi)
  movq %rsi, %rsp
  popq %r15
  popq %r14
  popq %r13
  popq %r12
  popq %rbx
  popq %rbp
  ret
.size breccia_switch_stack, .-breccia_switch_stack
)");
extern "C" void breccia_switch_stack(void** save, void* to);

namespace breccia::cuda_emulation {

Fiber::Fiber()
    : stack_(static_cast<std::byte*>(
          mmap(nullptr, kStackBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0))) {
  if (stack_ == MAP_FAILED) std::abort();
}

Fiber::~Fiber() { munmap(stack_, kStackBytes); }

void Fiber::forget() {
#if defined(BRECCIA_EMULATION_TSAN)
  for (void* thread : threads_) __tsan_destroy_fiber(thread);
  threads_.clear();
#endif
}

void Fiber::start(void (*entry)()) {
#if defined(__SANITIZE_ADDRESS__)
  __asan_unpoison_memory_region(stack_, kStackBytes);  // frames of a kernel that was given up
#endif
#if defined(BRECCIA_EMULATION_TSAN)
  // A fresh history, and a stack whose addresses have none. The old one must live on: races with what a destroyed fiber
  // did are not reported.
  threads_.push_back(__tsan_create_fiber(0));
  munmap(stack_, kStackBytes);
  stack_ = static_cast<std::byte*>(
      mmap(nullptr, kStackBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0));
  if (stack_ == MAP_FAILED) std::abort();
#endif
#if defined(__SANITIZE_ADDRESS__)
  fake_stack_ = nullptr;
#endif
  auto** top = reinterpret_cast<void**>(stack_ + kStackBytes);
  *--top = nullptr;  // keeps the alignment that a call would leave
  *--top = reinterpret_cast<void*>(entry);
  for (int saved = 0; saved < 6; ++saved) *--top = nullptr;
  stack_pointer_ = top;
}

void Fiber::enter() {
#if defined(__SANITIZE_ADDRESS__)
  __sanitizer_start_switch_fiber(&scheduler_fake_stack_, stack_, kStackBytes);
#endif
#if defined(BRECCIA_EMULATION_TSAN)
  scheduler_thread_ = __tsan_get_current_fiber();
  __tsan_switch_to_fiber(threads_.back(), 0);
#endif
  breccia_switch_stack(&scheduler_pointer_, stack_pointer_);
#if defined(__SANITIZE_ADDRESS__)
  __sanitizer_finish_switch_fiber(scheduler_fake_stack_, nullptr, nullptr);
#endif
}

void Fiber::arrived() {
#if defined(__SANITIZE_ADDRESS__)
  __sanitizer_finish_switch_fiber(fake_stack_, &scheduler_stack_, &scheduler_stack_bytes_);
#endif
}

void Fiber::leave([[maybe_unused]] bool finished) {
#if defined(__SANITIZE_ADDRESS__)
  __sanitizer_start_switch_fiber(finished ? nullptr : &fake_stack_, scheduler_stack_, scheduler_stack_bytes_);
#endif
#if defined(BRECCIA_EMULATION_TSAN)
  // Without order: what lanes do between two barriers is not seen by each other.
  __tsan_switch_to_fiber(scheduler_thread_, 1);
#endif
  breccia_switch_stack(&stack_pointer_, scheduler_pointer_);
  arrived();
}

}  // namespace breccia::cuda_emulation

// A stack of its own to run a function on, with a switch to and fro. Announces switches to the sanitizers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace breccia::cuda_emulation {

/// Where the kernel waits while no fiber runs, and where each fiber was left.
class Fiber {
 public:
  /// `entry` never returns: it ends with leave() for good.
  Fiber();
  ~Fiber();
  Fiber(const Fiber&) = delete;
  Fiber& operator=(const Fiber&) = delete;

  /// Makes the next enter() begin at `entry`.
  void start(void (*entry)());
  /// Runs the fiber until it leaves. Called by the scheduler.
  void enter();
  /// Back to the scheduler. Called inside the fiber; `finished`: it will not be entered again.
  void leave(bool finished);
  /// Must be the first call inside `entry`.
  void arrived();
  /// Forgets what the thread sanitizer knows of earlier starts, which bears on races with them. It has not room for
  /// all.
  void forget();

 private:
#if defined(BRECCIA_EMULATION_TSAN)
  static constexpr std::size_t kStackBytes = std::size_t{32} << 10;  // mapped anew at each start
#else
  static constexpr std::size_t kStackBytes = std::size_t{256} << 10;
#endif

  std::byte* stack_;
  void* stack_pointer_ = nullptr;
  void* scheduler_pointer_ = nullptr;
#if defined(__SANITIZE_ADDRESS__)
  void* fake_stack_ = nullptr;
  void* scheduler_fake_stack_ = nullptr;
  const void* scheduler_stack_ = nullptr;
  std::size_t scheduler_stack_bytes_ = 0;
#endif
#if defined(BRECCIA_EMULATION_TSAN)
  std::vector<void*> threads_;  // this start's last
  void* scheduler_thread_ = nullptr;
#endif
};

}  // namespace breccia::cuda_emulation

// Blocks, lanes, barriers. Compiled without the thread sanitizer, which is told of all order by its interface: what the
// scheduler itself reads and writes is no business of the kernels.
#include "tests/cuda/emulation/cuda_emulation.hpp"

#include <cxxabi.h>
#include <sys/mman.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <memory>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

#include "tests/cuda/emulation/fiber.hpp"
#include "tests/cuda/emulation/shared_arena.hpp"

#if defined(BRECCIA_EMULATION_TSAN)
#include <sanitizer/tsan_interface.h>
#endif

namespace breccia::cuda_emulation {
namespace {

constexpr unsigned kWarp = 32;

enum class State { kRunnable, kAtBarrier, kInCollective, kDone };

struct Lane {
  Fiber fiber;
  State state = State::kDone;
  int line = 0;  // of the barrier or collective
  Collective collective = Collective::kSync;
  unsigned mask = 0;
  unsigned source = 0;
  std::uint64_t value = 0;
  std::uint64_t result = 0;
};

// Order between lanes as the thread sanitizer sees it. Objects alternate by generation: one object for all barriers
// would order what comes after a barrier before what another lane did ahead of it. Every block has objects of its own,
// or blocks would be ordered too.
class Ordering {
 public:
  enum Object { kBlock = 0, kWarps = 2, kObjects = kWarps + 2 * 32 };
#if defined(BRECCIA_EMULATION_TSAN)
  void next_block() { first_ = (first_ + kObjects) % (objects_.size() - kObjects - 1); }
  void release(unsigned object) { __tsan_release(&objects_[first_ + object]); }
  void acquire(unsigned object) { __tsan_acquire(&objects_[first_ + object]); }
  // From every lane to whoever launched the kernel.
  void lane_ends() { __tsan_release(&objects_.back()); }
  void launch_ends() { __tsan_acquire(&objects_.back()); }

 private:
  std::vector<std::uint64_t> objects_ = std::vector<std::uint64_t>(std::size_t{1} << 17);
  std::size_t first_ = 0;
#else
  void next_block() {}
  void release(unsigned) {}
  void acquire(unsigned) {}
  void lane_ends() {}
  void launch_ends() {}
#endif
};

class Machine {
 public:
  void run(const std::string& kernel, dim3 grid, dim3 block, std::size_t shared_bytes,
           const std::function<void()>& body);

  [[nodiscard]] dim3 lane_index() const { return unflattened(current_, block_); }
  [[nodiscard]] dim3 block_index() const { return unflattened(block_number_, grid_); }
  [[nodiscard]] dim3 block_size() const { return block_; }
  [[nodiscard]] dim3 grid_size() const { return grid_; }
  [[nodiscard]] unsigned lane_of_warp() const { return current_ % kWarp; }
  [[nodiscard]] void* shared() const { return shared_.address(); }
  [[nodiscard]] std::size_t shared_bytes() const { return shared_bytes_; }
  [[noreturn]] void stop(const std::string& what);
  unsigned wait_for_block(unsigned value, int line);
  std::uint64_t wait_for_lanes(Collective kind, unsigned mask, std::uint64_t value, unsigned source, int line);
  void lane_main();

  Order order = Order::kForward;
  std::mt19937_64 random;

 private:
  static dim3 unflattened(unsigned n, dim3 size) { return {n % size.x, n / size.x % size.y, n / (size.x * size.y)}; }
  static unsigned count(dim3 size) { return size.x * size.y * size.z; }
  [[nodiscard]] std::vector<unsigned> permutation(unsigned n);
  void run_block(unsigned number);
  void forget_lanes() {
    for (const auto& lane : lane_) lane->fiber.forget();
  }
  bool run_lanes();
  unsigned random_warp();
  bool complete_barrier();
  bool complete_collectives();
  bool complete_collective(unsigned warp, unsigned first);
  void wait();
  [[nodiscard]] std::string description(unsigned lane, const std::string& what) const;
  [[noreturn]] void fail(unsigned lane, const std::string& what) const;
  [[noreturn]] void explain_standstill() const;

  std::string kernel_;
  dim3 grid_, block_;
  unsigned lanes_ = 0;
  unsigned block_number_ = 0;
  unsigned current_ = 0;
  unsigned favourite_ = 0;  // warp
  bool running_ = false;
  std::vector<unsigned> lane_order_;
  std::vector<std::unique_ptr<Lane>> lane_;
  SharedArena shared_;
  std::size_t shared_bytes_ = 0;
  const std::function<void()>* body_ = nullptr;
  Ordering ordering_;
  unsigned barriers_ = 0;                   // complete
  std::array<unsigned, 32> collectives_{};  // complete, of each warp
  std::string mistake_;                     // of a lane that cannot throw on its own stack
};

Machine& machine() {
  static Machine the_machine;
  return the_machine;
}

std::vector<unsigned> Machine::permutation(unsigned n) {
  std::vector<unsigned> p(n);
  std::iota(p.begin(), p.end(), 0U);
  if (order == Order::kReverse) std::reverse(p.begin(), p.end());
  if (order == Order::kRandom) std::shuffle(p.begin(), p.end(), random);
  return p;
}

void Machine::run(const std::string& kernel, dim3 grid, dim3 block, std::size_t shared_bytes,
                  const std::function<void()>& body) {
  if (running_) throw EmulationError(kernel + ": launched by a kernel");
  kernel_ = kernel;
  shared_bytes_ = shared_bytes;
  grid_ = grid;
  block_ = block;
  lanes_ = count(block);
  body_ = &body;
  if (lanes_ == 0 || lanes_ > 1024 || count(grid) == 0)
    throw EmulationError(kernel_ + ": launch of no or too many threads");
  while (lane_.size() < lanes_) lane_.push_back(std::make_unique<Lane>());
  running_ = true;
  struct Stop {
    bool& running;
    ~Stop() { running = false; }
  } stop{running_};
  constexpr std::size_t most_starts = 6000;
  std::size_t starts = 0;
  for (const unsigned b : permutation(count(grid))) {
    if ((starts += lanes_) > most_starts) {
      forget_lanes();
      starts = lanes_;
    }
    shared_.renew(shared_bytes);
    run_block(b);
    if (!shared_.intact()) fail(0, "wrote beyond its shared memory of " + std::to_string(shared_bytes) + " bytes");
  }
  ordering_.launch_ends();
  forget_lanes();
}

void Machine::run_block(unsigned number) {
  block_number_ = number;
  ordering_.next_block();
  lane_order_ = permutation(lanes_);
  for (unsigned l = 0; l < lanes_; ++l) {
    lane_[l]->state = State::kRunnable;
    lane_[l]->fiber.start([] { machine().lane_main(); });
  }
  for (;;) {
    const bool ran = run_lanes();
    if (std::all_of(lane_.begin(), lane_.begin() + lanes_, [](const auto& l) { return l->state == State::kDone; }))
      return;
    const bool collectives = complete_collectives();
    if (!collectives && !complete_barrier() && !ran) explain_standstill();
  }
}

// One warp that can go on. Mostly the same again, so that it gets far ahead of the others where no barrier holds it.
unsigned Machine::random_warp() {
  const unsigned warps = (lanes_ + kWarp - 1) / kWarp;
  const auto can_go = [&](unsigned warp) {
    const auto first = lane_.begin() + warp * kWarp;
    const auto last = lane_.begin() + std::min(lanes_, (warp + 1) * kWarp);
    return std::any_of(first, last, [](const auto& l) { return l->state == State::kRunnable; });
  };
  if (random() % 16 == 0 || favourite_ >= warps) favourite_ = static_cast<unsigned>(random() % warps);
  for (unsigned n = 0; n < warps && !can_go(favourite_); ++n) favourite_ = (favourite_ + 1) % warps;
  return favourite_;
}

bool Machine::run_lanes() {
  bool ran = false;
  const unsigned warp = order == Order::kRandom ? random_warp() : 0U;
  for (unsigned n = 0; n < lanes_; ++n) {
    current_ = lane_order_[n];
    Lane& lane = *lane_[current_];
    if (lane.state != State::kRunnable || (order == Order::kRandom && current_ / kWarp != warp)) continue;
    lane.fiber.enter();
    if (!mistake_.empty()) throw EmulationError(std::exchange(mistake_, {}));
    ran = true;
  }
  return ran;
}

void Machine::lane_main() {
  Lane& lane = *lane_[current_];
  lane.fiber.arrived();
  (*body_)();
  lane.state = State::kDone;
  ordering_.lane_ends();
  lane.fiber.leave(true);
}

void Machine::stop(const std::string& what) {
  mistake_ = description(current_, what);
  for (;;) wait();
}

void Machine::wait() { lane_[current_]->fiber.leave(false); }

unsigned Machine::wait_for_block(unsigned value, int line) {
  Lane& lane = *lane_[current_];
  lane.state = State::kAtBarrier;
  lane.line = line;
  lane.value = value;
  const unsigned object = Ordering::kBlock + barriers_ % 2;
  ordering_.release(object);
  wait();
  ordering_.acquire(object);
  return static_cast<unsigned>(lane.result);
}

bool Machine::complete_barrier() {
  const auto last = lane_.begin() + lanes_;
  const auto on_the_way = [](const auto& l) {
    return l->state == State::kRunnable || l->state == State::kInCollective;
  };
  if (std::any_of(lane_.begin(), last, on_the_way)) return false;
  const Lane& first = *lane_[0];
  std::uint64_t sum = 0;
  for (unsigned l = 0; l < lanes_; ++l) {
    const Lane& lane = *lane_[l];
    if (lane.state == State::kAtBarrier && first.state == State::kDone)
      fail(0, "left before the barrier of line " + std::to_string(lane.line));
    if (lane.state == State::kDone) fail(l, "left before the barrier of line " + std::to_string(first.line));
    if (lane.line != first.line) {
      fail(l, "waits at the barrier of line " + std::to_string(lane.line) + ", thread 0 at that of line " +
                  std::to_string(first.line));
    }
    sum += lane.value;
  }
  for (unsigned l = 0; l < lanes_; ++l) {
    lane_[l]->result = sum;
    lane_[l]->state = State::kRunnable;
  }
  ++barriers_;
  return true;
}

std::uint64_t Machine::wait_for_lanes(Collective kind, unsigned mask, std::uint64_t value, unsigned source, int line) {
  Lane& lane = *lane_[current_];
  lane.state = State::kInCollective;
  lane.collective = kind;
  lane.mask = mask;
  lane.value = value;
  lane.source = source;
  lane.line = line;
  if ((mask >> (current_ % kWarp) & 1U) == 0) {
    mistake_ =
        description(current_, "calls a warp function with a mask that leaves it out, line " + std::to_string(line));
  }
  const unsigned warp = current_ / kWarp;
  const unsigned object = Ordering::kWarps + warp * 2 + collectives_[warp] % 2;
  // __syncwarp alone orders memory.
  if (kind == Collective::kSync) ordering_.release(object);
  wait();
  if (kind == Collective::kSync) ordering_.acquire(object);
  return lane.result;
}

bool Machine::complete_collectives() {
  bool any = false;
  for (unsigned warp = 0; warp * kWarp < lanes_; ++warp) {
    for (unsigned l = warp * kWarp; l < std::min(lanes_, (warp + 1) * kWarp); ++l) {
      if (lane_[l]->state == State::kInCollective) any = complete_collective(warp, l) || any;
    }
  }
  return any;
}

bool Machine::complete_collective(unsigned warp, unsigned first) {
  const Lane& model = *lane_[first];
  std::uint64_t ballot = 0;
  std::uint64_t bits = 0;
  for (unsigned n = 0; n < kWarp; ++n) {
    if ((model.mask >> n & 1U) == 0) continue;
    const unsigned l = warp * kWarp + n;
    if (l >= lanes_) continue;  // a block of less than whole warps
    const Lane& lane = *lane_[l];
    if (lane.state == State::kDone) fail(l, "left before the warp function of line " + std::to_string(model.line));
    if (lane.state != State::kInCollective) return false;
    if (lane.line != model.line || lane.mask != model.mask) {
      fail(l, "calls the warp function of line " + std::to_string(lane.line) +
                  ", another lane of its mask that of line " + std::to_string(model.line));
    }
    ballot |= (lane.value & 1U) << n;
    bits |= lane.value;
  }
  std::array<std::uint64_t, kWarp> given{};
  for (unsigned n = 0; n < kWarp && warp * kWarp + n < lanes_; ++n) given[n] = lane_[warp * kWarp + n]->value;
  for (unsigned n = 0; n < kWarp && warp * kWarp + n < lanes_; ++n) {
    if ((model.mask >> n & 1U) == 0) continue;
    Lane& lane = *lane_[warp * kWarp + n];
    switch (lane.collective) {
      case Collective::kSync:
        break;
      case Collective::kShuffle:
        if (lane.source >= kWarp || (model.mask >> lane.source & 1U) == 0) {
          fail(warp * kWarp + n, "reads a lane outside the mask, line " + std::to_string(model.line));
        }
        lane.result = given[lane.source];
        break;
      case Collective::kBallot:
        lane.result = ballot;
        break;
      case Collective::kOr:
        lane.result = bits;
        break;
    }
    lane.state = State::kRunnable;
  }
  ++collectives_[warp];
  return true;
}

std::string Machine::description(unsigned lane, const std::string& what) const {
  return kernel_ + ", block " + std::to_string(block_number_) + ", thread " + std::to_string(lane) + ": " + what;
}

void Machine::fail(unsigned lane, const std::string& what) const { throw EmulationError(description(lane, what)); }

void Machine::explain_standstill() const {
  for (unsigned l = 0; l < lanes_; ++l) {
    if (lane_[l]->state == State::kInCollective) {
      fail(l, "waits in the warp function of line " + std::to_string(lane_[l]->line) + " for lanes that never come");
    }
  }
  fail(0, "no thread can go on");
}

}  // namespace

// Of "...KernelTag<&(void space::kernel<float>(int))>" the name with its template arguments.
std::string kernel_name(const char* mangled) {
  char* const demangled = abi::__cxa_demangle(mangled, nullptr, nullptr, nullptr);
  if (demangled == nullptr) return mangled;
  std::string text = demangled;
  std::free(demangled);
  const std::string unnamed = "(anonymous namespace)::";
  for (std::size_t at = text.find(unnamed); at != std::string::npos; at = text.find(unnamed, at))
    text.erase(at, unnamed.size());
  std::size_t start = text.find('&') + 1;
  int depth = 0;
  for (std::size_t n = start; n < text.size(); ++n) {
    if (text[n] == '<') ++depth;
    if (text[n] == '>') --depth;
    if (depth > 0) continue;
    const bool parameters = text[n] == '(' && start < n;
    if (parameters || depth < 0) return text.substr(start, n - start);
    if (text[n] == ' ' || text[n] == ':' || text[n] == '(') start = n + 1;
  }
  return text;
}

void set_order(Order order, std::uint64_t seed) {
  machine().order = order;
  machine().random.seed(seed);
}

std::size_t early_stream(std::size_t streams) {
  return machine().order == Order::kRandom ? machine().random() % (2 * streams) : streams;
}

void run_kernel(const std::string& kernel, dim3 grid, dim3 block, std::size_t shared_bytes,
                const std::function<void()>& body) {
  machine().run(kernel, grid, block, shared_bytes, body);
}

dim3 thread_index() { return machine().lane_index(); }
dim3 block_index() { return machine().block_index(); }
dim3 block_size() { return machine().block_size(); }
dim3 grid_size() { return machine().grid_size(); }
unsigned lane_of_warp() { return machine().lane_of_warp(); }
void* shared_memory() { return machine().shared(); }
std::size_t shared_bytes() { return machine().shared_bytes(); }
void stop_kernel(const std::string& what) { machine().stop(what); }
void synchronise_block(int line) { machine().wait_for_block(0, line); }
unsigned reduce_block(unsigned value, int line) { return machine().wait_for_block(value, line); }
std::uint64_t warp_collective(Collective kind, unsigned mask, std::uint64_t value, unsigned source, int line) {
  return machine().wait_for_lanes(kind, mask, value, source, line);
}

}  // namespace breccia::cuda_emulation

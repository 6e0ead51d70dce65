// Shared memory of one block: new for every block, full of NaN, and guarded.
#pragma once

#include <cstddef>

namespace breccia::cuda_emulation {

class SharedArena {
 public:
  SharedArena() = default;
  ~SharedArena();
  SharedArena(const SharedArena&) = delete;
  SharedArena& operator=(const SharedArena&) = delete;

  void renew(std::size_t bytes);
  [[nodiscard]] void* address() const { return start_; }
  /// False if the bytes behind its end have changed.
  [[nodiscard]] bool intact() const;

 private:
  void free();

  std::byte* start_ = nullptr;
  std::size_t bytes_ = 0;
};

}  // namespace breccia::cuda_emulation

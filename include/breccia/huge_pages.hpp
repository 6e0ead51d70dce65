// Memory in pages of 2 MiB where the system gives them on request (Linux, "madvise"): tiles touch hundreds of ordinary
// pages, more than the processor keeps translations for.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

namespace breccia {

/// For large arrays; those smaller than a few pages come from the usual heap. Elements of a resized vector are left as
/// the memory was, unless given a value.
template <class T>
class HugePageAllocator {
 public:
  using value_type = T;

  HugePageAllocator() = default;
  template <class U>
  explicit(false) HugePageAllocator(const HugePageAllocator<U>&) {}

  [[nodiscard]] T* allocate(std::size_t count) {
    const std::size_t bytes = count * sizeof(T);
    if (!is_large(bytes)) return static_cast<T*>(::operator new(bytes, kAlignment));
    const std::size_t rounded = (bytes + kPage - 1) / kPage * kPage;
    void* memory = std::aligned_alloc(kPage, rounded);
    if (memory == nullptr) throw std::bad_alloc();
    madvise(memory, rounded, MADV_HUGEPAGE);  // a wish: without it the memory is as good, if slower
    return static_cast<T*>(memory);
  }

  void deallocate(T* memory, std::size_t count) {
    if (is_large(count * sizeof(T))) {
      std::free(memory);
    } else {
      ::operator delete(memory, kAlignment);
    }
  }

  template <class U, class... Arguments>
  void construct(U* element, Arguments&&... arguments) {
    if constexpr (sizeof...(Arguments) == 0 && std::is_trivially_copyable_v<U>) {
      ::new (static_cast<void*>(element)) U;
    } else {
      std::construct_at(element, std::forward<Arguments>(arguments)...);
    }
  }

  friend bool operator==(const HugePageAllocator&, const HugePageAllocator&) { return true; }

 private:
  static constexpr std::size_t kPage = std::size_t{2} << 20;
  static constexpr std::align_val_t kAlignment{64};
  static constexpr bool is_large(std::size_t bytes) { return bytes >= 2 * kPage; }
};

template <class T>
using LargeArray = std::vector<T, HugePageAllocator<T>>;

/// Gives the memory of a vector back, which keeps all of it where {} is assigned.
template <class Vector>
void release(Vector& vector) {
  Vector().swap(vector);
}

}  // namespace breccia

// Memory on the device that frees itself.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cuda/check.hpp"

namespace breccia::cuda {

/// An array of trivially copyable T. New memory is not initialised.
template <class T>
class DeviceArray {
 public:
  DeviceArray() = default;
  explicit DeviceArray(std::size_t size) { allocate(size); }
  ~DeviceArray() { free(); }
  DeviceArray(DeviceArray&& other) noexcept { swap(other); }
  DeviceArray& operator=(DeviceArray&& other) noexcept {
    swap(other);
    return *this;
  }
  DeviceArray(const DeviceArray&) = delete;
  DeviceArray& operator=(const DeviceArray&) = delete;

  [[nodiscard]] T* data() const { return data_; }
  [[nodiscard]] std::size_t size() const { return size_; }
  /// The size that it can have without moving.
  [[nodiscard]] std::size_t capacity() const { return capacity_; }
  [[nodiscard]] std::size_t bytes() const { return size_ * sizeof(T); }

  /// Makes the array this long; what it held is lost if its capacity has to grow. Some room is added then: sizes change
  /// little from sorting to sorting. Kernels may not touch that room. Throws NumericsError if the device has not that
  /// much memory, with what it has.
  void reserve(std::size_t size) { reserve(size, size / 8); }
  void reserve(std::size_t size, std::size_t room) {
    if (size > capacity_) take(size + room);
    size_ = size;
    if (data_ != nullptr) use_only(data_, bytes());
  }
  /// Anew and of this size, without room. Throws as reserve().
  void allocate(std::size_t size) {
    take(size);
    if (data_ != nullptr) use_only(data_, bytes());
  }
  void swap(DeviceArray& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    std::swap(capacity_, other.capacity_);
  }

  void fill_bytes(int value, cudaStream_t stream) {
    if (size_ > 0) check(cudaMemsetAsync(data_, value, bytes(), stream), "fill");
  }
  /// Copies to the first elements; the array must be long enough. The host waits.
  void upload(std::span<const T> values, cudaStream_t stream) {
    if (values.empty()) return;
    check(cudaMemcpyAsync(data_, values.data(), values.size_bytes(), cudaMemcpyHostToDevice, stream), "upload");
    check(cudaStreamSynchronize(stream), "upload");
  }
  /// The first `count` elements. The host waits.
  [[nodiscard]] std::vector<T> download(std::size_t count, cudaStream_t stream) const {
    std::vector<T> values(count);
    if (count > 0) {
      check(cudaMemcpyAsync(values.data(), data_, count * sizeof(T), cudaMemcpyDeviceToHost, stream), "download");
      check(cudaStreamSynchronize(stream), "download");
    }
    return values;
  }

 private:
  void take(std::size_t size) {
    free();
    if (size == 0) return;
    void* memory = nullptr;
    if (cudaMalloc(&memory, size * sizeof(T)) != cudaSuccess) {
      (void)cudaGetLastError();
      std::size_t available = 0;
      std::size_t total = 0;
      check(cudaMemGetInfo(&available, &total), "memory information");
      throw NumericsError("the device has not enough memory: " + std::to_string(size * sizeof(T)) +
                          " bytes needed at once, " + std::to_string(available) + " of " + std::to_string(total) +
                          " free; use more ranks with a device each, or --device host");
    }
    data_ = static_cast<T*>(memory);
    size_ = capacity_ = size;
  }
  void free() noexcept {
    if (data_ != nullptr) (void)cudaFree(data_);
    data_ = nullptr;
    size_ = capacity_ = 0;
  }

  T* data_ = nullptr;
  std::size_t size_ = 0;
  std::size_t capacity_ = 0;
};

/// Values from here and there in device memory. The host waits once.
template <class T, std::size_t kCount>
[[nodiscard]] std::array<T, kCount> read_back(const std::array<const T*, kCount>& from, cudaStream_t stream) {
  std::array<T, kCount> values;
  for (std::size_t k = 0; k < kCount; ++k) {
    check(cudaMemcpyAsync(&values[k], from[k], sizeof(T), cudaMemcpyDeviceToHost, stream), "read back");
  }
  check(cudaStreamSynchronize(stream), "read back");
  return values;
}

/// Memory of the host that the device copies to and from on its own.
template <class T>
class PinnedArray {
 public:
  PinnedArray() = default;
  ~PinnedArray() { free(); }
  PinnedArray(const PinnedArray&) = delete;
  PinnedArray& operator=(const PinnedArray&) = delete;

  [[nodiscard]] T* data() const { return data_; }
  /// At least this long; what it held is lost if it grows.
  void reserve(std::size_t size) {
    if (size <= size_) return;
    free();
    void* memory = nullptr;
    check(cudaMallocHost(&memory, size * sizeof(T)), "pinned memory");
    data_ = static_cast<T*>(memory);
    size_ = size;
  }
  /// To whoever else uses it, for ever.
  void leave() noexcept {
    data_ = nullptr;
    size_ = 0;
  }

 private:
  void free() noexcept {
    if (data_ != nullptr) (void)cudaFreeHost(data_);
    data_ = nullptr;
    size_ = 0;
  }

  T* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace breccia::cuda

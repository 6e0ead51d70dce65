// Plain values in a message of bytes.
#pragma once

#include <cstddef>
#include <cstring>
#include <vector>

namespace breccia::mpi {

/// Appends `count` values.
template <class T>
void put(std::vector<std::byte>& message, const T* values, std::size_t count) {
  const auto* bytes = reinterpret_cast<const std::byte*>(values);
  message.insert(message.end(), bytes, bytes + count * sizeof(T));
}

/// Takes `count` values out and moves `from` behind them.
template <class T>
void get(const std::byte*& from, T* values, std::size_t count) {
  std::memcpy(values, from, count * sizeof(T));
  from += count * sizeof(T);
}

}  // namespace breccia::mpi

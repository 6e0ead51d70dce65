// What translated PTX (translate.py) calls: arithmetic as a device does it, memory with every access checked.
#pragma once

#include <bit>
#include <cfloat>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <string>
#include <type_traits>

#include "tests/cuda/emulation/cuda_emulation.hpp"

namespace breccia::cuda_ptx {

/// The kernels of a table, translated from what nvcc made for an architecture ("sm_90").
const cuda_emulation::Substitutes& translations(const std::string& table, const std::string& arch);

struct Translation {
  const char *table, *arch, *kernel;
  cuda_emulation::Substitute substitute;
};
/// A translated file enters its kernels when the program starts.
struct Enter {
  Enter(std::initializer_list<Translation> all);
};

// Registers have a size, instructions a type.
template <class To, class From>
To as(From value) {
  if constexpr (std::is_integral_v<To> && std::is_integral_v<From>) {
    return static_cast<To>(value);
  } else {
    return std::bit_cast<To>(value);
  }
}
/// Sign-extends or cuts integers to the register.
template <class Register, class T>
void put(Register& to, T value) {
  to = as<Register>(value);
}
inline float real32(std::uint32_t bits) { return std::bit_cast<float>(bits); }
inline double real64(std::uint64_t bits) { return std::bit_cast<double>(bits); }

/// The .ftz of an instruction.
inline float flushed(float x) { return std::abs(x) < FLT_MIN ? std::copysign(0.0F, x) : x; }

/// What a device may find where it is right to `units` in the last place only: as far off as the bits of x say.
template <class T>
T inexact(T x, int units) {
  using Bits = std::conditional_t<sizeof(T) == 8, std::uint64_t, std::uint32_t>;
  if (x == T(0) || !std::isfinite(x)) return x;
  const auto bits = std::bit_cast<Bits>(x);
  const auto any = static_cast<int>(static_cast<std::uint32_t>(bits) * 2654435761U >> 16);
  return std::bit_cast<T>(static_cast<Bits>(bits + static_cast<Bits>(any % (2 * units + 1) - units)));
}

/// Integer arithmetic wraps around.
template <class T, class Operation, class... Operands>
T wrapping(Operation operation, Operands... operands) {
  if constexpr (std::is_same_v<T, bool> || std::is_floating_point_v<T>) {
    return static_cast<T>(operation(operands...));
  } else {
    using Wide = std::conditional_t<sizeof(T) == 8, std::uint64_t, std::uint32_t>;
    return static_cast<T>(operation(static_cast<Wide>(operands)...));
  }
}
template <class T>
T negative(T x) {
  if constexpr (std::is_integral_v<T>) return static_cast<T>(std::make_unsigned_t<T>(0) - std::make_unsigned_t<T>(x));
  return -x;
}
template <class Wide, class T>
Wide product(T a, T b) {
  return static_cast<Wide>(a) * static_cast<Wide>(b);
}
template <class T>
T high_half(T a, T b) {
  static_assert(sizeof(T) == 4);
  using Wide = std::conditional_t<std::is_signed_v<T>, std::int64_t, std::uint64_t>;
  return static_cast<T>(product<Wide>(a, b) >> 32);
}
template <class T>
T quotient(T a, T b) {
  if constexpr (std::is_floating_point_v<T>) return a / b;
  return b == 0 ? T(-1) : static_cast<T>(a / b);  // no trap on a device
}
template <class T>
T remainder(T a, T b) {
  return b == 0 ? a : static_cast<T>(a % b);
}
/// A number wins over no number; -0 is less than 0.
template <class T>
T least(T a, T b) {
  if constexpr (std::is_floating_point_v<T>) {
    if (a != a) return b;
    if (b != b) return a;
    if (a == b) return std::signbit(a) ? a : b;
  }
  return b < a ? b : a;
}
template <class T>
T greatest(T a, T b) {
  if constexpr (std::is_floating_point_v<T>) {
    if (a != a) return b;
    if (b != b) return a;
    if (a == b) return std::signbit(a) ? b : a;
  }
  return a < b ? b : a;
}
/// Whole `x` to an integer, its nearest one.
template <class To, class From>
To saturated(From x) {
  if (x != x) return To(0);
  if (x <= static_cast<From>(std::numeric_limits<To>::min())) return std::numeric_limits<To>::min();
  if (x >= static_cast<From>(std::numeric_limits<To>::max())) return std::numeric_limits<To>::max();
  return static_cast<To>(x);
}
template <class T>
T shifted_left(T x, unsigned by) {
  return by >= 8 * sizeof(T) ? T(0) : static_cast<T>(std::make_unsigned_t<T>(x) << by);
}
template <class T>
T shifted_right(T x, unsigned by) {
  if (by >= 8 * sizeof(T)) return x < T(0) ? T(-1) : T(0);
  return static_cast<T>(x >> by);
}
/// The lower `count` bits of a at bit `from` of b.
template <class T>
T inserted(T a, T b, unsigned from, unsigned count) {
  const auto mask = static_cast<T>(shifted_left(static_cast<T>(shifted_left(T(1), count) - 1), from));
  return static_cast<T>((b & ~mask) | (shifted_left(a, from) & mask));
}
inline std::uint32_t reversed_bits(std::uint32_t x) {
  std::uint32_t reversed = 0;
  for (unsigned n = 0; n < 32; ++n) reversed |= (x >> n & 1U) << (31 - n);
  return reversed;
}
inline int leading_zeros(std::uint32_t x) { return std::countl_zero(x); }
inline int set_bits(std::uint32_t x) { return std::popcount(x); }
/// By how much x must be shifted left for its highest bit to be the top one.
inline std::uint32_t shift_to_top(std::uint32_t x) {
  return x == 0 ? 0xffffffffU : static_cast<std::uint32_t>(std::countl_zero(x));
}

enum class Shuffle { up, down, bfly, idx };  // NOLINT(readability-identifier-naming): PTX's names
/// The lane that a lane reads. `inside`: it is one of the warp.
inline unsigned shuffle_source(Shuffle kind, unsigned by, unsigned clamp, bool& inside) {
  if ((clamp & ~31U) != 0) cuda_emulation::stop_kernel("shuffles inside a part of the warp, which is not emulated");
  const unsigned lane = cuda_emulation::lane_of_warp();
  unsigned source = 0;
  switch (kind) {
    case Shuffle::up:
      source = lane - by;
      break;
    case Shuffle::down:
      source = lane + by;
      break;
    case Shuffle::bfly:
      source = lane ^ by;
      break;
    case Shuffle::idx:
      source = by & 31U;
      break;
  }
  inside = source < 32;
  return inside ? source : lane;
}

// Memory. Beside the bounds, a vector of n values must lie at a multiple of its size.

[[noreturn]] void refuse(const char* memory, std::uint64_t address, std::size_t bytes, std::size_t available, int line);
/// True if the bytes are those of one allocation. `line` finds what was found last time.
bool is_allocated(std::uint64_t address, std::size_t bytes, int line);

template <class T>
const T* in_parameters(const std::byte* parameters, std::uint64_t at) {
  return reinterpret_cast<const T*>(parameters + static_cast<std::int64_t>(at));
}
template <class T, int kCount>
T* in_shared(std::uint32_t at, int line) {
  constexpr std::size_t bytes = sizeof(T) * kCount;
  const std::size_t available = cuda_emulation::shared_bytes();
  if (at % bytes != 0 || at + bytes > available) refuse("shared", at, bytes, available, line);
  return reinterpret_cast<T*>(static_cast<std::byte*>(cuda_emulation::shared_memory()) + at);
}
template <class T, int kCount>
T* in_local(std::byte* local, std::size_t available, std::uint64_t address, int line) {
  constexpr std::size_t bytes = sizeof(T) * kCount;
  const std::uint64_t at = address - reinterpret_cast<std::uint64_t>(local);
  if (at % bytes != 0 || at + bytes > available) refuse("local", at, bytes, available, line);
  return reinterpret_cast<T*>(local + at);
}
template <class T, int kCount>
T* in_global(std::uint64_t address, int line) {
  constexpr std::size_t bytes = sizeof(T) * kCount;
  if (address % bytes != 0 || !is_allocated(address, bytes, line)) refuse("global", address, bytes, 0, line);
  return reinterpret_cast<T*>(address);
}

}  // namespace breccia::cuda_ptx

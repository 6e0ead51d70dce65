// Counter-based random numbers: Philox4x32-10 (Salmon et al. 2011). A number is a pure function of seed, stream and
// counter, so results do not depend on ranks, threads or the order of drawing.
#pragma once

#include <array>
#include <cstdint>

namespace breccia {

namespace detail {

struct WideProduct {
  std::uint32_t high, low;
};
inline WideProduct wide_product(std::uint32_t a, std::uint32_t b) {
  const std::uint64_t product = static_cast<std::uint64_t>(a) * b;
  return {static_cast<std::uint32_t>(product >> 32U), static_cast<std::uint32_t>(product)};
}

}  // namespace detail

/// The Philox4x32-10 bijection: 128 random bits of a 128-bit counter under a 64-bit key.
inline std::array<std::uint32_t, 4> philox4x32(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key) {
  for (int round = 0; round < 10; ++round) {
    const auto even = detail::wide_product(0xD2511F53U, counter[0]);
    const auto odd = detail::wide_product(0xCD9E8D57U, counter[2]);
    counter = {odd.high ^ counter[1] ^ key[0], odd.low, even.high ^ counter[3] ^ key[1], even.low};
    key[0] += 0x9E3779B9U;
    key[1] += 0xBB67AE85U;
  }
  return counter;
}

/// Random numbers of one purpose: `stream` keeps purposes (bodies, fields) with the same seed apart. Every draw is
/// addressed by a 64-bit counter.
class RandomStream {
 public:
  RandomStream(std::uint64_t seed, std::uint32_t stream) : seed_(seed), stream_(stream) {}

  /// Four independent 32-bit words; `block` numbers further words of the same counter.
  [[nodiscard]] std::array<std::uint32_t, 4> words(std::uint64_t counter, std::uint32_t block = 0) const {
    return philox4x32({low(counter), high(counter), stream_, block}, {low(seed_), high(seed_)});
  }

  /// Two uniform doubles in [0, 1), multiples of 2^-53.
  [[nodiscard]] std::array<double, 2> uniform(std::uint64_t counter, std::uint32_t block = 0) const {
    const auto w = words(counter, block);
    return {unit(joined(w[0], w[1])), unit(joined(w[2], w[3]))};
  }

  /// Uniform integer in [0, n), without bias for any n >= 1 (Lemire 2019: multiply, reject the short interval).
  [[nodiscard]] std::uint64_t below(std::uint64_t counter, std::uint64_t n) const {
    for (std::uint32_t block = 0;; ++block) {
      const auto w = words(counter, block);
      for (const std::uint64_t x : {joined(w[0], w[1]), joined(w[2], w[3])}) {
        const Product p = multiply(x, n);
        if (p.low >= n || p.low >= (0 - n) % n) return p.high;
      }
    }
  }

 private:
  struct Product {
    std::uint64_t high, low;
  };

  static std::uint32_t low(std::uint64_t x) { return static_cast<std::uint32_t>(x); }
  static std::uint32_t high(std::uint64_t x) { return static_cast<std::uint32_t>(x >> 32U); }
  static std::uint64_t joined(std::uint32_t a, std::uint32_t b) { return static_cast<std::uint64_t>(b) << 32U | a; }
  static double unit(std::uint64_t x) { return static_cast<double>(x >> 11U) * 0x1.0p-53; }
  static Product multiply(std::uint64_t a, std::uint64_t b) {
    __extension__ using Wide = unsigned __int128;
    const Wide p = static_cast<Wide>(a) * b;
    return {static_cast<std::uint64_t>(p >> 64U), static_cast<std::uint64_t>(p)};
  }

  std::uint64_t seed_;
  std::uint32_t stream_;
};

}  // namespace breccia

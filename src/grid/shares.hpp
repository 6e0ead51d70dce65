// Work in shares, one for each thread: what they find is put together in the order of shares, not of time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <vector>

namespace breccia::grid {

/// Where each of so many shares of 0 .. count - 1 begins, and the last one's end.
inline std::vector<std::uint32_t> even_shares(std::size_t count, int shares) {
  std::vector<std::uint32_t> bounds;
  for (int n = 0; n <= shares; ++n) {
    bounds.push_back(
        static_cast<std::uint32_t>(count * static_cast<std::size_t>(n) / static_cast<std::size_t>(shares)));
  }
  return bounds;
}

/// Calls work(n) for every share n, on so many threads: always all there are, as a smaller team would end the others.
/// What is thrown in the lowest share is thrown again.
template <class F>
void for_each_share(int threads, std::size_t shares, F&& work) {
  std::vector<std::exception_ptr> thrown(shares);
#pragma omp parallel for schedule(static, 1) num_threads(threads)
  for (std::size_t n = 0; n < shares; ++n) {
    try {
      work(n);
    } catch (...) {
      thrown[n] = std::current_exception();
    }
  }
  for (const std::exception_ptr& one : thrown) {
    if (one) std::rethrow_exception(one);
  }
}

}  // namespace breccia::grid

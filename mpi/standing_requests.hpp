// What ranks ask of each other, told anew only when it has changed.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "mpi/comm.hpp"

namespace breccia::mpi {

template <class T>
class StandingRequests {
 public:
  /// What this rank asks of each other one from now on. Collective: all learn by one small reduction whether anything
  /// has changed anywhere, and only then exchange it.
  void ask(std::vector<std::vector<T>> of_rank, const Comm& comm) {
    if (comm.size() == 1) return;
    if (!comm.any(of_rank != of_rank_)) return;
    of_rank_ = std::move(of_rank);
    by_rank_ = comm.alltoall(of_rank_);
    ++exchanges_;
  }

  [[nodiscard]] const std::vector<std::vector<T>>& of_rank() const { return of_rank_; }
  /// What each rank asks of this one.
  [[nodiscard]] const std::vector<std::vector<T>>& by_rank() const { return by_rank_; }
  /// How often requests had changed.
  [[nodiscard]] std::uint64_t exchanges() const { return exchanges_; }

 private:
  std::vector<std::vector<T>> of_rank_;
  std::vector<std::vector<T>> by_rank_;
  std::uint64_t exchanges_ = 0;
};

}  // namespace breccia::mpi

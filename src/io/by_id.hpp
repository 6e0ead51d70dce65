// Particles in the order of their global ids, contiguous ranges on the ranks: files then do not depend on how the run
// was divided.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "io/hdf5.hpp"
#include "mpi/comm.hpp"

namespace breccia::io {

/// Rows of a dataset that belong to a rank: as equal as whole blocks of `block_rows` rows allow.
h5::Rows share_of(int rank, int ranks, std::uint64_t total, std::uint64_t block_rows);

/// Brings values from the ranks that have the particles to the ranks whose share of 0..N-1 contains their ids.
class ById {
 public:
  /// `ids` of this rank's particles; together the ranks must have each of 0..N-1 once, otherwise NumericsError on all
  /// ranks. Shares consist of whole blocks of `block_rows`. Collective.
  ById(std::span<const std::uint64_t> ids, std::uint64_t block_rows, const mpi::Comm& comm);

  /// N, particles of all ranks.
  [[nodiscard]] std::uint64_t total() const { return total_; }
  /// The ids this rank gets.
  [[nodiscard]] h5::Rows rows() const { return rows_; }

  /// One value per particle in the order of the constructor's ids; returns those of rows(), by id. Collective.
  template <class T>
  [[nodiscard]] std::vector<T> operator()(std::span<const T> values) const {
    std::vector<T> ordered(rows_.count);
    for (std::size_t round = 0; round < places_.size(); ++round) {
      const auto received = comm_.alltoall(parcels(values, round));
      for (std::size_t source = 0; source < received.size(); ++source) {
        const std::vector<std::uint64_t>& places = places_[round][source];
        for (std::size_t i = 0; i < places.size(); ++i) ordered[places[i]] = received[source][i];
      }
    }
    return ordered;
  }

 private:
  // Particles a rank sends in one round: keeps messages below the 2 GiB that MPI counts can express.
  static constexpr std::size_t kRound = std::size_t{1} << 24;

  template <class T>
  [[nodiscard]] std::vector<std::vector<T>> parcels(std::span<const T> values, std::size_t round) const {
    std::vector<std::vector<T>> to(static_cast<std::size_t>(comm_.size()));
    const std::size_t end = std::min(values.size(), (round + 1) * kRound);
    for (std::size_t i = round * kRound; i < end; ++i)
      to[static_cast<std::size_t>(destination_[i])].push_back(values[i]);
    return to;
  }
  void learn_places(std::span<const std::uint64_t> ids);

  mpi::Comm comm_;
  std::uint64_t total_ = 0;
  h5::Rows rows_;
  std::vector<std::int32_t> destination_;                        // rank of each particle of the constructor
  std::vector<std::vector<std::vector<std::uint64_t>>> places_;  // [round][source rank]: index in rows_ of what arrives
};

}  // namespace breccia::io

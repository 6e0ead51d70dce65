// Halo exchange around P2G and G2P: partial sums go to the owner of a node, updated velocities come back.
// One packed message for each neighbour and phase; what is exchanged is fixed until the set of blocks changes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mpi/comm.hpp"

namespace breccia::mpi {

/// Nodes shared with one other rank, in the same order on both sides.
struct SharedNodes {
  int rank = 0;
  std::vector<std::uint32_t> nodes;
};

template <class Real, int kChannels>
class Halo {
 public:
  /// `touched`: nodes of this rank's arrays that other ranks own; `owned`: nodes this rank owns that others touch too.
  /// Both are sorted by rank.
  void set(std::vector<SharedNodes> touched, std::vector<SharedNodes> owned) {
    touched_ = std::move(touched);
    owned_ = std::move(owned);
    touched_buffer_.resize(count(touched_) * kChannels);
    owned_buffer_.resize(count(owned_) * kChannels);
  }

  /// Adds the partial sums of other ranks to the nodes this rank owns and clears what it sent away. The order of
  /// addition is that of the ranks, so a run repeats bit for bit.
  void add_to_owners(Real* nodes, const Comm& comm) {
    pack(touched_, nodes, touched_buffer_);
    exchange(touched_, touched_buffer_, owned_, owned_buffer_, comm);
    const Real* from = owned_buffer_.data();
    for (const SharedNodes& peer : owned_) {
      for (const std::uint32_t node : peer.nodes) {
        for (int c = 0; c < kChannels; ++c)
          nodes[std::size_t{node} * kChannels + static_cast<std::size_t>(c)] += from[c];
        from += kChannels;
      }
    }
    for (const SharedNodes& peer : touched_) {
      for (const std::uint32_t node : peer.nodes) {
        for (int c = 0; c < kChannels; ++c)
          nodes[std::size_t{node} * kChannels + static_cast<std::size_t>(c)] = Real(0);
      }
    }
  }

  /// Gives the values of owned nodes to the ranks that touch them.
  void share_from_owners(Real* nodes, const Comm& comm) {
    pack(owned_, nodes, owned_buffer_);
    exchange(owned_, owned_buffer_, touched_, touched_buffer_, comm);
    const Real* from = touched_buffer_.data();
    for (const SharedNodes& peer : touched_) {
      for (const std::uint32_t node : peer.nodes) {
        for (int c = 0; c < kChannels; ++c)
          nodes[std::size_t{node} * kChannels + static_cast<std::size_t>(c)] = from[c];
        from += kChannels;
      }
    }
  }

  /// Bytes this rank sends in one step.
  [[nodiscard]] std::size_t bytes_per_step() const {
    return (touched_buffer_.size() + owned_buffer_.size()) * sizeof(Real);
  }

 private:
  static std::size_t count(const std::vector<SharedNodes>& peers) {
    std::size_t n = 0;
    for (const SharedNodes& peer : peers) n += peer.nodes.size();
    return n;
  }

  static void pack(const std::vector<SharedNodes>& peers, const Real* nodes, std::vector<Real>& buffer) {
    Real* to = buffer.data();
    for (const SharedNodes& peer : peers) {
      for (const std::uint32_t node : peer.nodes) {
        for (int c = 0; c < kChannels; ++c) to[c] = nodes[std::size_t{node} * kChannels + static_cast<std::size_t>(c)];
        to += kChannels;
      }
    }
  }

  void exchange(const std::vector<SharedNodes>& to, const std::vector<Real>& send, const std::vector<SharedNodes>& from,
                std::vector<Real>& receive, const Comm& comm) {
    requests_.clear();
    std::size_t at = 0;
    for (const SharedNodes& peer : from) {
      const std::size_t n = peer.nodes.size() * kChannels;
      requests_.emplace_back();
      MPI_Irecv(receive.data() + at, static_cast<int>(n), datatype<Real>(), peer.rank, 1, comm.handle(),
                &requests_.back());
      at += n;
    }
    at = 0;
    for (const SharedNodes& peer : to) {
      const std::size_t n = peer.nodes.size() * kChannels;
      requests_.emplace_back();
      MPI_Isend(send.data() + at, static_cast<int>(n), datatype<Real>(), peer.rank, 1, comm.handle(),
                &requests_.back());
      at += n;
    }
    MPI_Waitall(static_cast<int>(requests_.size()), requests_.data(), MPI_STATUSES_IGNORE);
  }

  std::vector<SharedNodes> touched_;
  std::vector<SharedNodes> owned_;
  std::vector<Real> touched_buffer_;
  std::vector<Real> owned_buffer_;
  std::vector<MPI_Request> requests_;
};

}  // namespace breccia::mpi

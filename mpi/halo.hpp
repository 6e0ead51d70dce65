// Halo exchange around P2G and G2P: partial sums go to the owner of a node, updated velocities come back. Each of the
// two is a NodeExchange: one packed message for each neighbour, by requests that stay until the messages change.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "mpi/comm.hpp"
#include "mpi/persistent.hpp"

namespace breccia::mpi {

/// Nodes shared with one other rank, in the same order on both sides.
struct SharedNodes {
  int rank = 0;
  std::vector<std::uint32_t> nodes;
};

/// Values of nodes on their way to other ranks and from them. Of one round: expect(), send(), arrived() as often as one
/// likes, finish(), for_each_received(). All from the thread that started MPI.
template <class Real, int kChannels>
class NodeExchange {
 public:
  /// `tag` tells exchanges of one communicator apart.
  explicit NodeExchange(int tag) : messages_(tag) {}

  /// Which nodes are sent and received from now on, sorted by rank. Between two rounds. Requests stay as they are if
  /// ranks and lengths do.
  void set(std::vector<SharedNodes> sent, std::vector<SharedNodes> received, const Comm& comm) {
    sent_ = std::move(sent);
    received_ = std::move(received);
    messages_.set(lengths(sent_), lengths(received_), comm);
  }

  [[nodiscard]] bool empty() const { return sent_.empty() && received_.empty(); }
  /// Between send() and finish().
  [[nodiscard]] bool travelling() const { return messages_.travelling(); }
  /// Bytes this rank sends in a round.
  [[nodiscard]] std::size_t bytes() const { return messages_.sent().size() * sizeof(Real); }
  [[nodiscard]] const Flights& flights() const { return messages_.flights(); }

  /// Lets messages of faster ranks in.
  void expect() { messages_.expect(); }
  /// Packs the nodes and posts the messages.
  void send(const Real* nodes) {
    Real* to = messages_.sent().data();
    for (const SharedNodes& peer : sent_) {
      for (const std::uint32_t node : peer.nodes) {
        for (int c = 0; c < kChannels; ++c) to[c] = nodes[at(node, c)];
        to += kChannels;
      }
    }
    messages_.send();
  }
  /// True once everything expected is here. Open MPI moves long messages only while a rank is inside of it: to be
  /// called every now and then.
  [[nodiscard]] bool arrived() { return messages_.arrived(); }
  /// Waits until everything is here and all that was sent has left.
  void finish() { messages_.finish(); }

  /// Calls visit(node, values) for what came, in the order of the ranks: sums then repeat bit for bit.
  template <class F>
  void for_each_received(F&& visit) const {
    const Real* from = messages_.received().data();
    for (const SharedNodes& peer : received_) {
      for (const std::uint32_t node : peer.nodes) {
        visit(node, from);
        from += kChannels;
      }
    }
  }
  /// Adds what came to the nodes.
  void add_received(Real* nodes) const {
    for_each_received([&](std::uint32_t node, const Real* from) {
      for (int c = 0; c < kChannels; ++c) nodes[at(node, c)] += from[c];
    });
  }
  /// Makes what came the values of the nodes.
  void take_received(Real* nodes) const {
    for_each_received([&](std::uint32_t node, const Real* from) {
      for (int c = 0; c < kChannels; ++c) nodes[at(node, c)] = from[c];
    });
  }
  /// Sets the nodes that were sent to 0.
  void clear_sent(Real* nodes) const {
    for (const SharedNodes& peer : sent_) {
      for (const std::uint32_t node : peer.nodes) {
        for (int c = 0; c < kChannels; ++c) nodes[at(node, c)] = Real(0);
      }
    }
  }

 private:
  static constexpr std::size_t at(std::uint32_t node, int channel) {
    return std::size_t{node} * kChannels + static_cast<std::size_t>(channel);
  }
  static std::vector<MessageLength> lengths(const std::vector<SharedNodes>& peers) {
    std::vector<MessageLength> all;
    for (const SharedNodes& peer : peers) all.push_back({peer.rank, peer.nodes.size() * kChannels});
    return all;
  }

  std::vector<SharedNodes> sent_;
  std::vector<SharedNodes> received_;
  PersistentMessages<Real> messages_;
};

}  // namespace breccia::mpi

// Halo exchange: every node gets the sum of what all ranks put into it, and all ranks then see one value.
#include <gtest/gtest.h>

#include "mpi/halo.hpp"

namespace breccia::mpi {
namespace {

// Every rank holds nodes 0 .. n-1; node i belongs to rank i % size and is touched by all.
class Halo : public testing::Test {
 protected:
  static constexpr int kChannels = 8;
  static constexpr std::uint32_t kNodes = 24;
  using Exchange = NodeExchange<double, kChannels>;

  struct Shared {
    std::vector<SharedNodes> touched, owned;
  };
  // The nodes of other ranks that this one touches, and its own that others touch: every `stride`-th of all.
  [[nodiscard]] Shared shared(std::uint32_t stride) const {
    Shared all;
    for (int rank = 0; rank < comm_.size(); ++rank) {
      if (rank == comm_.rank()) continue;
      SharedNodes theirs{rank, {}};
      SharedNodes mine{rank, {}};
      for (std::uint32_t i = 0; i < kNodes; i += stride) {
        if (owner(i) == rank) theirs.nodes.push_back(i);
        if (owner(i) == comm_.rank()) mine.nodes.push_back(i);
      }
      all.touched.push_back(theirs);
      all.owned.push_back(mine);
    }
    return all;
  }
  [[nodiscard]] int owner(std::uint32_t node) const { return static_cast<int>(node) % comm_.size(); }

  // Sums to the owners and values back, checked.
  void round_trip(std::uint32_t stride) {
    std::vector<double> nodes(kNodes * kChannels);
    for (std::size_t i = 0; i < nodes.size(); ++i) nodes[i] = static_cast<double>(i + 1) * (comm_.rank() + 1);
    sums_.send(nodes.data());
    sums_.clear_sent(nodes.data());
    while (!sums_.arrived()) {
    }
    sums_.finish();
    sums_.add_received(nodes.data());
    const double ranks_sum = 0.5 * comm_.size() * (comm_.size() + 1);
    for (std::uint32_t i = 0; i < kNodes; i += stride) {
      for (std::size_t c = 0; c < kChannels; ++c) {
        const std::size_t at = i * kChannels + c;
        // Integers: sums are exact. Sent sums are cleared, or they would be counted twice in the next step.
        EXPECT_EQ(nodes[at], owner(i) == comm_.rank() ? static_cast<double>(at + 1) * ranks_sum : 0.0);
      }
    }
    values_.send(nodes.data());
    values_.finish();
    values_.take_received(nodes.data());
    for (std::uint32_t i = 0; i < kNodes; i += stride) {
      for (std::size_t at = i * kChannels; at < (i + 1) * kChannels; ++at) {
        EXPECT_EQ(nodes[at], static_cast<double>(at + 1) * ranks_sum);
      }
    }
  }

  void set(const Shared& nodes) {
    sums_.set(nodes.touched, nodes.owned, comm_);
    values_.set(nodes.owned, nodes.touched, comm_);
  }

  const Comm comm_;
  Exchange sums_{1};
  Exchange values_{2};
};

// The second time the requests are those of the first.
TEST_F(Halo, SumsGoToTheOwnerAndOneValueComesBack) {
  set(shared(1));
  round_trip(1);
  round_trip(1);
}

TEST_F(Halo, MessagesOfOtherLengths) {
  set(shared(1));
  round_trip(1);
  set(shared(5));
  round_trip(5);
}

TEST_F(Halo, TimeInFlightHoldsTheWait) {
  set(shared(1));
  round_trip(1);
  round_trip(1);
  for (const Flights& f : {sums_.flights(), values_.flights()}) {
    EXPECT_GE(f.in_flight.count(), f.waited.count());
    EXPECT_GE(f.waited.count(), 0.0);
    EXPECT_EQ(f.rounds, comm_.size() > 1 ? 2U : 0U);
  }
}

// An exchange may end at any point of a round, and the next one finds nothing of it in its way.
TEST_F(Halo, EndsWhileMessagesTravel) {
  const Shared nodes = shared(1);
  {
    Exchange sums{1};
    Exchange values{2};
    sums.set(nodes.touched, nodes.owned, comm_);
    values.set(nodes.owned, nodes.touched, comm_);
    const std::vector<double> other(kNodes * kChannels, 1e6);
    values.expect();
    sums.send(other.data());
  }
  set(nodes);
  round_trip(1);
}

}  // namespace
}  // namespace breccia::mpi

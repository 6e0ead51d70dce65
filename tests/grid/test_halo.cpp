// Halo exchange: every node gets the sum of what all ranks put into it, and all ranks then see one value.
#include <gtest/gtest.h>

#include "mpi/halo.hpp"

namespace breccia::mpi {
namespace {

// Every rank holds nodes 0 .. n-1; node i belongs to rank i % size and is touched by all.
TEST(Halo, SumsGoToTheOwnerAndOneValueComesBack) {
  const Comm comm;
  constexpr int kChannels = 8;
  constexpr std::uint32_t kNodes = 24;
  std::vector<SharedNodes> touched;
  std::vector<SharedNodes> owned;
  for (int rank = 0; rank < comm.size(); ++rank) {
    if (rank == comm.rank()) continue;
    SharedNodes theirs{rank, {}};
    SharedNodes mine{rank, {}};
    for (std::uint32_t i = 0; i < kNodes; ++i) {
      const int owner = static_cast<int>(i) % comm.size();
      if (owner == rank) theirs.nodes.push_back(i);
      if (owner == comm.rank()) mine.nodes.push_back(i);
    }
    touched.push_back(theirs);
    owned.push_back(mine);
  }
  Halo<double, kChannels> halo;
  halo.set(touched, owned);
  std::vector<double> nodes(kNodes * kChannels);
  for (std::size_t i = 0; i < nodes.size(); ++i) nodes[i] = static_cast<double>(i + 1) * (comm.rank() + 1);
  halo.add_to_owners(nodes.data(), comm);
  const double ranks_sum = 0.5 * comm.size() * (comm.size() + 1);
  for (std::uint32_t i = 0; i < kNodes; ++i) {
    const bool mine = static_cast<int>(i) % comm.size() == comm.rank();
    for (std::size_t c = 0; c < kChannels; ++c) {
      const std::size_t at = i * kChannels + c;
      // Integers: sums are exact. Sent sums are cleared, or they would be counted twice in the next step.
      EXPECT_EQ(nodes[at], mine ? static_cast<double>(at + 1) * ranks_sum : 0.0);
    }
  }
  halo.share_from_owners(nodes.data(), comm);
  for (std::size_t at = 0; at < nodes.size(); ++at) EXPECT_EQ(nodes[at], static_cast<double>(at + 1) * ranks_sum);
}

}  // namespace
}  // namespace breccia::mpi

// The census of particles in the memory of the host.
#pragma once

#include <optional>

#include "gravity/mesh/block_sieve.hpp"
#include "gravity/mesh/census.hpp"

namespace breccia::gravity {

class HostCensus final : public Census {
 public:
  /// Particles are kept by reference.
  HostCensus(ParticlesView particles, int threads) : particles_(particles), threads_(threads) {}

  [[nodiscard]] std::uint64_t particles() const override { return particles_.position.size(); }
  [[nodiscard]] Box bounds() override;
  [[nodiscard]] std::vector<BlockCount> occupied(double width) override;
  void divide(double width) override;
  [[nodiscard]] double mass() override { return sieve_->mass(); }
  [[nodiscard]] std::vector<BlockCount> crowded(std::int64_t least) override;
  [[nodiscard]] std::vector<std::int64_t> counts(std::span<const BlockIndex> blocks) override;
  [[nodiscard]] std::span<const Block> around(std::span<const BlockIndex> blocks) override;
  [[nodiscard]] std::vector<SetSum> sets(std::span<const Box> boxes) override;

  /// The set of each particle, as sets() found it last.
  [[nodiscard]] std::vector<std::uint8_t>& set_of_each() { return set_; }

 private:
  ParticlesView particles_;
  int threads_;
  std::optional<BlockSieve> sieve_;
  Blocks counted_;
  std::vector<std::uint8_t> set_;
};

}  // namespace breccia::gravity

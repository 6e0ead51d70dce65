// What the choice of boxes must know of the particles of a rank: how many there are in which blocks of space. All that
// grows with the particles is behind this interface; they may lie in the memory of the host or of a device.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gravity/mesh/blocks.hpp"
#include "gravity/mesh/box.hpp"

namespace breccia::gravity {

/// Particles in a block.
struct BlockCount {
  BlockIndex index;
  std::int32_t unused = 0;
  std::int64_t particles = 0;
};

/// Particles in a set (set_of()).
struct SetSum {
  std::uint64_t particles = 0;
  double mass = 0.0;  ///< [kg]
};

/// Of the particles of this rank. Lists come in any order.
class Census {
 public:
  Census() = default;
  Census(const Census&) = delete;
  Census& operator=(const Census&) = delete;
  virtual ~Census() = default;

  [[nodiscard]] virtual std::uint64_t particles() const = 0;
  /// Of their places, if there are any [m].
  [[nodiscard]] virtual Box bounds() = 0;
  /// All blocks of `width` [m] that hold a particle. Ends what divide() began.
  [[nodiscard]] virtual std::vector<BlockCount> occupied(double width) = 0;

  /// From now on blocks are this wide [m].
  virtual void divide(double width) = 0;
  /// Of all particles [kg], once they are divided.
  [[nodiscard]] virtual double mass() = 0;
  /// All blocks of at least `least` particles.
  [[nodiscard]] virtual std::vector<BlockCount> crowded(std::int64_t least) = 0;
  /// Particles in each of these blocks.
  [[nodiscard]] virtual std::vector<std::int64_t> counts(std::span<const BlockIndex> blocks) = 0;
  /// What these blocks and those around them hold, and perhaps some other ones. Valid until the next call.
  [[nodiscard]] virtual std::span<const Block> around(std::span<const BlockIndex> blocks) = 0;

  /// Of set 0 and of each box.
  [[nodiscard]] virtual std::vector<SetSum> sets(std::span<const Box> boxes) = 0;
};

}  // namespace breccia::gravity

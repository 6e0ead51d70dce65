// A box of space and the rule that deals particles out to boxes, on host and device.
#pragma once

#include <cstddef>
#include <cstdint>

#include "breccia/linalg.hpp"

namespace breccia::gravity {

inline constexpr std::size_t kMostBoxes = 4;

/// A box of space, [m]. Lower faces belong to it, upper ones do too.
struct Box {
  Vec3d low{}, high{};

  [[nodiscard]] BRECCIA_HD bool contains(Vec3d p) const {
    return p.x >= low.x && p.x <= high.x && p.y >= low.y && p.y <= high.y && p.z >= low.z && p.z <= high.z;
  }
};

/// 0 outside of all boxes, k in the first that contains p, boxes[k - 1].
BRECCIA_HD std::uint8_t set_of(Vec3d p, const Box* boxes, std::size_t count) {
  for (std::size_t k = 0; k < count; ++k) {
    if (boxes[k].contains(p)) return static_cast<std::uint8_t>(k + 1);
  }
  return 0;
}

/// Whether particles of one set feel those of another by the whole law: but for set 0, all except their own.
inline bool interact(std::size_t target, std::size_t source) { return target != source || target == 0; }

}  // namespace breccia::gravity

#include "grid/period_images.hpp"

#include <utility>

namespace breccia::grid {

template <class Real>
void PeriodImages::fold(std::span<const Image> images, const NodeColumns& columns, Real* sums, RowMask* rows) {
  for (const Image& image : images) {
    unsigned any = 0;
    for (std::size_t h = 0; h < 2; ++h) {
      const std::uint8_t marked = std::exchange(rows[image.block].half[h], std::uint8_t{0});
      rows[image.original].half[h] = static_cast<std::uint8_t>(rows[image.original].half[h] | marked);
      any |= marked;
    }
    if (any == 0) continue;
    for (std::uint32_t n = 0; n < kBlockNodes; ++n) {
      Real* const from = sums + std::size_t{columns.blocks()[image.block].node(n)} * kChannels;
      Real* const to = sums + std::size_t{columns.blocks()[image.original].node(n)} * kChannels;
      for (int c = 0; c < kChannels; ++c) to[c] += std::exchange(from[c], Real(0));
    }
  }
}

template void PeriodImages::fold(std::span<const Image>, const NodeColumns&, float*, RowMask*);
template void PeriodImages::fold(std::span<const Image>, const NodeColumns&, double*, RowMask*);

}  // namespace breccia::grid

#include "grid/blocks.hpp"

#include <algorithm>
#include <bit>

namespace breccia::grid {

void BlockTable::clear() {
  keys_.clear();
  std::fill(slots_.begin(), slots_.end(), 0U);
}

std::size_t BlockTable::slot(BlockKey key) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t at = key_hash(key, static_cast<unsigned>(std::bit_width(mask)));
  while (slots_[at] != 0 && keys_[slots_[at] - 1] != key) at = (at + 1) & mask;
  return at;
}

void BlockTable::reserve(std::size_t blocks) {
  // At most half of the slots are taken.
  const std::size_t slots = std::bit_ceil(2 * std::max<std::size_t>(1, blocks));
  if (slots > slots_.size()) grow(slots);
  keys_.reserve(blocks);
}

void BlockTable::grow(std::size_t slots) {
  slots_.assign(slots, 0U);
  for (std::size_t i = 0; i < keys_.size(); ++i) slots_[slot(keys_[i])] = static_cast<std::uint32_t>(i + 1);
}

std::uint32_t BlockTable::insert(BlockKey key) {
  std::uint32_t& last = last_[key % last_.size()];
  if (last < keys_.size() && keys_[last] == key) return last;
  if (2 * (keys_.size() + 1) > slots_.size()) grow(std::max<std::size_t>(1024, 2 * slots_.size()));
  const std::size_t at = slot(key);
  if (slots_[at] == 0) {
    keys_.push_back(key);
    slots_[at] = static_cast<std::uint32_t>(keys_.size());
  }
  last = slots_[at] - 1;
  return last;
}

std::uint32_t BlockTable::find(BlockKey key) const {
  if (slots_.empty()) return kNoBlock;
  const std::uint32_t found = slots_[slot(key)];
  return found == 0 ? kNoBlock : found - 1;
}

}  // namespace breccia::grid

#include "grid/blocks.hpp"

namespace breccia::grid {

void BlockTable::clear() {
  keys_.clear();
  std::fill(slots_.begin(), slots_.end(), 0U);
}

std::size_t BlockTable::slot(BlockKey key) const {
  const std::size_t mask = slots_.size() - 1;
  // Fibonacci hashing: neighbouring keys differ in their low bits only.
  std::size_t at = (key * 0x9E3779B97F4A7C15ULL >> 24) & mask;
  while (slots_[at] != 0 && keys_[slots_[at] - 1] != key) at = (at + 1) & mask;
  return at;
}

void BlockTable::grow() {
  slots_.assign(slots_.empty() ? 1024 : slots_.size() * 2, 0U);
  for (std::size_t i = 0; i < keys_.size(); ++i) slots_[slot(keys_[i])] = static_cast<std::uint32_t>(i + 1);
}

std::uint32_t BlockTable::insert(BlockKey key) {
  if (last_ < keys_.size() && keys_[last_] == key) return last_;
  if (2 * (keys_.size() + 1) > slots_.size()) grow();
  const std::size_t at = slot(key);
  if (slots_[at] == 0) {
    keys_.push_back(key);
    slots_[at] = static_cast<std::uint32_t>(keys_.size());
  }
  last_ = slots_[at] - 1;
  return last_;
}

std::uint32_t BlockTable::find(BlockKey key) const {
  if (slots_.empty()) return kNoBlock;
  const std::uint32_t found = slots_[slot(key)];
  return found == 0 ? kNoBlock : found - 1;
}

}  // namespace breccia::grid

#include "grid/sweep_board.hpp"

namespace breccia::grid {

SweepBoard::SweepBoard(const SweepPart& part, bool updates)
    : part_(part),
      pass_(part.planes.size(), State::kOpen),
      update_(part.planes.size(), updates ? State::kOpen : State::kDone),
      lowest_(part.homes.begin(), part.homes.end() - 1),
      open_(updates ? part.planes.size() : 0) {
  // Planes with nothing to pass over keep nobody waiting.
  for (std::size_t plane = 0; plane < pass_.size(); ++plane) {
    if (part.planes[plane].first == part.planes[plane].last) {
      pass_[plane] = State::kDone;
    } else {
      ++open_;
    }
  }
}

bool SweepBoard::pass_ready(std::uint32_t plane) const {
  if (pass_[plane] != State::kOpen) return false;
  const SweepPlane& own = part_.planes[plane];
  const auto in_order = [&](std::uint32_t near) {
    return near == kNoPlane || part_.planes[near].turn > own.turn || passed(near);
  };
  return in_order(own.left) && in_order(own.right);
}

bool SweepBoard::update_ready(std::uint32_t plane) const {
  const SweepPlane& own = part_.planes[plane];
  return update_[plane] == State::kOpen && passed(plane) && passed(own.left) && passed(own.right);
}

std::optional<SweepWork> SweepBoard::ready(std::uint32_t plane) const {
  if (pass_ready(plane)) return SweepWork{SweepWork::Kind::kPass, plane};
  if (update_ready(plane)) return SweepWork{SweepWork::Kind::kUpdate, plane};
  return std::nullopt;
}

std::optional<SweepWork> SweepBoard::take(int home) {
  const std::scoped_lock lock(mutex_);
  const auto taken = [&](SweepWork work) {
    (work.kind == SweepWork::Kind::kPass ? pass_ : update_)[work.plane] = State::kTaken;
    --open_;
    return work;
  };
  const std::size_t homes = lowest_.size();
  const auto own = static_cast<std::size_t>(home);
  const std::uint32_t end = part_.homes[own + 1];
  std::uint32_t& lowest = lowest_[own];
  while (lowest < end && pass_[lowest] != State::kOpen && update_[lowest] != State::kOpen) ++lowest;
  for (std::uint32_t plane = lowest; plane < end; ++plane) {
    if (const auto work = ready(plane)) return taken(*work);
  }
  for (std::size_t n = 1; n < homes; ++n) {
    const std::size_t other = (own + n) % homes;
    for (std::uint32_t plane = part_.homes[other + 1]; plane-- > lowest_[other];) {
      if (const auto work = ready(plane)) return taken(*work);
    }
  }
  return std::nullopt;
}

void SweepBoard::finish(SweepWork work) {
  const std::scoped_lock lock(mutex_);
  (work.kind == SweepWork::Kind::kPass ? pass_ : update_)[work.plane] = State::kDone;
}

}  // namespace breccia::grid

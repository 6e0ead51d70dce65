#include "material/flaws.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>

#include "breccia/error.hpp"
#include "breccia/random.hpp"
#include "material/flaw_codes.hpp"

namespace breccia::material {
namespace {

/// Keeps the draws of flaws apart from other random numbers with the same seed; the body index is added.
constexpr std::uint32_t kFlawStream = 0x464C0000U;

/// One bit per particle of a body.
class BitSet {
 public:
  explicit BitSet(std::uint64_t size) : words_(size / 64 + 1) {}
  [[nodiscard]] bool test(std::uint64_t i) const { return (words_[i / 64] >> (i % 64) & 1U) != 0; }
  void set(std::uint64_t i) { words_[i / 64] |= std::uint64_t{1} << (i % 64); }
  [[nodiscard]] const std::vector<std::uint64_t>& words() const { return words_; }

 private:
  std::vector<std::uint64_t> words_;
};

/// Finds the place of an index in a list of distinct indices, in constant time and 1.5 bits per particle of the body.
class IndexMap {
 public:
  IndexMap(std::uint64_t size, std::span<const std::uint64_t> indices) : member_(size) {
    for (const std::uint64_t i : indices) {
      if (i >= size)
        throw UsageError("flaws: particle " + std::to_string(i) + " asked for, but the body has " +
                         std::to_string(size) + " particles");
      member_.set(i);
    }
    std::uint32_t count = 0;
    for (const std::uint64_t word : member_.words()) {
      before_.push_back(count);
      count += static_cast<std::uint32_t>(std::popcount(word));
    }
    if (std::is_sorted(indices.begin(), indices.end())) return;
    place_.resize(indices.size());
    for (std::size_t i = 0; i < indices.size(); ++i) place_[rank(indices[i])] = static_cast<std::uint32_t>(i);
  }

  [[nodiscard]] std::optional<std::uint32_t> find(std::uint64_t i) const {
    if (!member_.test(i)) return std::nullopt;
    return place_.empty() ? rank(i) : place_[rank(i)];
  }

 private:
  /// Number of members below i.
  [[nodiscard]] std::uint32_t rank(std::uint64_t i) const {
    const std::uint64_t below = (std::uint64_t{1} << (i % 64)) - 1;
    return before_[i / 64] + static_cast<std::uint32_t>(std::popcount(member_.words()[i / 64] & below));
  }

  BitSet member_;
  std::vector<std::uint32_t> before_;  ///< members in the words before this one
  std::vector<std::uint32_t> place_;   ///< place in the list, by rank; empty for an ascending list
};

/// Draws flaws 1, 2, ... until no particle is without; calls visit(j, particle). Returns the number of flaws.
template <class Visit>
std::uint64_t draw_until_covered(std::uint64_t particles, const RandomStream& random, Visit visit) {
  BitSet covered(particles);
  std::uint64_t bare = particles;
  std::uint64_t j = 0;
  while (bare > 0) {
    const std::uint64_t particle = random.below(++j, particles);
    if (!covered.test(particle)) {
      covered.set(particle);
      --bare;
    }
    visit(j, particle);
  }
  return j;
}

}  // namespace

std::int32_t flaw_place(std::size_t place) {
  if (place > std::numeric_limits<std::int32_t>::max()) {
    throw NumericsError("a rank has more than 2^31 flaws, as some 1e8 particles have: use more ranks");
  }
  return static_cast<std::int32_t>(place);
}

FlawLists draw_flaws(std::uint64_t particles_in_body, double body_volume, const DamageParameters& damage,
                     std::uint64_t seed, std::uint32_t body, std::span<const std::uint64_t> wanted) {
  FlawLists lists;
  lists.first.assign(wanted.size() + 1, 0);
  const IndexMap place(particles_in_body, wanted);
  if (wanted.empty()) return lists;
  const RandomStream random(seed, kFlawStream + body);

  // Twice the same draws, first to count and then to fill: cheaper than keeping them all.
  const std::uint64_t flaws = draw_until_covered(particles_in_body, random, [&](std::uint64_t, std::uint64_t particle) {
    if (const auto row = place.find(particle)) ++lists.first[*row + 1];
  });
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    sum += lists.first[i + 1];
    lists.first[i + 1] = static_cast<std::uint32_t>(flaw_place(sum));
  }

  lists.threshold.resize(lists.first.back());
  std::vector<std::uint32_t> next(lists.first.begin(), lists.first.end() - 1);
  // In logarithms: k reaches 1e61 and eps^m underflows (hard case 28).
  const double log_flaw_scale = std::log(damage.weibull_k) + std::log(body_volume);
  for (std::uint64_t j = 1; j <= flaws; ++j) {
    if (const auto row = place.find(random.below(j, particles_in_body))) {
      const double log_threshold = (std::log(static_cast<double>(j)) - log_flaw_scale) / damage.weibull_m;
      lists.threshold[next[*row]++] = threshold_of(flaw_code(static_cast<float>(std::exp(log_threshold))));
    }
  }
  return lists;
}

}  // namespace breccia::material

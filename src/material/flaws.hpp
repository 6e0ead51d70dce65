// Explicit Weibull flaws of a body (Benz & Asphaug 1995; physics.md 3).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "breccia/material_parameters.hpp"

namespace breccia::material {

/// Flaw thresholds of a list of particles in compressed rows: particle i owns threshold[first[i]] .. [first[i+1] - 1].
struct FlawLists {
  std::vector<std::uint32_t> first;  ///< n + 1 entries
  std::vector<float> threshold;      ///< strains, ascending per particle, as flaw_codes.hpp rounds them

  [[nodiscard]] std::span<const float> of(std::size_t i) const {
    return std::span<const float>(threshold).subspan(first[i], first[i + 1] - first[i]);
  }
};

/// The place of a flaw among those of a rank, as its particle keeps it. Throws NumericsError from 2^31 flaws on, those
/// of some 1e8 particles.
std::int32_t flaw_place(std::size_t place);

/// Flaw j = 1, 2, ... has the threshold (j / (k V))^(1/m), rounded to 11 bits (flaw_codes.hpp), and goes to a particle
/// of the body drawn uniformly, until every particle has at least one. `body_volume` V [m3]. `wanted` lists distinct
/// indices within the body, in any order; the rows of the result follow it. What a particle gets depends on seed, body
/// and its index alone, so every rank draws the same flaws. Throws UsageError if an index is not below
/// particles_in_body, NumericsError where flaw_place() does.
FlawLists draw_flaws(std::uint64_t particles_in_body, double body_volume, const DamageParameters& damage,
                     std::uint64_t seed, std::uint32_t body, std::span<const std::uint64_t> wanted);

}  // namespace breccia::material

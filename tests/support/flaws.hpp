// Flaws of particles whatever rank or order they are in.
#pragma once

#include "breccia/particle_arrays.hpp"
#include "breccia/scene.hpp"
#include "material/flaws.hpp"

namespace breccia::test {

/// Those of basalt with seed 1, row by row for `particles`.
inline material::FlawLists flaws_of(const Scene& scene, const ParticleArrays& particles) {
  material::FlawLists lists;
  lists.first.push_back(0);
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const BodyParameters& body = scene.bodies[particles.body[i]];
    const std::uint64_t index = particles.id[i] - body.first_id;
    const auto one = material::draw_flaws(body.particles, body.mass / 2700.0, {}, 1, particles.body[i], {&index, 1});
    lists.threshold.insert(lists.threshold.end(), one.threshold.begin(), one.threshold.end());
    lists.first.push_back(static_cast<std::uint32_t>(lists.threshold.size()));
  }
  return lists;
}

}  // namespace breccia::test

#include "scene/body_points.hpp"

#include <cstring>

#include "scene/from_root.hpp"

namespace breccia::scene {

LatticeFill body_lattice(const Scene& scene, std::uint32_t index) {
  // Streams of lattices start far from those of other purposes.
  constexpr std::uint32_t kLatticeStream = 0x4C000000U;
  const BodyParameters& body = scene.bodies[index];
  const RandomStream stream(scene.seed, kLatticeStream + index);
  return {body.lattice, body.shape, body.semi_axes, body.particles, stream};
}

ParticleFileSummary shared_file_summary(const std::string& path, const mpi::Comm* comm) {
  const std::string bytes = from_root(comm, [&] {
    const ParticleFileSummary summary = summarize_particle_file(path);
    std::string raw(sizeof summary, '\0');
    std::memcpy(raw.data(), &summary, sizeof summary);
    return raw;
  });
  ParticleFileSummary summary;
  std::memcpy(&summary, bytes.data(), sizeof summary);
  return summary;
}

}  // namespace breccia::scene

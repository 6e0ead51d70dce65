// The step of physics.md 5 written plainly: double precision, scalar, one node at a time, a map for a grid. Slow and
// obviously right; the engine is tested against it.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "breccia/particle_arrays.hpp"
#include "material/constitutive.hpp"
#include "material/flaws.hpp"

namespace breccia::test {

struct ReferenceParticle {
  Vec3d x, v;
  double mass = 0.0;
  double growth = 0.0;  ///< c_g / R_s [1/s]
  Mat3<double> c{};
  material::State<double> state{};
  std::vector<float> flaws;
  std::uint32_t active = 0;
};

struct ReferenceSetup {
  double cell = 0.0;
  double alpha = 0.995;
  double beta = 1.0;
  Vec3d gravity{};
  Vec3d spin{};  ///< of all particles at the start [rad/s]
  material::RuntimeEffects effects;
  MaterialParameters material;
};

class ReferenceStep {
 public:
  ReferenceStep(const ReferenceSetup& setup, const ParticleArrays& particles, const material::FlawLists& flaws);
  void step(double dt);
  [[nodiscard]] const std::vector<ReferenceParticle>& particles() const { return particles_; }

 private:
  using Index = std::array<int, 3>;
  struct Node {
    double mass = 0.0;
    Vec3d momentum{}, force{}, old_velocity{}, velocity{};
  };
  void p2g(double dt);
  void g2p(double dt);
  void damage(ReferenceParticle& p, double dt) const;

  ReferenceSetup setup_;
  material::Constants<double> constants_;
  std::vector<ReferenceParticle> particles_;
  std::map<Index, Node> grid_;
};

}  // namespace breccia::test

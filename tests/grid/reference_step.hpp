// The step of physics.md 5 written plainly: double precision, scalar, one node at a time, a map for a grid. Slow and
// obviously right; the engine is tested against it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
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
  Sym3<double> tau{};  ///< of the last p2g [Pa]
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

/// What changes the sum of sum m v^2/2 and internal energy without a force from outside, from one half step to the
/// next, summed over all steps [J]. With it the sum is kept to rounding.
struct EnergyTerms {
  double affine =
      0.0;  ///< -dt f . v_C, v_C = sum w m C r / m_i: what forces do to C is booked as heat, but C is made anew
  double gradient = 0.0;   ///< half of dt V0 tau : (C - gathered C of the scattered velocity)
  double filter = 0.0;     ///< what particles do not take over of the impulses of the nodes; never positive
  double smoothing = 0.0;  ///< -(1 - alpha) of the velocity that the grid does not resolve
  [[nodiscard]] double sum() const { return affine + gradient + filter + smoothing; }
};

class ReferenceStep {
 public:
  ReferenceStep(const ReferenceSetup& setup, const ParticleArrays& particles, const material::FlawLists& flaws);
  void step(double dt);
  [[nodiscard]] const std::vector<ReferenceParticle>& particles() const { return particles_; }
  [[nodiscard]] const EnergyTerms& energy_terms() const { return terms_; }

 private:
  using Index = std::array<int, 3>;
  struct Hash {
    std::size_t operator()(const Index& n) const {
      return static_cast<std::size_t>(n[0]) * 73856093U ^ static_cast<std::size_t>(n[1]) * 19349663U ^
             static_cast<std::size_t>(n[2]) * 83492791U;
    }
  };
  struct Node {
    double mass = 0.0;
    Vec3d momentum{}, force{}, old_velocity{}, velocity{};
    Vec3d affine{};  ///< the part of momentum that is m C r
  };
  void p2g(double dt);
  void g2p(double dt);
  void damage(ReferenceParticle& p, double dt) const;

  ReferenceSetup setup_;
  material::Constants<double> constants_;
  std::vector<ReferenceParticle> particles_;
  EnergyTerms terms_;
  std::unordered_map<Index, Node, Hash> grid_;
};

}  // namespace breccia::test

// The physics source compiled for CUDA threads: one particle a thread through the strain and stress functions that the
// host engine calls with packs. Building it is the test: no host-only construct may creep into the physics.
#include "material/constitutive.hpp"
#include "material/effects_policy.hpp"

namespace breccia::material {

template <class Fx, class R>
__global__ void update_particles(Constants<R> constants, State<R>* states, const Mat3<R>* gradients, Sym3<R>* stresses,
                                 R step, int count) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i >= count) return;
  State<R> state = states[i];
  Dissipation<R> lost;
  update_strain(Fx{}, constants, state, gradients[i], step);
  stresses[i] = update_stress(Fx{}, constants, state, gradients[i], R(0.5) * step, lost);
  states[i] = state;
}

#define BRECCIA_INSTANTIATE(Fx, R) \
  template __global__ void update_particles<Fx, R>(Constants<R>, State<R>*, const Mat3<R>*, Sym3<R>*, R, int);
BRECCIA_INSTANTIATE(RockEffects, float)
BRECCIA_INSTANTIATE(RockEffects, double)
BRECCIA_INSTANTIATE(GranularEffects, float)
BRECCIA_INSTANTIATE(GranularEffects, double)
BRECCIA_INSTANTIATE(FluidEffects, float)
BRECCIA_INSTANTIATE(FluidEffects, double)
#undef BRECCIA_INSTANTIATE

}  // namespace breccia::material

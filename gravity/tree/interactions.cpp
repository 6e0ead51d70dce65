// Picks the copy of the tree's inner loops that fits the running processor.
#include "gravity/tree/interactions.hpp"

#include "breccia/isa.hpp"

namespace breccia::gravity {

#ifdef BRECCIA_HAVE_V2
namespace isa_v2 {
template <class Real>
const InteractionKernels<Real>& kernels();
}
#endif
#ifdef BRECCIA_HAVE_V3
namespace isa_v3 {
template <class Real>
const InteractionKernels<Real>& kernels();
}
#endif
#ifdef BRECCIA_HAVE_V4
namespace isa_v4 {
template <class Real>
const InteractionKernels<Real>& kernels();
}
#endif

template <class Real>
const InteractionKernels<Real>& interaction_kernels() {
  switch (active_isa()) {
#ifdef BRECCIA_HAVE_V4
    case Isa::kV4:
      return isa_v4::kernels<Real>();
#endif
#ifdef BRECCIA_HAVE_V3
    case Isa::kV3:
      return isa_v3::kernels<Real>();
#endif
#ifdef BRECCIA_HAVE_V2
    case Isa::kV2:
      return isa_v2::kernels<Real>();
#endif
    default:
      __builtin_unreachable();  // active_isa() returns only what was compiled in
  }
}

template const InteractionKernels<float>& interaction_kernels<float>();
template const InteractionKernels<double>& interaction_kernels<double>();

}  // namespace breccia::gravity

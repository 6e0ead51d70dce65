// Picks the copy of the kernels that fits the running processor.
#include "breccia/isa.hpp"
#include "grid/tile.hpp"

namespace breccia::grid {

#ifdef BRECCIA_HAVE_V2
namespace isa_v2 {
template <class P>
const Kernels<P>& kernels();
}
#endif
#ifdef BRECCIA_HAVE_V3
namespace isa_v3 {
template <class P>
const Kernels<P>& kernels();
}
#endif
#ifdef BRECCIA_HAVE_V4
namespace isa_v4 {
template <class P>
const Kernels<P>& kernels();
}
#endif

template <class P>
const Kernels<P>& active_kernels() {
  switch (active_isa()) {
#ifdef BRECCIA_HAVE_V4
    case Isa::kV4:
      return isa_v4::kernels<P>();
#endif
#ifdef BRECCIA_HAVE_V3
    case Isa::kV3:
      return isa_v3::kernels<P>();
#endif
#ifdef BRECCIA_HAVE_V2
    case Isa::kV2:
      return isa_v2::kernels<P>();
#endif
    default:
      __builtin_unreachable();  // active_isa() returns only what was compiled in
  }
}

template const Kernels<MixedPrecision>& active_kernels<MixedPrecision>();
template const Kernels<DoublePrecision>& active_kernels<DoublePrecision>();

}  // namespace breccia::grid

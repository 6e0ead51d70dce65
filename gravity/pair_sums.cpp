// Chooses the compiled copy of the pair kernel.
#include "breccia/isa.hpp"
#include "gravity/pair_kernel.hpp"

namespace breccia::gravity {
namespace {

template <class Real>
void dispatch(const PairTask<Real>& task) {
  // active_isa() only names copies that were compiled in.
  switch (active_isa()) {
    case Isa::kV4:
#ifdef BRECCIA_HAVE_V4
      isa_v4::sum_pairs(task);
#endif
      break;
    case Isa::kV3:
#ifdef BRECCIA_HAVE_V3
      isa_v3::sum_pairs(task);
#endif
      break;
    case Isa::kV2:
#ifdef BRECCIA_HAVE_V2
      isa_v2::sum_pairs(task);
#endif
      break;
  }
}

}  // namespace

void sum_pairs(const PairTask<float>& task) { dispatch(task); }
void sum_pairs(const PairTask<double>& task) { dispatch(task); }

}  // namespace breccia::gravity

// Chooses the compiled copies of the mesh kernels.
#include "breccia/isa.hpp"
#include "gravity/mesh/mesh_kernels.hpp"

// active_isa() only names copies that were compiled in.
#ifdef BRECCIA_HAVE_V4
#define BRECCIA_CALL_V4(call) isa_v4::call
#else
#define BRECCIA_CALL_V4(call) static_cast<void>(0)
#endif
#ifdef BRECCIA_HAVE_V3
#define BRECCIA_CALL_V3(call) isa_v3::call
#else
#define BRECCIA_CALL_V3(call) static_cast<void>(0)
#endif
#ifdef BRECCIA_HAVE_V2
#define BRECCIA_CALL_V2(call) isa_v2::call
#else
#define BRECCIA_CALL_V2(call) static_cast<void>(0)
#endif

#define BRECCIA_DISPATCH(call) \
  switch (active_isa()) {      \
    case Isa::kV4:             \
      BRECCIA_CALL_V4(call);   \
      break;                   \
    case Isa::kV3:             \
      BRECCIA_CALL_V3(call);   \
      break;                   \
    case Isa::kV2:             \
      BRECCIA_CALL_V2(call);   \
      break;                   \
  }

namespace breccia::gravity {

void assign_masses(const AssignTask<float>& task) { BRECCIA_DISPATCH(assign_masses(task)) }
void assign_masses(const AssignTask<double>& task) { BRECCIA_DISPATCH(assign_masses(task)) }
void take_differences(const DifferenceTask<float>& task) { BRECCIA_DISPATCH(take_differences(task)) }
void take_differences(const DifferenceTask<double>& task) { BRECCIA_DISPATCH(take_differences(task)) }
void interpolate(const InterpolateTask<float>& task) { BRECCIA_DISPATCH(interpolate(task)) }
void interpolate(const InterpolateTask<double>& task) { BRECCIA_DISPATCH(interpolate(task)) }
void sum_near(const NearTask<float>& task) { BRECCIA_DISPATCH(sum_near(task)) }
void sum_near(const NearTask<double>& task) { BRECCIA_DISPATCH(sum_near(task)) }

}  // namespace breccia::gravity

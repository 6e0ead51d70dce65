// The engine on the emulated device, for the scenes of impact_cases.hpp.
#pragma once

#include "cuda/cuda_engine.hpp"
#include "grid/setup_choices.hpp"
#include "tests/cuda/impact_cases.hpp"

namespace breccia::cuda {

using cuda_emulation::Order;

inline std::unique_ptr<Engine> make_cuda_engine(const EngineSetup& setup, const mpi::Comm& comm = self()) {
  if (setup.numerics.precision == Precision::kDouble) return std::make_unique<CudaEngine<DoublePrecision>>(setup, comm);
  return std::make_unique<CudaEngine<MixedPrecision>>(setup, comm);
}

// What is asked of a device for a rank's state.
inline std::uint64_t bytes_asked(const EngineSetup& setup, const Load& load) {
  const auto of = [&]<class P>(P) {
    return bytes_needed<P>(DeviceParticles<P>(grid::groups_for(setup)).record_bytes(), load);
  };
  return setup.numerics.precision == Precision::kDouble ? of(DoublePrecision{}) : of(MixedPrecision{});
}

}  // namespace breccia::cuda

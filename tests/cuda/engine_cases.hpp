// The engine on the emulated device, for the scenes of impact_cases.hpp.
#pragma once

#include "cuda/cuda_engine.hpp"
#include "tests/cuda/impact_cases.hpp"

namespace breccia::cuda {

using cuda_emulation::Order;

inline std::unique_ptr<Engine> make_cuda_engine(const EngineSetup& setup, const mpi::Comm& comm = self()) {
  if (setup.numerics.precision == Precision::kDouble) return std::make_unique<CudaEngine<DoublePrecision>>(setup, comm);
  return std::make_unique<CudaEngine<MixedPrecision>>(setup, comm);
}

}  // namespace breccia::cuda

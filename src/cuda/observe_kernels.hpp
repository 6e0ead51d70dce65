// What time control, diagnostics and output read from the device, and the kick of gravity. Not in the repeated step.
#pragma once

#include "cuda/device_runtime.hpp"
#include "cuda/step_arguments.hpp"

namespace breccia::cuda {

template <class Real>
struct ProbeArguments {
  PassArguments<Real> pass;
  Real* new_velocity = nullptr;  ///< [3][count] v_p^{n+1/2} [m/s]
  Real* node_mass = nullptr;     ///< [count] sum of w m_i [kg]
  Real* gradient = nullptr;      ///< [9][count] C^{n+1/2}, row by row [1/s]
  unsigned count = 0;
};
/// Of a particle.
inline constexpr std::size_t kProbedReals = 3 + 1 + 9;
template <class Real>
void launch_probe(const ProbeArguments<Real>& a, cudaStream_t stream);

/// total := sums of all thread blocks of the passes, added in a fixed order; the largest of their moves.
void launch_total(const PassSums* sums, unsigned count, PassSums* total, cudaStream_t stream);

/// v -= time * g with the held and the uniform gravity.
template <class Real>
void launch_kick(const PassArguments<Real>& a, const Vec3d& uniform, double time, unsigned count, cudaStream_t stream);

/// Largest sound speed [m/s], particle speed along an axis [m/s] and -tr C [1/s], as bits of doubles that are not
/// negative: those order like integers. All from 0.
struct FastestSignals {
  unsigned long long sound, particle, compression;
};
template <class Real>
void launch_signals(const PassArguments<Real>& a, const material::Constants<double>* materials, unsigned count,
                    FastestSignals* fastest, cudaStream_t stream);

/// Counts particles with D < 1.
template <class Real>
void launch_count_unbroken(const Real* damage_root, unsigned count, unsigned* unbroken, cudaStream_t stream);

}  // namespace breccia::cuda

#include "gravity/mesh/settings.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

#include "breccia/error.hpp"
#include "gravity/mesh/boxes.hpp"

namespace breccia::gravity {
namespace {

// A narrower split is beyond what TSC on the mesh resolves.
constexpr double kLeastSplit = 0.6;

// Measured in state (a) of gravity.md 3 at 1.3 true spacings per cell: splits of 0.70, 0.81, 1.05 cells, with cutoffs
// that grow with them, left rms errors of 6.5e-4, 3.8e-4, 1.1e-4. The power of the error goes through these.
double split_for(double error) { return std::clamp(0.8 * std::pow(4.3e-4 / error, 0.21), 0.7, 1.7); }
double cutoff_for(double split) { return std::clamp(4.5 + 2.4 * (split - 0.8), 4.2, 6.5); }

// What the split must leave of Parameters::error in a box of so many particles. Errors are those of near neighbours,
// whose pull compares to the body's as spacing to radius: the same split leaves a third more with a third of the
// particles. More than those of state (a) leave less, which is kept (gravity.md 7). In steps, as kernels are made anew
// for each split.
double share_of_error(std::uint64_t particles) {
  constexpr std::uint64_t kUsual = 65'536;
  return particles >= kUsual ? 1.0 : std::cbrt(static_cast<double>(std::bit_floor(particles)) / kUsual);
}

}  // namespace

GaussianSplit split_of_box(const Parameters& p, double cell, std::uint64_t particles) {
  GaussianSplit split{.softening = p.softening / cell};
  split.scale = p.mesh.split > 0.0 ? p.mesh.split : split_for(p.error * share_of_error(particles));
  split.cutoff = split.scale * (p.mesh.cutoff > 0.0 ? p.mesh.cutoff : cutoff_for(split.scale));
  return split;
}

const Parameters& with_checked_mesh(const Parameters& p) {
  if (p.mesh.split != 0.0 && !(p.mesh.split >= kLeastSplit)) {
    throw UsageError("gravity.split = " + std::to_string(p.mesh.split) + ": must be at least 0.6 mesh cells");
  }
  if (!(p.mesh.cell >= 0.0)) {
    throw UsageError("gravity.mesh = " + std::to_string(p.mesh.cell) + " m: must not be negative");
  }
  fit_short_range<double>(split_of_box(p, 1.0, kLeastBoxParticles));
  return p;
}

}  // namespace breccia::gravity

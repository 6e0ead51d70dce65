#include "gravity/mesh/settings.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "breccia/error.hpp"
#include "gravity/mesh/split.hpp"

namespace breccia::gravity {
namespace {

// A narrower split is beyond what TSC on the mesh resolves.
constexpr double kLeastSplit = 0.6;

// Measured in state (a) of gravity.md 3 at 1.3 true spacings per cell: splits of 0.70, 0.81, 1.05 cells, with cutoffs
// that grow with them, left rms errors of 6.5e-4, 3.8e-4, 1.1e-4. The power of the error goes through these.
double split_for(double error) { return std::clamp(0.8 * std::pow(4.3e-4 / error, 0.21), 0.7, 1.7); }
double cutoff_for(double split) { return std::clamp(4.5 + 2.4 * (split - 0.8), 4.2, 6.5); }

}  // namespace

Parameters with_mesh_settings(Parameters p) {
  MeshParameters& mesh = p.mesh;
  if (mesh.split == 0.0) mesh.split = split_for(p.error);
  if (mesh.cutoff == 0.0) mesh.cutoff = cutoff_for(mesh.split);
  if (!(mesh.split >= kLeastSplit)) {
    throw UsageError("gravity.split = " + std::to_string(mesh.split) + ": must be at least 0.6 mesh cells");
  }
  if (!(mesh.cell >= 0.0)) throw UsageError("gravity.mesh = " + std::to_string(mesh.cell) + " m: must not be negative");
  fit_short_range<double>({mesh.split, mesh.split * mesh.cutoff, 0.0});
  return p;
}

}  // namespace breccia::gravity

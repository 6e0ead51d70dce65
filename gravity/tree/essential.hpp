// Locally essential trees (gravity.md 5.4): of the cells below its leaves a rank sends each other rank those that one
// of its targets may ask for, found by the walk's own rules.
#pragma once

#include <span>

#include "gravity/tree/shared_tree.hpp"

namespace breccia::gravity {

/// What travelled to this rank, and from it.
struct EssentialCount {
  double cells = 0.0, particles = 0.0;
  double bytes_sent = 0.0;
};

/// Adds to `sources` what walks of `targets` (which may hold `sources` itself) will open there; `tolerance` is that of
/// the walks. Only once after build(). Collective.
EssentialCount import_essential(SharedTree& sources, std::span<const SharedTree* const> targets, double tolerance,
                                const mpi::Comm& comm);

}  // namespace breccia::gravity

// What a group of targets feels, and what a cell's local expansion collects: the inner loops of the tree, compiled once
// per instruction set. No containers here: see breccia_add_kernels.
#pragma once

#include <cstdint>

#include "breccia/linalg.hpp"
#include "gravity/tree/cell.hpp"
#include "gravity/tree/opening.hpp"

namespace breccia::gravity {

/// Registers of any instruction set and type divide this; arrays of targets are padded to it.
inline constexpr std::int64_t kLanePadding = 16;
BRECCIA_HD std::int64_t lane_padded(std::int64_t n) { return (n + kLanePadding - 1) / kLanePadding * kLanePadding; }

/// Distant cells: those of `all` that `list` names.
struct CellRefs {
  const Cell* all;
  const std::int32_t* list;
  std::int64_t count;
};

/// Positions and masses in double, one array per component.
struct MassArrays {
  const double* position[3];
  const double* mass;
};

struct Range {
  std::int32_t begin, end;
};

/// All that acts on the targets [begin, end) of `targets`; its fields are added to accelerations and potentials.
template <class Real>
struct GroupTask {
  MassArrays targets;
  std::int64_t begin, end;
  Vec3d centre;                       ///< origin of the relative coordinates, and of `far`
  const LocalExpansion<double>* far;  ///< null: none
  CellRefs cells;                     ///< seen with monopole and quadrupole
  MassArrays sources;                 ///< summed particle by particle ...
  const Range* ranges;                ///< ... in these ranges
  std::int64_t range_count;
  bool self;               ///< the first range is the targets themselves
  bool split_coordinates;  ///< closest particles are close enough to need two floats per coordinate
  Real softening_squared;
  double* acceleration[3];
  double* potential;  ///< null: not wanted
  Real* reals;        ///< working memory, see below
  double* doubles;
};

/// Working memory of a task with this many targets and sources.
BRECCIA_HD std::int64_t reals_needed(std::int64_t targets, std::int64_t sources) {
  return 6 * lane_padded(targets) + 7 * sources;
}
BRECCIA_HD std::int64_t doubles_needed(std::int64_t targets) { return 4 * lane_padded(targets); }

/// Adds the fields of cells to the expansion around `centre`.
template <class Real>
struct ExpansionTask {
  CellRefs cells;
  Vec3d centre;
  Real softening_squared;
  LocalExpansion<double>* expansion;
};

/// How each of the cells is to be taken for a target (opening.hpp).
struct OpeningTask {
  CellRefs sources;
  const Cell* target;
  double largest_error;
  Opening* how;  ///< for each source; for a target that is no group kExpand or kOpen
};

/// The inner loops as compiled for one instruction set.
template <class Real>
struct InteractionKernels {
  void (*evaluate_group)(const GroupTask<Real>& task);
  void (*expand)(const ExpansionTask<Real>& task);
  void (*decide)(const OpeningTask& task);
};

/// The copy this processor runs fastest (breccia::active_isa).
template <class Real>
const InteractionKernels<Real>& interaction_kernels();

}  // namespace breccia::gravity

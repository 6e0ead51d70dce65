#include "io/output_reference.hpp"

#include <fmt/format.h>

#include "io/diagnostics.hpp"
#include "io/fields.hpp"

namespace breccia::io {

namespace {

constexpr const char* kText = R"(# Output files

Everything is in SI units. Files appear under their name only when they are complete.
The tables of this page are made by the program; a test keeps them in step.

## `snap_NNNN.hdf`

One HDF5 file per output time, always one at the start and one at the end. ParaView (5.11 and later) and PyVista open it as
it is: it is a VTKHDF `UnstructuredGrid` of version 1.0 with one vertex cell per particle. `run.hdf.series` lists the
snapshots with their times; open that one for a time series. Particles stand in the order of `ParticleIDs`, so files do not
depend on the number of ranks. `/PartType0` holds the same datasets under the names below (hard links), each with the
attributes `Units` and `Description`. A field whose effect is off is left out.

{fields}
`/Header` has the attributes `Time` [s], `Step`, `CellSize` [m], `TargetMass` (heaviest initial body) [kg], `Period` (three
lengths of the periodic domain, 0 where it is not periodic) [m], `NumberOfParticles`, `Fields`, `SceneName`, `CodeName` and
`CodeVersion`; `/Parameters/Scene` has the keys of the scene as resolved that a run may not change while it goes on, as
JSON; `/Units` says SI.

## `diagnostics.csv`

One line per output step. The first line names the columns with their units; numbers have the 17 digits that give the
double precision value back exactly.

{diagnostics}
## `checkpoint_NNNN.h5`

A checkpoint: everything a run needs to go on, bit for bit, in parallel HDF5 with a CRC-32 of the whole file behind its end
and, in the attribute `Checksum`, one of the values of each dataset as they were in memory.
`/Particles` has the fields of the engine by their bits, in storage order (the flaws of the particles are drawn again
from the scene); `/Engine` the slabs and the particles of each rank; `/Run` the rest as JSON. The
newest `output.keep` stay. They are read by the version that wrote them, on any number of ranks; for results take snapshots.

## `dump.hdf`, `dump.json`

Left by a run that ended with exit code 3, the numbers having gone wrong: all particles as a snapshot, but with the
velocities of half a step before and without `GridDensity`; and the error with the particle at fault, `particle`, before and
after the step that broke it, or, if it is none by itself, `fastest_particle`.

## `summary.json`

Written at the end, removed when a run goes on to a later one: `particles`, `steps`, `simulated_time` [s], `time_step` (the last) [s], `wall_seconds`, `ranks`, `threads`, `device`, `precision`,
`particle_steps_per_second`; `conservation` with the drifts of `mass` (over the total mass), `momentum` (over sum m |v|),
`angular_momentum` (over sum m |x cross v|) and `energy` (over max(kinetic + |potential|)); `damaged_fraction`; `clamped_volumes`; `remnants`,
largest first; `stages` with the wall time of each stage of the step on the first rank, parts of gravity as `gravity: part` and also
in `gravity`; `halo` with `in_flight_seconds`, `waited_seconds` and `bytes_per_step` of all ranks, `hidden_fraction` and `key_exchanges` (null on
one rank; overlap.md); `gravity` with `evaluations` of each method, `reason` and `boxes` of the last one, `pairs`,
`cell_interactions`, `expansions`, `bytes_sent` of all ranks and `net_force`, the largest over sum m |a|; `slabs` with the
`axis` they cut across, `imbalance_mean`, `imbalance_max` and `imbalance` (in the last of `windows`), the largest over the mean
counted work of the ranks, `recuts` of slabs, and `halo_bytes_mean` and `halo_bytes_max` that a rank sends in a step at the end;
`versions`; `machine`; `scene`, every key as resolved;
`used` and `unused`, the keys of the scene that had and had not an effect.
)";

}  // namespace

std::string output_reference() {
  return fmt::format(kText, fmt::arg("fields", fields_table()), fmt::arg("diagnostics", diagnostics_table()));
}

}  // namespace breccia::io

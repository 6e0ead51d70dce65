// Snapshots: one HDF5 file per output time that ParaView (5.11 and later) and PyVista open as it is (VTKHDF
// UnstructuredGrid 1.0) and that Gadget-like readers find their /PartType0 in.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "breccia/particle_arrays.hpp"
#include "mpi/comm.hpp"

namespace breccia::io {

/// What a snapshot says about the run; the group /Header of the file.
struct SnapshotHeader {
  double time = 0.0;         ///< simulated time [s]
  std::uint64_t step = 0;    ///< steps done
  double cell = 0.0;         ///< grid spacing [m]; 0: unknown (a file of others)
  double target_mass = 0.0;  ///< heaviest initial body [kg]; 0: unknown
  Vec3d period{};            ///< length of the periodic domain along each axis [m]; 0: not periodic
  std::string scene_name;
  std::string scene_keys;           ///< in /Parameters/Scene: JSON, keys of the scene as resolved; may be empty
  std::string code_version;         ///< set by write_snapshot
  std::uint64_t particles = 0;      ///< of all ranks; set by write_snapshot
  std::vector<std::string> fields;  ///< in the file; set by write_snapshot
};

struct Snapshot {
  SnapshotHeader header;
  ParticleOutput particles;  ///< of this rank
};

/// Writes the particles of all ranks, ordered by id, as `path` (double precision). `wanted_fields`: names of
/// snapshot_fields(), empty for all there are; required ones are written in any case, those whose effect is off are
/// left out. The file appears in full or not at all. Ranks without particles are legal. Collective.
/// Throws UsageError for an unknown field, NumericsError if the ids are not 0..N-1, IoError; the same on all ranks.
void write_snapshot(const std::filesystem::path& path, const SnapshotHeader& header, const ParticleOutput& particles,
                    std::span<const std::string> wanted_fields, const mpi::Comm& comm);

/// What a snapshot says about its run, without reading particles. Not collective. Throws IoError.
SnapshotHeader read_snapshot_header(const std::filesystem::path& path);

/// Reads a snapshot, or any file with /PartType0/Coordinates (N,3) and /PartType0/Masses (N); each rank gets a
/// contiguous share of the rows. Missing velocities, bodies, materials and damage are 0, missing ids are row numbers,
/// other missing fields stay empty. Collective. Throws IoError naming file and dataset, the same on all ranks.
Snapshot read_snapshot(const std::filesystem::path& path, const mpi::Comm& comm);

}  // namespace breccia::io

// What the ranks had to do with each other, at the end of a run.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>

#include "grid/engine.hpp"
#include "io/summary.hpp"
#include "mpi/comm.hpp"
#include "sim/time_loop.hpp"

namespace breccia::sim {

/// How long messages of nodes were under way and waited for, all ranks; none on one rank. Collective.
std::optional<io::HaloTiming> halo_timing(const grid::Engine& engine, const mpi::Comm& comm);
void print_halo(const io::HaloTiming& halo);

/// Axis, balance and bytes of the halo as summary.json has them. Collective.
nlohmann::json slabs_json(const TimeLoop& loop, const mpi::Comm& comm);
void print_slabs(const nlohmann::json& slabs);

}  // namespace breccia::sim

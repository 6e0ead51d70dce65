#include "sim/gravity_record.hpp"

#include <algorithm>

#include "gravity/method.hpp"

namespace breccia::sim {

void GravityRecord::add(const gravity::Stats& stats) {
  ++evaluations_[gravity::name_of(stats.method)];
  sums_.method = stats.method;
  sums_.reason = stats.reason;
  sums_.boxes = stats.boxes;
  sums_.pairs += stats.pairs;
  sums_.cell_interactions += stats.cell_interactions;
  sums_.expansions += stats.expansions;
  sums_.bytes_sent += stats.bytes_sent;
  sums_.cells_imported = std::max(sums_.cells_imported, stats.cells_imported);
  sums_.particles_imported = std::max(sums_.particles_imported, stats.particles_imported);
  sums_.cells_missing += stats.cells_missing;
  sums_.momentum_error = std::max(sums_.momentum_error, stats.momentum_error);
}

nlohmann::json GravityRecord::summary(const mpi::Comm& comm) const {
  if (evaluations_.empty()) return nullptr;
  return {{"evaluations", evaluations_},
          {"reason", sums_.reason},
          {"boxes", sums_.boxes},
          {"pairs", comm.sum(sums_.pairs)},
          {"cell_interactions", comm.sum(sums_.cell_interactions)},
          {"expansions", comm.sum(sums_.expansions)},
          {"bytes_sent", comm.sum(sums_.bytes_sent)},
          {"cells_imported", comm.max(sums_.cells_imported)},
          {"particles_imported", comm.max(sums_.particles_imported)},
          {"cells_missing", comm.sum(sums_.cells_missing)},
          {"net_force", sums_.momentum_error}};
}

std::string GravityRecord::decision() const {
  if (evaluations_.empty()) return "";
  return sums_.reason.empty() ? std::string(gravity::name_of(sums_.method)) + ", the scene says so" : sums_.reason;
}

}  // namespace breccia::sim

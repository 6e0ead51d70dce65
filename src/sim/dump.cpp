#include "sim/dump.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "breccia/error.hpp"
#include "io/collectively.hpp"
#include "io/durable_file.hpp"
#include "io/snapshot.hpp"

namespace breccia::sim {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(Vec3d v) { return {v.x, v.y, v.z}; }

Json json_of(const grid::ParticleValues& p) {
  return {{"velocity", json_of(p.velocity)},
          {"J", p.volume_ratio},
          {"internal_energy", p.energy},
          {"kirchhoff_pressure", p.pressure},
          {"damage", p.damage}};
}

// `fastest`: told of where no particle is at fault by itself; what goes wrong for many shows in the speeds first.
Json report(const TimeLoop& loop, const std::string& error, const grid::ParticleSample& fastest) {
  Json json{{"error", error}, {"time", loop.time()}, {"step", loop.step()}, {"dt", loop.dt()}};
  if (const auto& fault = loop.guard().fault()) {
    const grid::ParticleFault& p = fault->particle;
    json["particle"] = {{"id", p.before.id},
                        {"rank", fault->rank},
                        {"step", fault->step},
                        {"time", fault->time},
                        {"position", json_of(p.before.position)},
                        {"before", json_of(p.before.values)},
                        {"after", json_of(p.after)}};
  } else {
    json["fastest_particle"] = {
        {"id", fastest.id}, {"position", json_of(fastest.position)}, {"state", json_of(fastest.values)}};
  }
  return json;
}

}  // namespace

std::string dump(const TimeLoop& loop, const Scene& scene, const std::string& error,
                 const std::filesystem::path& folder, const mpi::Comm& comm) {
  try {
    const grid::ParticleSample fastest = loop.guard().fastest(loop.engine());
    io::on_root(comm, [&] { io::write_file(folder / "dump.json", report(loop, error, fastest).dump(1) + "\n"); });
    io::SnapshotHeader header;
    header.time = loop.time();
    header.step = loop.step();
    header.cell = scene.cell;
    header.scene_name = scene.name;
    io::write_snapshot(folder / "dump.hdf", header, loop.engine().inspect(), {}, comm);
    return fmt::format("{}; all particles are in {}", error, (folder / "dump.hdf").string());
  } catch (const Error& failure) {
    return fmt::format("{}; no dump of the particles: {}", error, failure.what());
  }
}

}  // namespace breccia::sim

// What output, diagnostics and time control read from the engine. Nothing here changes its state.
#include <algorithm>
#include <cmath>

#include "grid/host_engine.hpp"
#include "grid/observation.hpp"

namespace breccia::grid {

template <class P>
Vec3d HostEngine<P>::unfolded_position(std::size_t slot, BlockCoord block) const {
  const Kinematics<P>& k = store_.kinematics[slot / kLanes];
  const int lane = static_cast<int>(slot % kLanes);
  const Placement at = node_of(slot, block);
  double x[3];
  for (int axis = 0; axis < 3; ++axis) {
    const double scale = sizeof(typename P::Offset) == 4 ? 0x1p-32 : 1.0;
    x[axis] = setup_.cell * (at.node[axis] + scale * static_cast<double>(k.offset[axis][lane]));
  }
  return {x[0], x[1], x[2]};
}

template <class P>
Vec3d HostEngine<P>::position(std::size_t slot, BlockCoord block) const {
  return boundaries_.into_period(unfolded_position(slot, block));
}

template <class P>
double HostEngine<P>::work_beyond_period() const {
  if (!boundaries_.repeats_along(setup_.uniform_gravity)) return 0.0;
  double work = 0.0;
  for_each_particle([&](std::size_t slot, BlockCoord block) {
    const Vec3d x = unfolded_position(slot, block);
    work += mass(slot) * dot(setup_.uniform_gravity, x - boundaries_.into_period(x));
  });
  return work;
}

template <class P>
std::uint64_t HostEngine<P>::id(std::size_t slot) const {
  const Identity<P>& identity = store_.identity[slot / kLanes];
  const int lane = static_cast<int>(slot % kLanes);
  return static_cast<std::uint32_t>(identity.id_low[lane]) |
         std::uint64_t{static_cast<std::uint32_t>(identity.id_high[lane])} << 32;
}

template <class P>
std::uint32_t HostEngine<P>::material(std::size_t slot) const {
  return static_cast<std::uint32_t>(store_.identity[slot / kLanes].body_material[static_cast<int>(slot % kLanes)]) >>
         16;
}

template <class P>
typename HostEngine<P>::GridView HostEngine<P>::probe() const {
  const std::size_t slots = store_.packs() * kLanes;
  GridView grid{std::vector<Real>(3 * slots), std::vector<Real>(slots), std::vector<Real>(9 * slots)};
  ProbeArguments<P> probe;
  probe.tiles = tiles_.data();
  probe.kinematics = store_.kinematics.data();
  probe.affine = store_.affine.data();
  probe.velocities = velocities_.data();
  probe.places = places();
  probe.transfer = transfer_;
  probe.new_velocity = grid.new_velocity.data();
  probe.node_mass = grid.node_mass.data();
  probe.gradient = grid.gradient.data();
  probe.cell = static_cast<Real>(setup_.cell);
  probe.lone = lone_;
  probe.lone_pull = lone_pull_.data();
  probe.gravity = setup_.self_gravity ? store_.gravity.data() : nullptr;
  probe.uniform_gravity = {static_cast<Real>(setup_.uniform_gravity.x), static_cast<Real>(setup_.uniform_gravity.y),
                           static_cast<Real>(setup_.uniform_gravity.z)};
  probe.kick = static_cast<Real>(kick_);
  for (std::uint32_t t = 0; t < tiles_.size(); ++t) kernels_.probe(probe, t);
  kernels_.lone_probe(probe);
  return grid;
}

template <class P>
ParticleOutput HostEngine<P>::observe() const {
  return read_particles(probe());
}

template <class P>
ParticleOutput HostEngine<P>::inspect() const {
  return read_particles({});
}

template <class P>
ParticleOutput HostEngine<P>::read_particles(const GridView& grid) const {
  ParticleOutput out;
  for_each_particle([&](std::size_t slot, BlockCoord block) {
    const std::size_t pack = slot / kLanes;
    const int lane = static_cast<int>(slot % kLanes);
    const Kinematics<P>& k = store_.kinematics[pack];
    ObservedParticle particle{.id = id(slot),
                              .position = position(slot, block),
                              .mass = static_cast<double>(k.mass[lane]),
                              .node_mass = grid.node_mass.empty() ? 0.0 : static_cast<double>(grid.node_mass[slot]),
                              .body_material = static_cast<std::uint32_t>(store_.identity[pack].body_material[lane]),
                              .volume_change = static_cast<double>(store_.volume[pack].change.value()[lane]),
                              .kirchhoff_pressure = static_cast<double>(store_.volume[pack].kirchhoff_pressure[lane])};
    double* mean[3] = {&particle.velocity.x, &particle.velocity.y, &particle.velocity.z};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto old = static_cast<double>(k.velocity[axis][lane]);
      const auto now = grid.new_velocity.empty() ? old : static_cast<double>(grid.new_velocity[3 * slot + axis]);
      *mean[axis] = 0.5 * (old + now);
    }
    if (transfer_.affine && !grid.gradient.empty()) {
      const auto c = [&](std::size_t n) { return static_cast<double>(grid.gradient[9 * slot + n]); };
      particle.gradient = {c(0), c(1), c(2), c(3), c(4), c(5), c(6), c(7), c(8)};
    }
    if (store_.has(Group::kDamageLevel)) {
      particle.damage_root = static_cast<double>(store_.damage_level[pack].root[lane]);
    }
    if (setup_.effects.energy) particle.energy = static_cast<double>(store_.energy[pack].specific.value()[lane]);
    if (setup_.effects.shear) particle.hencky_norm = hencky_norm(slot);
    append(out, particle, setup_);
  });
  if (grid.node_mass.empty()) out.grid_density.clear();
  return out;
}

template <class P>
double HostEngine<P>::hencky_norm(std::size_t slot) const {
  const int lane = static_cast<int>(slot % kLanes);
  const auto& e = store_.elastic[slot / kLanes].strain;
  const Dev3<double> strain{static_cast<double>(e[0][lane]), static_cast<double>(e[1][lane]),
                            static_cast<double>(e[2][lane]), static_cast<double>(e[3][lane]),
                            static_cast<double>(e[4][lane])};
  return grid::hencky_norm(strain);
}

template <class P>
std::vector<double> HostEngine<P>::volume_ratios() const {
  std::vector<double> ratios;
  for_each_particle([&](std::size_t slot, BlockCoord) {
    ratios.push_back(1.0 +
                     static_cast<double>(store_.volume[slot / kLanes].change.value()[static_cast<int>(slot % kLanes)]));
  });
  return ratios;
}

template <class P>
double HostEngine<P>::elastic_energy() const {
  if (!setup_.effects.shear) return 0.0;
  double energy = 0.0;
  for_each_particle([&](std::size_t slot, BlockCoord) {
    const MaterialParameters& m = setup_.materials[material(slot)];
    const double norm = hencky_norm(slot);
    const double mass = static_cast<double>(store_.kinematics[slot / kLanes].mass[static_cast<int>(slot % kLanes)]);
    energy += mass / m.eos.rho0 * m.shear_modulus * norm * norm;
  });
  return energy;
}

template <class P>
SignalSpeeds HostEngine<P>::signal_speeds() const {
  SignalSpeeds speeds;
  for_each_particle([&](std::size_t slot, BlockCoord) {
    const std::size_t pack = slot / kLanes;
    const int lane = static_cast<int>(slot % kLanes);
    const auto& c = store_.affine[pack].gradient;
    material::State<double> state{};
    state.volume.set(static_cast<double>(store_.volume[pack].change.value()[lane]));
    if (setup_.effects.energy) state.energy.set(static_cast<double>(store_.energy[pack].specific.value()[lane]));
    speeds.sound = std::max(
        speeds.sound, material::longitudinal_sound_speed(setup_.effects, double_constants_[material(slot)], state));
    for (int axis = 0; axis < 3; ++axis) {
      speeds.particle =
          std::max(speeds.particle, std::abs(static_cast<double>(store_.kinematics[pack].velocity[axis][lane])));
    }
    speeds.compression_rate =
        std::max(speeds.compression_rate, -static_cast<double>(c[0][lane] + c[4][lane] + c[8][lane]));
  });
  return {comm_.max(speeds.sound), comm_.max(speeds.particle), comm_.max(speeds.compression_rate)};
}

template <class P>
EngineStats HostEngine<P>::stats() const {
  EngineStats stats;
  for (const Tile& tile : tiles_) stats.particles += tile.particles;
  stats.particles += lone_.particles;
  stats.lone_particles = lone_.particles;
  stats.tiles = tiles_.size();
  stats.occupied_blocks = occupied_blocks_;
  stats.packs = lone_.first_pack;
  stats.blocks = owned_blocks_;
  stats.halo_bytes_per_step = sum_exchange_.bytes() + velocity_exchange_.bytes();
  stats.key_exchanges = block_requests_.exchanges();
  for (const mpi::Flights& f : {sum_exchange_.flights(), velocity_exchange_.flights()}) {
    stats.halo_in_flight += f.in_flight.count();
    stats.halo_waited += f.waited.count();
  }
  stats.grid_bytes = (sums_.capacity() + velocities_.capacity()) * sizeof(Real);
  stats.particle_bytes = bytes_held() - stats.grid_bytes;
  stats.sort_bytes = most_bytes_ - std::min(most_bytes_, bytes_held());
  return stats;
}

template class HostEngine<MixedPrecision>;
template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid

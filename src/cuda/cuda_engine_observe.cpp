// What output, diagnostics and time control read from the engine. Nothing here changes its state.
#include <bit>
#include <cmath>

#include "cuda/cuda_engine.hpp"
#include "cuda/observe_kernels.hpp"
#include "grid/observation.hpp"

namespace breccia::cuda {

// One component of a field as doubles; zeros where the effect is off.
template <class P>
std::vector<double> CudaEngine<P>::component(const char* field, int index) const {
  const auto values = particles_.template download_component<Real>(field, index, stream_);
  return {values.begin(), values.end()};
}

template <class P>
std::vector<Vec3d> CudaEngine<P>::unfolded_positions() const {
  const auto keys = grid_.block_keys_of_particles(stream_);
  const auto packed = particles_.template download_component<std::int32_t>("node", 0, stream_);
  std::vector<double> x[3];
  for (int axis = 0; axis < 3; ++axis) {
    const auto offsets = particles_.template download_component<typename P::Offset>("offset", axis, stream_);
    const double scale = sizeof(typename P::Offset) == 4 ? 0x1p-32 : 1.0;
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const int node = grid::kBlockWidth * grid::component(grid::block_coord(keys[i]), axis) +
                       (packed[i] >> (8 * axis) & 255) - grid::kNodeBias;
      x[axis].push_back(setup_.cell * (node + scale * static_cast<double>(offsets[i])));
    }
  }
  std::vector<Vec3d> positions;
  for (std::size_t i = 0; i < keys.size(); ++i) positions.push_back({x[0][i], x[1][i], x[2][i]});
  return positions;
}

template <class P>
std::vector<Vec3d> CudaEngine<P>::positions() const {
  std::vector<Vec3d> positions = unfolded_positions();
  for (Vec3d& x : positions) x = boundaries_.into_period(x);
  return positions;
}

// Both sums on the host: few scenes have a field along a periodic axis, and the sum is the same in every run.
template <class P>
double CudaEngine<P>::work_of_periods() const {
  if (!boundaries_.repeats_along(setup_.uniform_gravity)) return 0.0;
  const auto keys = grid_.block_keys_of_particles(stream_);
  const auto packed = particles_.template download_component<std::int32_t>("node", 0, stream_);
  const std::vector<double> mass = component("mass", 0);
  double work = 0.0;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    std::int32_t node[3];
    for (int axis = 0; axis < 3; ++axis) {
      node[axis] = grid::kBlockWidth * grid::component(grid::block_coord(keys[i]), axis) +
                   (packed[i] >> (8 * axis) & 255) - grid::kNodeBias;
    }
    work += mass[i] * dot(setup_.uniform_gravity, boundaries_.put_back(node));
  }
  return work;
}

template <class P>
double CudaEngine<P>::work_beyond_period() const {
  halo_.watch(stream_);
  if (!boundaries_.repeats_along(setup_.uniform_gravity)) return 0.0;
  const std::vector<Vec3d> position = unfolded_positions();
  const std::vector<double> mass = component("mass", 0);
  double work = 0.0;
  for (std::size_t i = 0; i < position.size(); ++i) {
    work += mass[i] * dot(setup_.uniform_gravity, position[i] - boundaries_.into_period(position[i]));
  }
  return work;
}

template <class P>
void CudaEngine<P>::predict(double time, std::vector<Vec3d>& position, std::vector<double>& mass) const {
  position = positions();
  mass = component("mass", 0);
  const std::vector<double> v[3] = {component("velocity", 0), component("velocity", 1), component("velocity", 2)};
  for (std::size_t i = 0; i < position.size(); ++i) position[i] += time * Vec3d{v[0][i], v[1][i], v[2][i]};
}

template <class P>
std::vector<double> CudaEngine<P>::hencky_norms() const {
  std::vector<double> norms(particles_.count());
  if (!setup_.effects.shear) return norms;
  std::vector<double> e[5];
  for (int c = 0; c < 5; ++c) e[c] = component("elastic_strain", c);
  for (std::size_t i = 0; i < norms.size(); ++i) {
    norms[i] = grid::hencky_norm({e[0][i], e[1][i], e[2][i], e[3][i], e[4][i]});
  }
  return norms;
}

template <class P>
ParticleOutput CudaEngine<P>::observe() const {
  halo_.watch(stream_);
  const unsigned count = particles_.count();
  DeviceArray<Real> new_velocity(std::size_t{count} * 3);
  DeviceArray<Real> node_mass(count);
  DeviceArray<Real> gradient(std::size_t{count} * 9);
  ProbeArguments<Real> probe;
  probe.pass = pass_arguments(0.0, 0.0);
  probe.new_velocity = new_velocity.data();
  probe.node_mass = node_mass.data();
  probe.gradient = gradient.data();
  probe.count = count;
  launch_probe(probe, stream_);
  return read_particles({new_velocity.download(std::size_t{count} * 3, stream_), node_mass.download(count, stream_),
                         gradient.download(std::size_t{count} * 9, stream_)});
}

template <class P>
ParticleOutput CudaEngine<P>::inspect() const {
  halo_.watch(stream_);
  return read_particles({});
}

template <class P>
ParticleOutput CudaEngine<P>::read_particles(const GridView& grid) const {
  const std::size_t count = particles_.count();
  const auto low = particles_.template download_component<std::int32_t>("id_low", 0, stream_);
  const auto high = particles_.template download_component<std::int32_t>("id_high", 0, stream_);
  const auto body_material = particles_.template download_component<std::int32_t>("body_material", 0, stream_);
  const std::vector<Vec3d> position = positions();
  const std::vector<double> before[3] = {component("velocity", 0), component("velocity", 1), component("velocity", 2)};
  const std::vector<double> mass = component("mass", 0);
  const std::vector<double> volume_change = component("volume_change", 0);
  const std::vector<double> pressure = component("kirchhoff_pressure", 0);
  const std::vector<double> damage_root = component("damage_root", 0);
  const std::vector<double> energy = component("internal_energy", 0);
  const std::vector<double> strain = hencky_norms();
  ParticleOutput out;
  for (std::size_t i = 0; i < count; ++i) {
    const auto mean = [&](std::size_t axis) {
      if (grid.new_velocity.empty()) return before[axis][i];
      return 0.5 * (before[axis][i] + static_cast<double>(grid.new_velocity[axis * count + i]));
    };
    const auto c = [&](std::size_t n) {
      return transfer_.affine && !grid.gradient.empty() ? static_cast<double>(grid.gradient[n * count + i]) : 0.0;
    };
    grid::append(out,
                 {.id = static_cast<std::uint32_t>(low[i]) | std::uint64_t{static_cast<std::uint32_t>(high[i])} << 32,
                  .position = position[i],
                  .velocity = {mean(0), mean(1), mean(2)},
                  .mass = mass[i],
                  .node_mass = grid.node_mass.empty() ? 0.0 : static_cast<double>(grid.node_mass[i]),
                  .gradient = {c(0), c(1), c(2), c(3), c(4), c(5), c(6), c(7), c(8)},
                  .body_material = static_cast<std::uint32_t>(body_material[i]),
                  .volume_change = volume_change[i],
                  .kirchhoff_pressure = pressure[i],
                  .damage_root = damage_root[i],
                  .energy = energy[i],
                  .hencky_norm = strain[i]},
                 setup_);
  }
  if (grid.node_mass.empty()) out.grid_density.clear();
  return out;
}

template <class P>
std::optional<grid::ParticleSample> CudaEngine<P>::fastest() const {
  const ParticleOutput all = inspect();
  std::optional<std::size_t> worst;
  double most = -1.0;
  for (std::size_t i = 0; i < all.id.size(); ++i) {
    const Vec3d v = all.velocity[i];
    const double speed = std::abs(v.x) + std::abs(v.y) + std::abs(v.z);
    const bool finite = speed + all.density[i] + all.pressure[i] < HUGE_VAL;
    if (finite && speed <= most) continue;
    worst = i;
    if (!finite) break;
    most = speed;
  }
  if (!worst) return std::nullopt;
  const std::size_t i = *worst;
  const double ratio = setup_.materials[all.material[i]].eos.rho0 / all.density[i];
  return grid::ParticleSample{all.id[i],
                              all.position[i],
                              {all.velocity[i], ratio, setup_.effects.energy ? all.internal_energy[i] : 0.0,
                               all.pressure[i] * ratio, all.damage[i]}};
}

template <class P>
std::vector<double> CudaEngine<P>::volume_ratios() const {
  halo_.watch(stream_);
  std::vector<double> ratios = component("volume_change", 0);
  for (double& j : ratios) j += 1.0;
  return ratios;
}

template <class P>
double CudaEngine<P>::elastic_energy() const {
  halo_.watch(stream_);
  if (!setup_.effects.shear) return 0.0;
  const auto body_material = particles_.template download_component<std::int32_t>("body_material", 0, stream_);
  const std::vector<double> mass = component("mass", 0);
  const std::vector<double> norm = hencky_norms();
  double energy = 0.0;
  for (std::size_t i = 0; i < mass.size(); ++i) {
    const MaterialParameters& m = setup_.materials[static_cast<std::uint32_t>(body_material[i]) >> 16];
    energy += mass[i] / m.eos.rho0 * m.shear_modulus * norm[i] * norm[i];
  }
  return energy;
}

template <class P>
grid::SignalSpeeds CudaEngine<P>::signal_speeds() const {
  fastest_.fill_bytes(0, stream_);
  launch_signals(pass_arguments(0.0, 0.0), double_constants_.data(), particles_.count(), fastest_.data(), stream_);
  const FastestSignals found = fastest_.download(1, stream_)[0];
  return {comm_.max(std::bit_cast<double>(found.sound)), comm_.max(std::bit_cast<double>(found.particle)),
          comm_.max(std::bit_cast<double>(found.compression))};
}

template <class P>
grid::EngineStats CudaEngine<P>::stats() const {
  grid::EngineStats stats;
  stats.particles = particles_.count();
  stats.lone_particles = grid_.lone_particles();
  stats.tiles = grid_.tiles();
  stats.occupied_blocks = grid_.tiles();
  stats.blocks = grid_.blocks();
  stats.halo_bytes_per_step = halo_.bytes();
  stats.particle_bytes = particles_.bytes() + flaw_thresholds_.bytes();
  stats.grid_bytes = grid_.bytes();
  return stats;
}

template class CudaEngine<MixedPrecision>;
template class CudaEngine<DoublePrecision>;

}  // namespace breccia::cuda

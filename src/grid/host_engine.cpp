#include "grid/host_engine.hpp"

#include <pmmintrin.h>
#include <xmmintrin.h>

#include <stdexcept>

#include "breccia/error.hpp"
#include "grid/setup_choices.hpp"

namespace breccia::grid {
namespace {

// Denormals cost hundreds of cycles and mean nothing here (cpu_limit.md 8).
void flush_denormals() {
  _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
  _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
}

}  // namespace

template <class P>
HostEngine<P>::HostEngine(const EngineSetup& setup, const mpi::Comm& comm)
    : setup_(setup),
      comm_(comm),
      kernels_(active_kernels<P>()),
      boundaries_(setup.boundaries, setup.cell),
      transfer_(transfer_for(setup.numerics)),
      store_(groups_for(setup)) {
  periodicity_ = boundaries_.periodicity();
  for (const MaterialParameters& material : setup.materials) {
    constants_.push_back(material::make_constants<Real>(material, setup.numerics.literal, setup.cell));
    double_constants_.push_back(material::make_constants<double>(material, setup.numerics.literal, setup.cell));
  }
#pragma omp parallel num_threads(setup_.threads)
  flush_denormals();
}

template <class P>
PassArguments<P> HostEngine<P>::pass_arguments(double step, double half_step) {
  PassArguments<P> a;
  a.tiles = tiles_.data();
  a.targets = ordered_.targets().empty() ? tiles_.data() : ordered_.targets().data();
  a.tile_count = static_cast<std::uint32_t>(tiles_.size());
  a.kinematics = store_.kinematics.data();
  a.volume = store_.volume.data();
  a.elastic = store_.elastic.data();
  a.energy = store_.energy.data();
  a.damage_level = store_.damage_level.data();
  a.flaws = store_.flaws.data();
  a.gravity = setup_.self_gravity ? store_.gravity.data() : nullptr;
  a.identity = store_.identity.data();
  a.affine = store_.affine.data();
  a.lone = lone_;
  a.lone_pull = lone_pull_.data();
  a.kick = static_cast<Real>(kick_);
  a.velocities = velocities_.data();
  a.places = places();
  a.sums = sums_.data();
  a.rows = rows_.data();
  a.flaw_codes = flaw_codes_.data();
  a.fault = &fault_;
  a.materials = constants_.data();
  a.material_count = static_cast<int>(constants_.size());
  a.effects = setup_.effects;
  a.cell = static_cast<Real>(setup_.cell);
  a.step = static_cast<Real>(step);
  a.stress_half_step = static_cast<Real>(half_step);
  a.uniform_gravity = {static_cast<Real>(setup_.uniform_gravity.x), static_cast<Real>(setup_.uniform_gravity.y),
                       static_cast<Real>(setup_.uniform_gravity.z)};
  a.transfer = transfer_;
  a.adds_by_tile = setup_.numerics.reproducible;
  return a;
}

template <class P>
void HostEngine<P>::scatter(double half_step) {
  hold_sums();
  PassArguments<P> a = pass_arguments(0.0, half_step);
  a.gather = false;
  run_pass(a);
  count_bytes(0);
  drop_gradients();
}

template <class P>
void HostEngine<P>::gather(double step) {
  drop_sums();
  store_.hold_gradients();
  PassArguments<P> a = pass_arguments(step, 0.0);
  a.scatter = false;
  run_pass(a);
  most_bytes_ = 0;
  count_bytes(0);
}

template <class P>
void HostEngine<P>::gather_scatter(double step) {
  const NodeArguments<P> nodes = node_arguments(step);
  // What lies beyond a period must be added up first.
  run_pass(pass_arguments(step, 0.5 * step), images_.empty() ? &nodes : nullptr);
  trailing_kick_ = step;
}

template <class P>
NodeArguments<P> HostEngine<P>::node_arguments(double kick) {
  NodeArguments<P> a;
  a.sums = sums_.data();
  a.velocities = velocities_.data();
  a.places = places();
  a.blocks = columns_.blocks().data();
  a.rows = rows_.data();
  a.kick = static_cast<Real>(kick);
  a.smallest_mass = static_cast<Real>(1e-30 * smallest_mass_);
  return a;
}

template <class P>
void HostEngine<P>::update_grid(double kick) {
  if (trailing_kick_ != 0.0 && trailing_kick_ != kick) {
    throw std::logic_error("gather_scatter(step) must be followed by update_grid(step)");
  }
  trailing_kick_ = 0.0;
  kick_ = kick;
  hold_velocities();
  const NodeArguments<P> a = node_arguments(kick);
  finish_sums(a);
  const auto blocks = static_cast<std::uint32_t>(owned_blocks_);
  constexpr std::uint32_t kChunk = 64;
#pragma omp parallel num_threads(setup_.threads)
  {
#pragma omp for schedule(static)
    for (std::size_t n = ordered_.shared_sums(); n < ordered_.sums(); ++n) {
      ordered_.add_up(n, columns_, sums_.data(), rows_.data());
    }
#pragma omp single
    images_.fold(images_.rest(), columns_, sums_.data(), rows_.data());
    // What the passes have left lies together: blocks that no tile stands in.
#pragma omp for schedule(dynamic)
    for (std::uint32_t b = 0; b < blocks; b += kChunk) kernels_.update_blocks(a, b, std::min(b + kChunk, blocks));
  }
  boundaries_.apply_to_rest(velocities_.data());
  copy_to_images(images_.rest());
  finish_velocities();
}

template <class P>
void HostEngine<P>::predict(double time, std::vector<Vec3d>& position_out, std::vector<double>& mass) const {
  position_out.clear();
  mass.clear();
  for_each_particle([&](std::size_t slot, BlockCoord block) {
    const auto& k = store_.kinematics[slot / kLanes];
    const int lane = static_cast<int>(slot % kLanes);
    const Vec3d v{k.velocity[0][lane], k.velocity[1][lane], k.velocity[2][lane]};
    position_out.push_back(position(slot, block) + time * v);
    mass.push_back(k.mass[lane]);
  });
}

template <class P>
void HostEngine<P>::hold_gravity(std::span<const Vec3d> acceleration) {
  std::size_t n = 0;
  for_each_particle([&](std::size_t slot, BlockCoord) {
    auto& held = store_.gravity[slot / kLanes].acceleration;
    const int lane = static_cast<int>(slot % kLanes);
    held[0].set(lane, static_cast<Real>(acceleration[n].x));
    held[1].set(lane, static_cast<Real>(acceleration[n].y));
    held[2].set(lane, static_cast<Real>(acceleration[n].z));
    ++n;
  });
}

template <class P>
void HostEngine<P>::kick_velocities(double time) {
  const double uniform[3] = {setup_.uniform_gravity.x, setup_.uniform_gravity.y, setup_.uniform_gravity.z};
  for_each_particle([&](std::size_t slot, BlockCoord) {
    const std::size_t pack = slot / kLanes;
    const int lane = static_cast<int>(slot % kLanes);
    for (int axis = 0; axis < 3; ++axis) {
      double g = uniform[axis];
      if (setup_.self_gravity) g += static_cast<double>(store_.gravity[pack].acceleration[axis][lane]);
      auto& v = store_.kinematics[pack].velocity[axis];
      v.set(lane, static_cast<Real>(static_cast<double>(v[lane]) - time * g));
    }
  });
}

std::unique_ptr<Engine> make_host_engine(const EngineSetup& setup, const mpi::Comm& comm) {
  if (setup.numerics.precision == Precision::kDouble) {
    return std::make_unique<HostEngine<DoublePrecision>>(setup, comm);
  }
  return std::make_unique<HostEngine<MixedPrecision>>(setup, comm);
}

template class HostEngine<MixedPrecision>;
template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid

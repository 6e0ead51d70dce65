#include "cuda/cuda_engine.hpp"

#include <cmath>

#include "breccia/error.hpp"
#include "breccia/huge_pages.hpp"
#include "grid/setup_choices.hpp"

namespace breccia::cuda {
namespace {

template <class Real>
Transfer<Real> transfer_of(const NumericsParameters& numerics) {
  const grid::TransferParameters t = grid::transfer_for(numerics);
  return {static_cast<Real>(t.alpha), static_cast<Real>(t.beta), t.affine};
}

}  // namespace

template <class P>
CudaEngine<P>::CudaEngine(const grid::EngineSetup& setup, const mpi::Comm& comm)
    : setup_(setup),
      comm_(comm),
      boundaries_(setup.boundaries, setup.cell),
      particles_(grid::groups_for(setup)),
      // Walls act on nodes: a particle needs them near one.
      grid_(boundaries_.periodicity(), setup.numerics.lone_without_grid && !boundaries_.has_walls()),
      transfer_(transfer_of<Real>(setup.numerics)),
      halo_(setup.device_messages, comm) {
  setup_.divide_blocks = false;  // halo.cpp: ranks share whole blocks
  std::vector<material::Constants<Real>> constants;
  std::vector<material::Constants<double>> double_constants;
  for (const MaterialParameters& material : setup.materials) {
    constants.push_back(material::make_constants<Real>(material, setup.numerics.literal, setup.cell));
    double_constants.push_back(material::make_constants<double>(material, setup.numerics.literal, setup.cell));
  }
  constants_.allocate(constants.size());
  constants_.upload(constants, stream_);
  double_constants_.allocate(double_constants.size());
  double_constants_.upload(double_constants, stream_);
  walls_.allocate(boundaries_.walls().size());
  walls_.upload(boundaries_.walls(), stream_);
  counts_.allocate(2);
  counts_.fill_bytes(0, stream_);
  unbroken_.allocate(1);
  total_.allocate(1);
  fastest_.allocate(1);
  prepare_tile_pass<Real>();
  prepare_lone_pass<Real>();
  prepare_node_update<Real>();
}

template <class P>
PassArguments<typename P::Real> CudaEngine<P>::pass_arguments(double step, double half_step) const {
  PassArguments<Real> a;
  a.particles = particles_.view();
  a.grid = grid_.view();
  a.first_lone = grid_.tiled_particles();
  a.lone = grid_.lone_particles();
  a.lone_pull = grid_.lone_pull();
  a.sums = pass_sums_.data();
  a.strayed = counts_.data();
  a.clamped = counts_.data() + 1;
  a.flaw_thresholds = flaw_thresholds_.data();
  a.materials = constants_.data();
  a.material_count = static_cast<int>(setup_.materials.size());
  a.effects = setup_.effects;
  a.held_gravity = setup_.self_gravity;
  a.cell = static_cast<Real>(setup_.cell);
  a.step = static_cast<Real>(step);
  a.kick = static_cast<Real>(kick_);
  a.stress_half_step = static_cast<Real>(half_step);
  a.uniform_gravity = {static_cast<Real>(setup_.uniform_gravity.x), static_cast<Real>(setup_.uniform_gravity.y),
                       static_cast<Real>(setup_.uniform_gravity.z)};
  a.transfer = transfer_;
  return a;
}

template <class P>
NodeArguments<typename P::Real> CudaEngine<P>::node_arguments(double kick) const {
  return {.grid = grid_.view(),
          .shared = halo_.view(),
          .kick = static_cast<Real>(kick),
          .smallest_mass = static_cast<Real>(1e-30 * smallest_mass_),
          .cell = setup_.cell,
          .walls = walls_.data(),
          .wall_count = static_cast<int>(walls_.size())};
}

template <class P>
void CudaEngine<P>::launch_pass(PassArguments<Real> arguments) {
  // First the tiles that other ranks wait for: their sums travel beside the rest of the pass.
  if (arguments.scatter && halo_.active()) {
    arguments.only = halo_.boundary();
    launch_tile_pass(arguments, stream_);
    halo_.send(grid_.view(), stream_);
    arguments.only = halo_.interior();
  }
  launch_tile_pass(arguments, stream_);
  launch_lone_pass(arguments, stream_);
}

template <class P>
void CudaEngine<P>::scatter(double half_step) {
  PassArguments<Real> a = pass_arguments(0.0, half_step);
  a.gather = false;
  launch_pass(a);
}

template <class P>
void CudaEngine<P>::gather(double step) {
  PassArguments<Real> a = pass_arguments(step, 0.0);
  a.scatter = false;
  launch_pass(a);
  halo_.bring_in();  // no step follows before ranks meet elsewhere
}

template <class P>
void CudaEngine<P>::gather_scatter(double step) {
  // The step's kick is that of the update before: a change of dt is seen by the capture of the step after. A halo
  // cannot be part of a graph.
  if (kick_ != step || comm_.size() > 1) {
    launch_pass(pass_arguments(step, 0.5 * step));
    return;
  }
  graph_.run(stream_, step, [&] {
    launch_pass(pass_arguments(step, 0.5 * step));
    launch_node_update(node_arguments(step), stream_);
  });
  grid_is_ahead_ = true;
}

template <class P>
void CudaEngine<P>::update_grid(double kick) {
  kick_ = kick;
  if (std::exchange(grid_is_ahead_, false)) return;
  halo_.receive(stream_);
  launch_node_update(node_arguments(kick), stream_);
}

template <class P>
double CudaEngine<P>::sort() {
  if (comm_.any(strayed())) {
    throw NumericsError(
        "particles moved more than a cell between two sortings, or are not finite: the run is unstable (try a smaller "
        "time.step), or numerics.sort_interval is too long for its speeds");
  }
  const double work = work_of_periods();
  migrate();
  settle();
  return work;
}

template <class P>
bool CudaEngine<P>::strayed() const {
  halo_.watch(stream_);
  grid_.count_lone_drift(particles_, const_cast<unsigned*>(counts_.data()), stream_);
  return counts_.download(1, stream_)[0] != 0;
}

template <class P>
void CudaEngine<P>::settle() {
  graph_.clear();
  counts_.fill_bytes(0, stream_);
  grid_.sort(particles_, own_planes(), stream_);
  if (comm_.size() > 1) {
    halo_.set(grid_.block_keys(stream_), grid_.tiles(), boundaries_.periodicity(), slabs_, comm_, stream_);
  }
  pass_sums_.reserve(grid_.pass_blocks());
  pass_sums_.fill_bytes(0, stream_);
}

template <class P>
grid::PassReport CudaEngine<P>::passes() const {
  halo_.watch(stream_);
  launch_total(pass_sums_.data(), grid_.pass_blocks(), total_.data(), stream_);
  PassSums sums;
  unsigned clamped = 0;
  check(cudaMemcpyAsync(&sums, total_.data(), sizeof sums, cudaMemcpyDeviceToHost, stream_), "sums of the passes");
  check(cudaMemcpyAsync(&clamped, counts_.data() + 1, sizeof clamped, cudaMemcpyDeviceToHost, stream_), "count");
  check(cudaStreamSynchronize(stream_), "sums of the passes");
  grid::PassReport report;
  report.plastic_work = sums.plastic_work;
  report.viscous_work = sums.viscous_work;
  report.largest_move = sums.largest_move;
  report.clamped = clamped;
  if (sums.largest_move >= 1.0) {
    // The device keeps no state from before the step.
    const grid::ParticleSample worst = fastest().value();
    report.fault = grid::ParticleFault{worst, worst.values, sums.largest_move < 0.5 * kNotFinite};
  }
  return report;
}

template <class P>
void CudaEngine<P>::hold_gravity(std::span<const Vec3d> acceleration) {
  std::vector<Real> values;
  values.reserve(3 * acceleration.size());
  for (const Vec3d& a : acceleration) {
    values.insert(values.end(), {static_cast<Real>(a.x), static_cast<Real>(a.y), static_cast<Real>(a.z)});
  }
  particles_.upload(*particles_.find("gravity"), reinterpret_cast<const std::byte*>(values.data()), stream_);
}

template <class P>
PredictArguments<typename P::Real> CudaEngine<P>::predict_arguments(double time) const {
  return {.particles = particles_.view(),
          .block_keys = grid_.block_keys_of_particles(),
          .count = particles_.count(),
          .cell = setup_.cell,
          .time = time,
          .period = {boundaries_.period_start(), boundaries_.period_length()}};
}

template <class P>
std::unique_ptr<gravity::ResidentSolver> CudaEngine<P>::make_resident_solver(GravityMethod method,
                                                                             const gravity::Parameters& parameters) {
  auto solver = std::make_unique<CudaGravity<Real>>(
      method, parameters, [this](double time) { return predict_arguments(time); }, comm_, stream_);
  solver->require_memory();
  return solver;
}

template <class P>
void CudaEngine<P>::kick_velocities(double time) {
  launch_kick(pass_arguments(0.0, 0.0), setup_.uniform_gravity, time, particles_.count(), stream_);
}

template <class P>
bool CudaEngine<P>::finish_damage() {
  if (!setup_.effects.damage) return true;
  unbroken_.fill_bytes(0, stream_);
  launch_count_unbroken(particles_.view().damage_root, particles_.count(), unbroken_.data(), stream_);
  if (comm_.any(unbroken_.download(1, stream_)[0] != 0)) return false;
  switch_damage_off();
  return true;
}

template <class P>
void CudaEngine<P>::switch_damage_off() {
  graph_.clear();
  setup_.effects.damage = false;
  setup_.effects.fully_damaged = true;
  particles_.drop_damage();
  flaw_thresholds_ = {};
  release(flaw_thresholds_host_);
}

template class CudaEngine<MixedPrecision>;
template class CudaEngine<DoublePrecision>;

}  // namespace breccia::cuda

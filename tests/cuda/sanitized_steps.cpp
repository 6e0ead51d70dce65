// A few steps of a small scene, a sorting included, through the engine on the emulated device: built with a sanitizer,
// as racecheck (every lane is a thread to it) or memcheck of every kernel. Racecheck is slow: an argument ("steps",
// "gravity", "mesh" or "ranks") asks for one part, briefly, so that the parts run side by side. On several ranks the
// clumps go from one to the next along a wall, and all share a mesh.
#include <algorithm>
#include <cstdio>
#include <string_view>
#include <vector>

#include "cuda/body_sets.hpp"
#include "cuda/box_gravity.hpp"
#include "cuda/cuda_engine.hpp"
#include "cuda/device_census.hpp"
#include "cuda/stream.hpp"

namespace {

using namespace breccia;

constexpr int kClump = 150;  // the first particles
constexpr double kStep = 0.02;

// Three clumps that share tiles, and particles that share nothing.
ParticleArrays particles(double cell) {
  ParticleArrays p;
  const auto add = [&](Vec3d position, Vec3d velocity) {
    p.id.push_back(p.id.size());
    p.position.push_back(cell * position);
    p.velocity.push_back(velocity);
    p.mass.push_back(2700.0 * 0.3 * cell * cell * cell);
    p.body.push_back(0);
    p.material.push_back(0);
    p.damage.push_back(0.0);
  };
  for (int n = 0; n < kClump; ++n) {
    const double a = 0.37 * n, b = 0.73 * n;
    add({a - 3.0 * static_cast<int>(a / 3.0), b - 5.0 * static_cast<int>(b / 5.0), 0.02 * n},
        {n % 3 * 30.0, 10.0, -5.0});
  }
  for (int n = 0; n < 5; ++n) add({40.0 + 20.0 * n, 7.0, -30.0}, {1.0, 2.0, 3.0});
  return p;
}

// What the choice of boxes asks of the device.
void count_in_blocks(const cuda::BodyArrays& bodies, const gravity::Box& box, double heaviest, cudaStream_t stream) {
  cuda::DeviceCensus census(stream);
  census.take(bodies, heaviest);
  census.divide(2e3);
  std::vector<gravity::BlockIndex> dense;
  for (const gravity::BlockCount& b : census.crowded(8)) dense.push_back(b.index);
  std::int64_t counted = 0;
  for (const std::int64_t n : census.counts(dense)) counted += n;
  std::printf("%zu dense blocks with %lld bodies, %zu around, %g kg in the box\n", dense.size(),
              static_cast<long long>(counted), census.around(dense).size(), census.sets({&box, 1})[1].mass);
}

// A box with a mesh has a thousand particles; this one, around the clumps, has what a sanitizer can bear.
template <class Real>
void sum_in_box(const ParticleArrays& all) {
  constexpr unsigned n = kClump;
  cudaStream_t stream = nullptr;
  cuda::check(cudaStreamCreate(&stream), "stream");
  {
    std::vector<double> values(std::size_t{4} * n);
    gravity::Box box{all.position[0], all.position[0]};
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3d x = all.position[i];
      for (std::size_t axis = 0; axis < 3; ++axis) values[axis * n + i] = axis == 0 ? x.x : axis == 1 ? x.y : x.z;
      values[3 * n + i] = all.mass[i];
      box.low = {std::min(box.low.x, x.x), std::min(box.low.y, x.y), std::min(box.low.z, x.z)};
      box.high = {std::max(box.high.x, x.x), std::max(box.high.y, x.y), std::max(box.high.z, x.z)};
    }
    cuda::DeviceArray<double> bodies(values.size());
    cuda::DeviceArray<double> acceleration(std::size_t{3} * n);
    bodies.upload(values, stream);
    acceleration.fill_bytes(0, stream);
    const double* x = bodies.data();
    const cuda::BodyArrays arrays{{x, x + n, x + 2 * n}, x + 3 * n, n};
    count_in_blocks(arrays, box, all.mass[0], stream);
    cuda::BodySets sets(stream);
    sets.divide(arrays, {&box, 1});
    cuda::BoxGravity<Real> gravity(mpi::Comm(MPI_COMM_SELF), stream);
    gravity::Stats stats;
    gravity.add_field(
        sets.sets()[1],
        {.box = box, .cell = 2e3, .spacing = 1e3, .split = {.scale = 0.8, .cutoff = 3.6}, .mass_unit = all.mass[0]}, 0,
        n, acceleration.data(), stats);
    std::printf("%g pairs, %g m/s2\n", stats.pairs, acceleration.download(1, stream)[0]);
  }
  cuda::check(cudaStreamDestroy(stream), "stream");
}

// A mesh is shared by ranks where it is large; this one, which they share all the same, is small.
template <class Real>
void share_mesh(const mpi::Comm& comm) {
  const cuda::Stream stream;
  cuda::DeviceConvolution<Real> convolution({{8, 6, 7}, {16, 12, 14}},
                                            gravity::mesh_kernel({.scale = 0.8, .cutoff = 3.6}), comm, stream);
  const cuda::MeshPlanes<Real> masses = convolution.masses();
  cuda::check(cudaMemsetAsync(masses.values, 0, masses.size() * sizeof(Real), stream), "masses");
  convolution.apply();
  Real potential = 0;
  cuda::check(
      cudaMemcpyAsync(&potential, convolution.potential().values, sizeof potential, cudaMemcpyDeviceToHost, stream),
      "potential");
  cuda::check(cudaStreamSynchronize(stream), "potential");
  std::printf("a potential of %g\n", static_cast<double>(potential));
}

grid::EngineSetup setup_for(Precision precision) {
  grid::EngineSetup setup;
  setup.cell = 1000.0;
  setup.materials.resize(1);
  setup.self_gravity = true;
  setup.uniform_gravity = {0.0, 0.0, -1.0};
  setup.numerics.precision = precision;
  return setup;
}

template <class P>
void fill(cuda::CudaEngine<P>& engine, const ParticleArrays& all) {
  material::FlawLists flaws;
  for (std::size_t i = 0; i <= all.size(); ++i) flaws.first.push_back(static_cast<std::uint32_t>(2 * i));
  for (std::size_t i = 0; i < all.size(); ++i) flaws.threshold.insert(flaws.threshold.end(), {1e-6F, 1e-3F});
  const std::vector<Vec3d> spin(1);
  engine.insert(all, flaws, spin);
}

template <class P>
void attract(cuda::CudaEngine<P>& engine, Precision precision) {
  for (const GravityMethod method : {GravityMethod::kDirect, GravityMethod::kTree}) {
    engine.make_resident_solver(method, {.precision = precision})->evaluate_and_hold(1.0);
  }
}

template <class P>
void advance(cuda::CudaEngine<P>& engine, int sortings) {
  engine.scatter(0.5 * kStep);
  for (int n = 0; n < sortings; ++n) {
    engine.update_grid(kStep);
    engine.gather_scatter(kStep);
    engine.update_grid(kStep);
    engine.gather(kStep);
    engine.finish_damage();
    engine.sort();
    engine.scatter(0.5 * kStep);
  }
  engine.update_grid(kStep);
  std::printf("%zu particles, %llu tiles, %llu alone, fastest %g m/s, work %g J\n", engine.observe().size(),
              static_cast<unsigned long long>(engine.stats().tiles),
              static_cast<unsigned long long>(engine.stats().lone_particles), engine.signal_speeds().particle,
              engine.passes().plastic_work);
}

// A clump on the border of two ranks, and half a cell later.
ParticleArrays drifting_share(double cell, const mpi::Comm& comm) {
  const ParticleArrays all = particles(cell);
  ParticleArrays share;
  for (std::size_t i = 0; i < kClump; ++i) {
    if (static_cast<int>(i) % comm.size() != comm.rank()) continue;
    share.id.push_back(all.id[i]);
    share.position.push_back(all.position[i] - Vec3d{1.5 * cell, 0.0, 0.0});
    share.velocity.push_back(all.velocity[i] + Vec3d{0.25 * cell / kStep, 0.0, 0.0});
    share.mass.push_back(all.mass[i]);
    share.body.push_back(0);
    share.material.push_back(0);
    share.damage.push_back(0.0);
  }
  return share;
}

// False if there was nothing to send.
template <class P>
bool run_on_ranks(Precision precision, const mpi::Comm& comm) {
  grid::EngineSetup setup = setup_for(precision);
  setup.slab_axis = 0;
  setup.boundaries = {{{0.0, 0.0, 0.0}, {0.0, 0.0, 1.0}, BoundaryKind::kSlip, 0.0}};
  cuda::CudaEngine<P> engine(setup, comm);
  fill(engine, drifting_share(setup.cell, comm));
  const std::size_t before = engine.stats().particles;
  advance(engine, 1);
  engine.kick_velocities(kStep);
  share_mesh<typename P::Real>(comm);
  return comm.any(engine.stats().particles != before) && engine.stats().halo_bytes_per_step > 0;
}

template <class P>
void run(Precision precision, std::string_view part, int sortings) {
  const grid::EngineSetup setup = setup_for(precision);
  const ParticleArrays all = particles(setup.cell);
  if (part.empty() || part == "mesh") sum_in_box<typename P::Real>(all);
  if (part == "mesh") return;
  cuda::CudaEngine<P> engine(setup, mpi::Comm(MPI_COMM_SELF));
  fill(engine, all);
  if (part != "steps") attract(engine, precision);
  if (part != "gravity") advance(engine, sortings);
}

}  // namespace

int main(int count, char** arguments) {
  const breccia::mpi::Environment environment(&count, &arguments);
  breccia::cuda_emulation::set_order(breccia::cuda_emulation::Order::kRandom, 1);
  const std::string_view part = count > 1 ? arguments[1] : "";
  if (!part.empty() && part != "steps" && part != "gravity" && part != "mesh" && part != "ranks") return 2;
  const breccia::mpi::Comm world;
  // Both precisions are the same source.
  const bool both = part.empty();
  using breccia::Precision;
  if (world.size() > 1) {
    bool sent = run_on_ranks<breccia::MixedPrecision>(Precision::kMixed, world);
    if (both) sent = run_on_ranks<breccia::DoublePrecision>(Precision::kDouble, world) && sent;
    return sent ? 0 : 1;
  }
  run<breccia::MixedPrecision>(Precision::kMixed, part, both ? 3 : 1);
  if (both) run<breccia::DoublePrecision>(Precision::kDouble, part, 3);
  return 0;
}

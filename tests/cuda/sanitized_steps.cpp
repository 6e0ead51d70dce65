// A few steps of a small scene, a sorting included, through the engine on the emulated device: built with a sanitizer,
// as racecheck (every lane is a thread to it) or memcheck of every kernel. Racecheck is slow: an argument ("steps",
// "gravity" or "mesh") asks for one part, briefly, so that the parts run side by side.
#include <algorithm>
#include <cstdio>
#include <string_view>
#include <vector>

#include "cuda/body_sets.hpp"
#include "cuda/box_gravity.hpp"
#include "cuda/cuda_engine.hpp"
#include "cuda/device_census.hpp"

namespace {

using namespace breccia;

constexpr int kClump = 150;  // the first particles

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
  constexpr double step = 0.02;
  engine.scatter(0.5 * step);
  for (int n = 0; n < sortings; ++n) {
    engine.update_grid(step);
    engine.gather_scatter(step);
    engine.update_grid(step);
    engine.gather(step);
    engine.finish_damage();
    engine.sort();
    engine.scatter(0.5 * step);
  }
  engine.update_grid(step);
  std::printf("%zu particles, %llu tiles, %llu alone, fastest %g m/s, work %g J\n", engine.observe().size(),
              static_cast<unsigned long long>(engine.stats().tiles),
              static_cast<unsigned long long>(engine.stats().lone_particles), engine.signal_speeds().particle,
              engine.passes().plastic_work);
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
  if (!part.empty() && part != "steps" && part != "gravity" && part != "mesh") return 2;
  run<breccia::MixedPrecision>(breccia::Precision::kMixed, part, part.empty() ? 3 : 1);
  // Both precisions are the same source.
  if (part.empty()) run<breccia::DoublePrecision>(breccia::Precision::kDouble, part, 3);
  return 0;
}

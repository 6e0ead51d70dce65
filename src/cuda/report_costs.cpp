// Prints what tools/gpu-report cannot learn from the compiler: sizes of dynamic shared memory, threads, traffic and
// arithmetic of the hot kernels, as JSON. Arithmetic is counted by running the very functions on numbers that count.
#include <cstdio>

#include "cuda/counted.hpp"
#include "cuda/near_list.cuh"
#include "cuda/tile_pass.cuh"
#include "cuda/traffic.hpp"
#include "cuda/tree_tiles.cuh"

namespace {

using namespace breccia;
using namespace breccia::cuda;

constexpr double kParticlesPerCell = 8.0;
// Between two sortings the box of touched nodes grows from 6 to 8; half way.
constexpr int kBox = 7;

// Operations of strain, damage bound and stress, elastic and below yield as most rock is in most steps.
long constitutive_operations() {
  using R = Counted;
  material::Constants<float> constants = material::make_constants<float>(MaterialParameters{}, LiteralSwitches{}, 1e3);
  material::State<R> state{};
  const Mat3<R> gradient{R(1e-3F), R(2e-3F), R(0), R(0), R(-1e-3F), R(0), R(0), R(0), R(-1e-3F)};
  material::Dissipation<R> lost{};
  Counted::operations = 0;
  material::update_strain(material::RockEffects{}, constants, state, gradient, 0.01F);
  (void)material::principal_strain_may_exceed(state, R(1.0F));
  (void)material::update_stress(material::RockEffects{}, constants, state, gradient, 0.005F, lost);
  return Counted::operations;
}

// By hand: 9 lines of 13, three planes of 7 and 6 at the end for each of 6 channels; 27 nodes of 6 * 8 + 2 and
// twice, for momentum and force, 17 of weights.
constexpr long kGatherOperations = 6 * (9 * 13 + 3 * 7 + 6);
constexpr long kScatterOperations = 27 * (2 * 17 + 6 * 8 + 2);

template <class Real>
void print(const char* name, long operations, const char* end) {
  std::printf(
      "  {\"real\": \"%s\", \"tile_shared\": %zu, \"lone_shared\": %zu, \"direct_tile\": %zu, \"group_tiles\": %zu, "
      "\"near_lists\": %zu, "
      "\"threads\": %d, \"tile_bytes_particle\": %d,\n"
      "   \"tile_bytes_grid\": %.1f, \"node_bytes\": %.1f, \"operations\": %ld}%s\n",
      name, sizeof(TileShared<Real>), kPassThreads * sizeof(ThreadWork), sizeof(DirectTile<Real>),
      sizeof(GroupShared<Real>), sizeof(NearShared<Real>), kPassThreads, particle_bytes<Real>(),
      (kVelocities * kTileNodes + kSums * kBox * kBox * kBox) * static_cast<double>(sizeof(Real)) /
          (kParticlesPerCell * grid::kBlockNodes),
      (kSums * kBox * kBox * kBox + kSums * grid::kBlockNodes) * static_cast<double>(sizeof(Real)) /
          (kParticlesPerCell * grid::kBlockNodes),
      operations, end);
}

}  // namespace

int main() {
  const long operations = constitutive_operations() + kGatherOperations + kScatterOperations;
  std::printf("[\n");
  print<float>("float", operations, ",");
  print<double>("double", operations, "");
  std::printf("]\n");
  return 0;
}

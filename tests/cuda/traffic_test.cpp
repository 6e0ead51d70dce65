// The table behind the counted bytes of a step (cuda/traffic.hpp), against the kernels: what it calls unwritten stays,
// what it calls unread may hold anything.
#include "cuda/traffic.hpp"

#include <gtest/gtest.h>

#include "cuda/device_grid.hpp"
#include "cuda/launchers.hpp"
#include "cuda/step_graph.hpp"

namespace breccia::cuda {
namespace {

constexpr unsigned kParticles = 40;
constexpr grid::GroupSet kAll{.elastic = true, .energy = true, .damage_level = true, .flaws = true, .gravity = true};

template <class P>
class Step {
 public:
  using Real = typename P::Real;
  using Fields = std::vector<std::vector<std::byte>>;

  Step() : particles_(kAll), grid_({}, true) {
    prepare_tile_pass<Real>();
    particles_.allocate(kParticles);
    for (const auto& field : particles_.fields()) upload(field, values_of(*field.descriptor));
    const std::vector<grid::BlockKey> keys(kParticles, grid::block_key({1, 2, 3}));
    grid_.set_block_keys(keys, stream_);
    grid_.sort(particles_, {}, stream_);
    sums_.allocate(grid_.pass_blocks());
    sums_.fill_bytes(0, stream_);
    strayed_.allocate(2);
    strayed_.fill_bytes(0, stream_);
    const std::vector<material::Constants<Real>> constants{
        material::make_constants<Real>(MaterialParameters{}, LiteralSwitches{}, 1000.0)};
    materials_.allocate(1);
    materials_.upload(constants, stream_);
    pass(false);
    NodeArguments<Real> nodes;
    nodes.grid = grid_.view();
    nodes.kick = Real(0.02);
    nodes.cell = 1000.0;
    launch_node_update(nodes, stream_);
  }

  void pass(bool gather) {
    PassArguments<Real> a;
    a.particles = particles_.view();
    a.grid = grid_.view();
    a.sums = sums_.data();
    a.strayed = strayed_.data();
    a.clamped = strayed_.data() + 1;
    a.materials = materials_.data();
    a.held_gravity = true;
    a.cell = 1000;
    a.step = a.kick = Real(0.02);
    a.stress_half_step = Real(0.01);
    a.transfer = {Real(0.995), Real(1), true};
    a.gather = gather;
    launch_tile_pass(a, stream_);
  }

  [[nodiscard]] Fields fields() const {
    Fields all;
    for (const auto& field : particles_.fields()) all.push_back(particles_.download(field, stream_));
    return all;
  }
  // What the tile has scattered; nodes outside the box keep what they had.
  [[nodiscard]] std::vector<std::byte> sums() const {
    std::vector<std::byte> values(grid_.tiles() * std::size_t{kSums} * kTileNodes * sizeof(Real));
    check(cudaMemcpyAsync(values.data(), grid_.view().partial_sums, values.size(), cudaMemcpyDeviceToHost, stream_),
          "sums");
    check(cudaStreamSynchronize(stream_), "sums");
    return values;
  }
  void set(const Fields& all) {
    for (std::size_t n = 0; n < all.size(); ++n) upload(particles_.fields()[n], all[n]);
  }

 private:
  void upload(const typename DeviceParticles<P>::Field& field, const std::vector<std::byte>& values) {
    particles_.upload(field, values.data(), stream_);
  }

  template <class T>
  static std::vector<std::byte> bytes_of(const std::vector<T>& values) {
    const auto* first = reinterpret_cast<const std::byte*>(values.data());
    return {first, first + values.size() * sizeof(T)};
  }

  // Something for every field that a step of intact rock can go on from.
  static std::vector<std::byte> values_of(const grid::FieldDescriptor& f) {
    const std::string_view name = f.name;
    const auto count = static_cast<std::size_t>(f.components) * kParticles;
    if (name == "node" || f.group == grid::Group::kIdentity || name == "flaw_first" || name == "flaw_count") {
      std::vector<std::int32_t> values(count, 0);
      for (std::size_t i = 0; i < count; ++i) {
        const auto cell = static_cast<std::int32_t>(i % 4);
        if (name == "node") values[i] = (8 + cell) | 9 << 8 | 10 << 16;
        if (name == "flaw_count") values[i] = 3 << 16 | 1;  // one of three grows
      }
      return bytes_of(values);
    }
    if (name == "offset") {
      std::vector<typename P::Offset> values(count);
      for (std::size_t i = 0; i < count; ++i) {
        values[i] = static_cast<typename P::Offset>((sizeof(Real) == 4 ? 0x1p31 : 0.5) * std::sin(1.7 * double(i)));
      }
      return bytes_of(values);
    }
    const double size = name == "velocity" ? 50.0 : name == "mass" ? 1e12 : name == "next_threshold" ? 1e30 : 1e-4;
    std::vector<Real> values(count);
    for (std::size_t i = 0; i < count; ++i) {
      const double wave =
          name == "mass" || name == "next_threshold" || name == "damage_root" ? 1.0 : std::sin(double(i));
      values[i] = static_cast<Real>(size * wave);
    }
    return bytes_of(values);
  }

  Stream stream_;
  DeviceParticles<P> particles_;
  DeviceGrid<P> grid_;
  DeviceArray<PassSums> sums_;
  DeviceArray<unsigned> strayed_;
  DeviceArray<material::Constants<Real>> materials_;
};

template <class P>
class Traffic : public testing::Test {};
using Precisions = testing::Types<MixedPrecision, DoublePrecision>;
TYPED_TEST_SUITE(Traffic, Precisions);

TYPED_TEST(Traffic, TableSaysWhatAStepReadsAndWrites) {
  cuda_emulation::set_order(cuda_emulation::Order::kForward);
  using Real = typename TypeParam::Real;
  Step<TypeParam> step;
  const auto before = step.fields();
  step.pass(true);
  const auto after = step.fields();
  const auto sums = step.sums();
  auto poisoned = before;
  const auto table = field_traffic<Real>();
  const auto descriptors = device_fields<TypeParam>();
  ASSERT_EQ(table.size(), descriptors.size());
  for (std::size_t n = 0; n < table.size(); ++n) {
    ASSERT_EQ(table[n].name, descriptors[n].name);
    const bool written = table[n].reals_written + table[n].words_written > 0;
    EXPECT_EQ(before[n] != after[n], written || table[n].name == "node") << table[n].name;
    if (table[n].reals_read + table[n].words_read == 0)
      std::fill(poisoned[n].begin(), poisoned[n].end(), std::byte{0xff});
    const int words = static_cast<int>(sizeof(Real) / 4) * std::max(table[n].reals_read, table[n].reals_written) +
                      std::max(table[n].words_read, table[n].words_written);
    const int all = descriptors[n].components * descriptors[n].element_bytes / 4;
    EXPECT_TRUE(words == 0 || words == all) << table[n].name;
  }
  step.set(poisoned);
  step.pass(true);
  const auto again = step.fields();
  EXPECT_EQ(step.sums(), sums);
  for (std::size_t n = 0; n < table.size(); ++n) {
    if (poisoned[n] == before[n]) {
      EXPECT_EQ(again[n], after[n]) << table[n].name;
    } else {
      EXPECT_EQ(again[n], poisoned[n]) << table[n].name;
    }
  }
}

// 8 particles per cell, all effects on, D < 1, the box of touched nodes as wide as it gets.
TEST(TrafficOfAStep, IsBelowThreeHundredBytesInMixedPrecision) {
  EXPECT_LE(particle_bytes<float>() + grid_bytes<float>(8.0, 8), 300.0);
}

}  // namespace
}  // namespace breccia::cuda

// Particles into the engine: positions to node and offset, initial velocity gradient of spinning bodies, flaws.
#include <algorithm>
#include <cmath>
#include <limits>

#include "breccia/error.hpp"
#include "grid/host_engine.hpp"

namespace breccia::grid {
namespace {

// Splits x/dx into the nearest node and the offset from it.
std::int32_t split(double cells, std::int32_t& offset) {
  double node = std::floor(cells + 0.5);
  double units = std::round((cells - node) * 0x1p32);
  if (units >= 0x1p31) {
    units -= 0x1p32;
    node += 1.0;
  }
  offset = static_cast<std::int32_t>(units);
  return static_cast<std::int32_t>(node);
}
std::int32_t split(double cells, double& offset) {
  const double node = std::floor(cells + 0.5);
  offset = cells - node;
  return static_cast<std::int32_t>(node);
}

}  // namespace

template <class P>
void HostEngine<P>::insert(const ParticleArrays& particles, const material::FlawLists& flaws,
                           std::span<const Vec3d> spin_of_body) {
  const std::size_t count = particles.size();
  store_.allocate((count + kLanes - 1) / kLanes);
  take_flaws(flaws);
  double lightest = std::numeric_limits<double>::infinity();
  bool too_far = false;
  std::vector<Placement> placements(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t pack = i / kLanes;
    const int lane = static_cast<int>(i % kLanes);
    placements[i].slot = static_cast<std::uint32_t>(i);
    Kinematics<P>& k = store_.kinematics[pack];
    const Vec3d x = boundaries_.into_period(particles.position[i]);
    const double cells[3] = {x.x / setup_.cell, x.y / setup_.cell, x.z / setup_.cell};
    const double speed[3] = {particles.velocity[i].x, particles.velocity[i].y, particles.velocity[i].z};
    for (int axis = 0; axis < 3; ++axis) {
      too_far = too_far || !(std::abs(cells[axis]) < static_cast<double>(kBlockLimit) * kBlockWidth);
      if (too_far) break;
      typename P::Offset offset{};
      const std::int32_t node = split(cells[axis], offset);
      k.offset[axis].set(lane, offset);
      k.velocity[axis].set(lane, static_cast<Real>(speed[axis]));
      placements[i].node[axis] = kBlockWidth * periodicity_.wrap(node >> 2, axis) + (node & 3);
    }
    k.mass.set(lane, static_cast<Real>(particles.mass[i]));
    lightest = std::min(lightest, particles.mass[i]);
    Identity<P>& identity = store_.identity[pack];
    identity.id_low.set(lane, static_cast<std::int32_t>(particles.id[i] & 0xffffffffU));
    identity.id_high.set(lane, static_cast<std::int32_t>(particles.id[i] >> 32));
    identity.body_material.set(lane, static_cast<std::int32_t>(particles.body[i] | particles.material[i] << 16));
    if (store_.has(Group::kDamageLevel)) {
      store_.damage_level[pack].root.set(lane, static_cast<Real>(std::cbrt(particles.damage[i])));
    }
    if (store_.has(Group::kFlaws)) {
      set_flaws(i, flaws, i, 0);
    }
    // C of a rigid rotation: v = spin x r.
    const Vec3d w = spin_of_body[particles.body[i]];
    const double gradient[9] = {0, -w.z, w.y, w.z, 0, -w.x, -w.y, w.x, 0};
    for (int c = 0; c < 9; ++c) store_.affine[pack].gradient[c].set(lane, static_cast<Real>(gradient[c]));
  }
  if (comm_.any(too_far)) {
    throw UsageError("a particle starts more than 4 million cells from the origin: choose a larger grid.cell");
  }
  smallest_mass_ = comm_.min(lightest);
  choose_slabs(placements);
  settle(placements);
}

template <class P>
void HostEngine<P>::take_flaws(const material::FlawLists& flaws) {
  flaw_codes_.resize(flaws.threshold.size());
  std::ranges::transform(flaws.threshold, flaw_codes_.begin(),
                         [](float strain) { return material::flaw_code(strain); });
}

template <class P>
std::span<const material::FlawCode> HostEngine<P>::flaws_of(std::size_t slot) const {
  const Flaws<P>& f = store_.flaws[slot / kLanes];
  const int lane = static_cast<int>(slot % kLanes);
  return std::span(flaw_codes_)
      .subspan(static_cast<std::size_t>(f.first[lane]), static_cast<std::size_t>(FlawState::of(f.state[lane]).all));
}

template <class P>
void HostEngine<P>::set_flaws(std::size_t slot, const material::FlawLists& flaws, std::size_t row,
                              std::uint32_t active) {
  const auto all = static_cast<std::uint32_t>(std::min<std::size_t>(flaws.of(row).size(), FlawState::kMostFlaws));
  if (active > all) throw IoError("more flaws grow than the particle has");
  Flaws<P>& f = store_.flaws[slot / kLanes];
  const int lane = static_cast<int>(slot % kLanes);
  f.first.set(lane, material::flaw_place(flaws.first[row]));
  const material::FlawCode next = active < all ? flaw_codes_[flaws.first[row] + active] : material::kNeverGrows;
  f.state.set(lane, FlawState{static_cast<std::int32_t>(active), static_cast<std::int32_t>(all), next}.packed());
}

template class HostEngine<MixedPrecision>;
template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid

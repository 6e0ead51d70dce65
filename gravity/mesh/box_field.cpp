#include "gravity/mesh/box_field.hpp"

#include <algorithm>

#include "breccia/constants.hpp"

namespace breccia::gravity {

template <class Real>
void BoxField<Real>::add_to(ParticlesView particles, std::span<const std::uint8_t> set, std::uint8_t number,
                            const BoxSettings& settings, const FieldView& field, Stats& stats) {
  const MeshGeometry geometry(settings.box, settings.cell);
  Phases& phases = stats.phases;
  phases.time(Phase::kTransform, [&] { prepare_mesh(geometry, settings.split); });
  phases.time(Phase::kSort, [&] {
    select(particles, set, number, geometry, settings.mass_unit);
    clusters_.build(position_, mass_, settings.spacing / settings.cell, threads_);
    for (auto& component : field_)
      component.assign(static_cast<std::size_t>(clusters_.count() * kClusterSize), Real(0));
  });
  mesh_->add_field(clusters_, field_, phases);
  stats.pairs += near_.add_field(clusters_, position_, mass_, settings.spacing / settings.cell, law_,
                                 !field.potential.empty(), field_, phases);
  write(settings, field);
}

template <class Real>
void BoxField<Real>::prepare_mesh(const MeshGeometry& geometry, const GaussianSplit& split) {
  if (mesh_ && mesh_->size() == geometry.size && split == split_) return;
  mesh_.reset();
  mesh_ = std::make_unique<BoxMesh<Real>>(geometry.size, split, comm_, threads_);
  law_ = fit_short_range<Real>(split);
  split_ = split;
}

template <class Real>
void BoxField<Real>::select(ParticlesView particles, std::span<const std::uint8_t> set, std::uint8_t number,
                            const MeshGeometry& geometry, double mass_unit) {
  index_.clear();
  position_.clear();
  mass_.clear();
  for (std::size_t i = 0; i < set.size(); ++i) {
    if (set[i] != number) continue;
    index_.push_back(i);
    position_.push_back(geometry.in_cells(particles.position[i]));
    mass_.push_back(particles.mass[i] / mass_unit);
  }
}

template <class Real>
void BoxField<Real>::write(const BoxSettings& settings, const FieldView& field) const {
  const double potential_unit = kGravitationalConstant * settings.mass_unit / settings.cell;
  const double unit = potential_unit / settings.cell;
  // A softened particle also got its own potential, of both parts together that of Plummer's law at distance 0.
  const double self = law_.counts_self ? 1.0 / settings.split.softening : 0.0;
  const std::vector<std::int64_t>& slots = clusters_.slots();
  const auto n = static_cast<std::int64_t>(index_.size());
#pragma omp parallel for num_threads(threads_) schedule(static)
  for (std::int64_t k = 0; k < n; ++k) {
    const std::size_t i = index_[static_cast<std::size_t>(k)];
    const auto slot = static_cast<std::size_t>(slots[static_cast<std::size_t>(k)]);
    field.acceleration[i] += unit * Vec3d{static_cast<double>(field_[0][slot]), static_cast<double>(field_[1][slot]),
                                          static_cast<double>(field_[2][slot])};
    field.work[i] += static_cast<double>(near_.pairs_of_clusters()[slot / kClusterSize]);
    if (!field.potential.empty()) {
      field.potential[i] +=
          potential_unit * (static_cast<double>(field_[3][slot]) + self * mass_[static_cast<std::size_t>(k)]);
    }
  }
}

template class BoxField<float>;
template class BoxField<double>;

}  // namespace breccia::gravity

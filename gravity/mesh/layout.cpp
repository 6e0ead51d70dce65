#include "gravity/mesh/layout.hpp"

#include <algorithm>

namespace breccia::gravity {

Layout lay_boxes(ParticlesView particles, const MeshParameters& mesh, const mpi::Comm& comm, int threads) {
  Layout layout;
  layout.spacing = mesh.particle_spacing > 0.0 ? mesh.particle_spacing : dense_spacing(particles, comm);
  layout.cell = mesh.cell > 0.0 ? mesh.cell : kCellsPerSpacing * layout.spacing;
  layout.boxes = choose_boxes(particles, layout.spacing, layout.cell, comm, threads);
  layout.set.assign(particles.position.size(), 0);
#pragma omp parallel for num_threads(threads) schedule(static)
  for (std::size_t i = 0; i < layout.set.size(); ++i) {
    layout.set[i] = set_of(particles.position[i], layout.boxes.data(), layout.boxes.size());
  }
  for (std::size_t k = 0; k <= layout.boxes.size(); ++k) {
    const auto here = std::count(layout.set.begin(), layout.set.end(), static_cast<std::uint8_t>(k));
    layout.count.push_back(static_cast<std::uint64_t>(here));
  }
  comm.sum(std::span<std::uint64_t>(layout.count));
  return layout;
}

Matter matter_of(const Layout& layout) {
  Matter matter;
  for (const std::uint64_t n : layout.count) matter.particles += n;
  matter.in_boxes = matter.particles - layout.count[0];
  for (const Box& box : layout.boxes) matter.mesh_nodes += mesh_nodes(box, layout.cell);
  matter.boxes = static_cast<int>(layout.boxes.size());
  return matter;
}

}  // namespace breccia::gravity

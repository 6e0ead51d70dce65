#include "gravity/mesh/layout.hpp"

#include <algorithm>

namespace breccia::gravity {

Layout lay_boxes(ParticlesView particles, const MeshParameters& mesh, const mpi::Comm& comm) {
  Layout layout;
  layout.spacing = mesh.particle_spacing > 0.0 ? mesh.particle_spacing : dense_spacing(particles, comm);
  layout.cell = mesh.cell > 0.0 ? mesh.cell : kCellsPerSpacing * layout.spacing;
  layout.boxes = choose_boxes(particles, layout.spacing, layout.cell, comm);
  layout.set.reserve(particles.position.size());
  for (const Vec3d p : particles.position) layout.set.push_back(set_of(p, layout.boxes.data(), layout.boxes.size()));
  return layout;
}

Matter matter_of(const Layout& layout, const mpi::Comm& comm) {
  Matter matter;
  const auto outside = std::count(layout.set.begin(), layout.set.end(), std::uint8_t{0});
  matter.particles = comm.sum(static_cast<std::uint64_t>(layout.set.size()));
  matter.in_boxes = matter.particles - comm.sum(static_cast<std::uint64_t>(outside));
  for (const Box& box : layout.boxes) matter.mesh_nodes += mesh_nodes(box, layout.cell);
  matter.boxes = static_cast<int>(layout.boxes.size());
  return matter;
}

}  // namespace breccia::gravity

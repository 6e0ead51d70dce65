#include "gravity/mesh/layout.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

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
  layout.mass.assign(layout.count.size(), 0.0);
  for (std::size_t i = 0; i < layout.set.size(); ++i) layout.mass[layout.set[i]] += particles.mass[i];
  comm.sum(std::span<double>(layout.mass));
  return layout;
}

Matter matter_of(const Layout& layout) {
  Matter matter;
  for (const std::uint64_t n : layout.count) matter.particles += n;
  matter.in_boxes = matter.particles - layout.count[0];
  std::vector<PlacedBody> bodies;
  for (std::size_t k = 0; k < layout.boxes.size(); ++k) {
    const Box& box = layout.boxes[k];
    matter.mesh_nodes += mesh_nodes(box, layout.cell);
    bodies.push_back({.particles = layout.count[k + 1],
                      .mass = layout.mass[k + 1],
                      .volume = static_cast<double>(layout.count[k + 1]) * std::pow(layout.spacing, 3),
                      .centre = 0.5 * (box.low + box.high)});
  }
  matter.bodies = weigh(bodies, std::accumulate(layout.mass.begin(), layout.mass.end(), 0.0));
  return matter;
}

}  // namespace breccia::gravity

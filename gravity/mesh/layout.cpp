#include "gravity/mesh/layout.hpp"

#include <cmath>
#include <numeric>

#include "gravity/mesh/geometry.hpp"
#include "gravity/mesh/host_census.hpp"

namespace breccia::gravity {

Layout lay_boxes(Census& census, const MeshParameters& mesh, const mpi::Comm& comm) {
  Layout layout;
  layout.spacing = mesh.particle_spacing > 0.0 ? mesh.particle_spacing : dense_spacing(census, comm);
  layout.cell = mesh.cell > 0.0 ? mesh.cell : kCellsPerSpacing * layout.spacing;
  layout.boxes = choose_boxes(census, layout.spacing, layout.cell, comm);
  for (const SetSum& sum : census.sets(layout.boxes)) {
    layout.count.push_back(sum.particles);
    layout.mass.push_back(sum.mass);
  }
  comm.sum(std::span<std::uint64_t>(layout.count));
  comm.sum(std::span<double>(layout.mass));
  return layout;
}

Layout lay_boxes(ParticlesView particles, const MeshParameters& mesh, const mpi::Comm& comm, int threads) {
  HostCensus census(particles, threads);
  Layout layout = lay_boxes(census, mesh, comm);
  layout.set.swap(census.set_of_each());
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

// An exact number of particles spread evenly over a shape.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "breccia/random.hpp"
#include "breccia/scene.hpp"

namespace breccia::scene {

/// Volume that belongs to one particle of a lattice with this distance of nearest neighbours [m3].
double volume_per_particle(Lattice lattice, double spacing);

/// Its inverse: distance of nearest neighbours [m].
double lattice_spacing(Lattice lattice, double volume);

/// `count` lattice points over an analytic shape, each standing for the volume shape/count.
///
/// The lattice is cut at the shape, scaled by the factor next to 1 that leaves exactly `count` points. Of many origins
/// of the lattice (fewer for larger counts) the one is taken whose cut fills the shape best: smallest errors of centre
/// and second moments for spheres and ellipsoids, faces furthest inside for boxes and cylinders. At last the points are
/// shifted to have their mean exactly in the centre.
class LatticeFill {
 public:
  /// `stream` draws the random lattice and breaks ties between points on the cut.
  LatticeFill(Lattice lattice, Shape shape, const Vec3d& semi_axes, std::uint64_t count, const RandomStream& stream);

  /// Points begin .. end-1 in lattice order (x slowest), relative to the centre of the shape [m].
  [[nodiscard]] std::vector<Vec3d> points(std::uint64_t begin, std::uint64_t end) const;

 private:
  /// Orders points by scaled radius; rounding noise is cut off so that symmetric points tie, and ties are broken
  /// evenly over the surface.
  using CutKey = std::array<std::uint64_t, 3>;

  struct Cut {
    Vec3d origin{};     ///< of the lattice, in conventional cells
    double inside = 0;  ///< scaled radius below which every point is kept
    CutKey last{};      ///< key of the last point kept
    Vec3d mean{};       ///< [m]
    double misfit = 0;  ///< what the choice of the origin makes small
  };

  [[nodiscard]] Cut cut(const Vec3d& origin) const;
  [[nodiscard]] double misfit(const Sym3<double>& moments, const Vec3d& mean, double cut_radius) const;
  [[nodiscard]] bool keeps(const Cut& cut, std::uint64_t ordinal, double radius) const;
  [[nodiscard]] CutKey cut_key(std::uint64_t ordinal, double radius) const;
  [[nodiscard]] std::vector<Vec3d> origins() const;
  [[nodiscard]] Vec3d jitter(std::uint64_t ordinal) const;
  template <class Visit>
  void for_each_point(const Vec3d& origin, double reach, Visit visit) const;

  Lattice lattice_;
  Shape shape_;
  Vec3d semi_axes_;
  std::uint64_t count_;
  RandomStream stream_;
  Vec3d cell_{};              ///< conventional cell [m]
  std::vector<Vec3d> basis_;  ///< points in it, in cells
  double shell_;              ///< half width of the shell of scaled radii in which the cut is looked for
  Cut best_;
};

}  // namespace breccia::scene

// A scene while it is being read: what was given, and room for what follows from other keys.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "breccia/scene.hpp"

namespace breccia::scene {

/// The one preset there is; its numbers are the default member values of MaterialParameters.
enum class MaterialPreset { kBasalt };

struct MaterialDraft {
  MaterialParameters parameters;
  MaterialPreset preset = MaterialPreset::kBasalt;
};

/// A body as written. Empty optionals are filled by resolve() where they apply to the shape.
struct BodyDraft {
  std::string name;
  std::optional<Shape> shape;
  std::optional<double> radius;
  std::optional<double> height;
  std::optional<Vec3d> axes;
  std::optional<Vec3d> size;
  std::string file;
  std::string material;
  std::optional<std::uint64_t> particles;
  std::optional<double> spacing;
  Lattice lattice = Lattice::kFcc;
  std::optional<Vec3d> position;
  std::optional<Vec3d> velocity;
  Vec3d spin{};
  double damage = 0.0;
};

struct BoundaryDraft {
  Vec3d point{};
  std::optional<Vec3d> normal;
  std::optional<BoundaryKind> kind;
  std::optional<double> friction;
};

struct ImpactDraft {
  std::optional<double> velocity;
  double angle = 0.0;
  std::optional<double> separation;
};

struct Draft {
  Scene scene;  ///< everything but the lists and optionals below
  std::optional<double> end;
  std::optional<double> cell;
  std::optional<double> softening;
  std::optional<double> diagnostics;
  std::vector<MaterialDraft> materials;
  std::vector<BodyDraft> bodies;
  std::vector<BoundaryDraft> boundaries;
  std::optional<ImpactDraft> impact;
};

}  // namespace breccia::scene

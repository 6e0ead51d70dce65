#include <fmt/format.h>

#include <cmath>

#include "breccia/error.hpp"
#include "scene/resolve_bodies.hpp"

namespace breccia::scene {

namespace {

BoundaryPlane resolve_plane(BoundaryDraft& draft, const Document& document, const std::string& prefix) {
  if (!draft.normal) fail(document, prefix + "normal", "is missing; for example normal = [0, 0, 1]");
  if (!draft.kind) fail(document, prefix + "kind", "is missing; one of slip, stick, friction, periodic");
  const double length = std::sqrt(dot(*draft.normal, *draft.normal));
  if (length == 0.0) fail(document, prefix + "normal", "has no direction; for example normal = [0, 0, 1]");
  const bool has_friction = *draft.kind == BoundaryKind::kFriction;
  if (has_friction && !draft.friction) fail(document, prefix + "friction", "is missing; for example friction = 0.6");
  if (!has_friction && draft.friction) fail(document, prefix + "friction", "belongs to kind = \"friction\" only");
  draft.normal = (1.0 / length) * *draft.normal;
  return {draft.point, *draft.normal, *draft.kind, draft.friction.value_or(0.0)};
}

// A facing plane: opposite normal, on the other side of the matter.
bool face_each_other(const BoundaryPlane& a, const BoundaryPlane& b) {
  constexpr double kParallel = 1.0e-12;
  return dot(a.normal, b.normal) < -1.0 + kParallel && dot(b.point - a.point, a.normal) > 0.0;
}

}  // namespace

void resolve_boundaries(Draft& draft, Scene& scene, const Document& document) {
  for (std::size_t i = 0; i < draft.boundaries.size(); ++i)
    scene.boundaries.push_back(resolve_plane(draft.boundaries[i], document, fmt::format("boundary[{}].", i)));
  for (std::size_t i = 0; i < scene.boundaries.size(); ++i) {
    if (scene.boundaries[i].kind != BoundaryKind::kPeriodic) continue;
    int partners = 0;
    for (std::size_t j = 0; j < scene.boundaries.size(); ++j) {
      const bool periodic = j != i && scene.boundaries[j].kind == BoundaryKind::kPeriodic;
      if (periodic && face_each_other(scene.boundaries[i], scene.boundaries[j])) ++partners;
    }
    if (partners != 1)
      fail(
          document, fmt::format("boundary[{}].kind", i),
          fmt::format("a periodic plane needs exactly one facing periodic plane with the opposite normal; there are {}",
                      partners));
  }
}

}  // namespace breccia::scene

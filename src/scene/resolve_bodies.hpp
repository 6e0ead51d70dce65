// Bodies, [impact] and [[boundary]] of a draft as resolved.
#pragma once

#include "scene/resolve.hpp"

namespace breccia::scene {

/// Shape, material, mass and count of every body. Needs scene.materials and scene.cell.
void resolve_bodies(Draft& draft, Scene& scene, const Document& document, const mpi::Comm* comm);

/// Places the two bodies of [impact], if there is one.
void resolve_impact(Draft& draft, Scene& scene, const Document& document);

/// Normals, friction and periodic pairs.
void resolve_boundaries(Draft& draft, Scene& scene, const Document& document);

}  // namespace breccia::scene

#include "scene/resolve_bodies.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "breccia/error.hpp"
#include "scene/body_points.hpp"
#include "scene/orbit.hpp"
#include "scene/shapes.hpp"
#include "scene/suggest.hpp"

namespace breccia::scene {

namespace {

struct BodyContext {
  BodyDraft& draft;
  const Document& document;
  std::string prefix;  ///< "body[0]."

  [[noreturn]] void problem(const std::string& key, const std::string& what) const {
    fail(document, prefix + key, what);
  }
  template <class T>
  const T& required(const char* key, const std::optional<T>& value, const char* example) const {
    if (!value) problem(key, fmt::format("is missing; for example {}", example));
    return *value;
  }
};

// A size that the shape does not use would be ignored silently.
void check_sizes(const BodyContext& body) {
  const Shape shape = *body.draft.shape;
  const auto only = [&](const char* key, bool given, bool used) {
    if (given && !used) body.problem(key, "does not belong to this shape");
  };
  const bool file = shape == Shape::kParticles;
  only("radius", body.draft.radius.has_value(), shape == Shape::kSphere || shape == Shape::kCylinder);
  only("axes", body.draft.axes.has_value(), shape == Shape::kEllipsoid);
  only("size", body.draft.size.has_value(), shape == Shape::kBox);
  only("height", body.draft.height.has_value(), shape == Shape::kCylinder);
  only("file", !body.draft.file.empty(), file);
  only("particles", body.draft.particles.has_value(), !file);
  only("spacing", body.draft.spacing.has_value(), !file);
}

Vec3d semi_axes_of(const BodyContext& body) {
  const Shape shape = *body.draft.shape;
  if (shape == Shape::kEllipsoid)
    return body.required("axes", body.draft.axes, "axes = [\"3 km\", \"2 km\", \"1 km\"] (semi-axes)");
  if (shape == Shape::kBox)
    return 0.5 * body.required("size", body.draft.size, "size = [\"3 km\", \"2 km\", \"1 km\"] (full lengths)");
  const double r = body.required("radius", body.draft.radius, "radius = \"50 km\"");
  if (shape == Shape::kSphere) return {r, r, r};
  return {r, r, 0.5 * body.required("height", body.draft.height, "height = \"2 m\"")};
}

std::uint32_t material_of(const BodyContext& body, const Scene& scene) {
  std::vector<std::string> names;
  for (const MaterialParameters& material : scene.materials) names.push_back(material.name);
  std::string& wanted = body.draft.material;
  if (wanted.empty()) {
    if (names.size() > 1) body.problem("material", "is missing; there is more than one material");
    wanted = names.front();
  }
  const auto found = std::find(names.begin(), names.end(), wanted);
  if (found == names.end())
    body.problem("material", fmt::format("there is no [materials.{}]{}", wanted, did_you_mean(wanted, names)));
  return static_cast<std::uint32_t>(found - names.begin());
}

// A box is filled best by whole planes, so a cubic lattice of given spacing takes a whole number of them per side.
double count_for_spacing(const BodyParameters& body, double spacing) {
  if (body.shape == Shape::kBox && body.lattice == Lattice::kCubic) {
    const auto planes = [&](double half) { return std::max(1.0, std::round(2.0 * half / spacing)); };
    return planes(body.semi_axes.x) * planes(body.semi_axes.y) * planes(body.semi_axes.z);
  }
  return std::round(shape_volume(body.shape, body.semi_axes) / volume_per_particle(body.lattice, spacing));
}

void resolve_count(const BodyContext& context, BodyParameters& body, double cell) {
  // Ids and ordinals of lattice points are 64-bit, but a mistyped size must not fill the memory.
  constexpr double kMostParticles = 1.0e11;
  BodyDraft& draft = context.draft;
  if (draft.particles && draft.spacing) context.problem("spacing", "follows from particles; give one of the two");
  if (!draft.particles) {
    if (!draft.spacing) draft.spacing = cell;
    const double n = count_for_spacing(body, *draft.spacing);
    if (n > kMostParticles)
      context.problem("spacing",
                      fmt::format("makes {:.3g} particles; check the unit of the size and of the spacing", n));
    if (n < 1.0) context.problem("spacing", "is larger than the body: there would be no particles");
    draft.particles = static_cast<std::uint64_t>(n);
  }
  if (*draft.particles == 0) context.problem("particles", "is 0; a body needs at least 1 particle");
  const double volume = shape_volume(body.shape, body.semi_axes);
  draft.spacing = lattice_spacing(body.lattice, volume / static_cast<double>(*draft.particles));
  body.particles = *draft.particles;
  body.spacing = *draft.spacing;
}

void resolve_analytic(const BodyContext& context, BodyParameters& body, const Scene& scene) {
  body.semi_axes = semi_axes_of(context);
  resolve_count(context, body, scene.cell);
  body.mass = scene.materials[body.material].eos.rho0 * shape_volume(body.shape, body.semi_axes);
}

void resolve_file(const BodyContext& context, BodyParameters& body, const Scene& scene, const mpi::Comm* comm) {
  if (context.draft.file.empty()) context.problem("file", "is missing; for example file = \"remnant.hdf\"");
  const std::filesystem::path path(context.draft.file);
  body.file = (path.is_absolute() ? path : std::filesystem::path(context.document.file).parent_path() / path).string();
  ParticleFileSummary summary;
  try {
    summary = shared_file_summary(body.file, comm);
  } catch (const IoError& error) {
    throw IoError(fmt::format("{}: {}file: {}", place_of(context.document, context.prefix + "file"), context.prefix,
                              error.what()));
  } catch (const UsageError& error) {
    context.problem("file", error.what());
  }
  body.particles = summary.count;
  body.mass = summary.mass;
  body.semi_axes = summary.half_extent;
  const double volume = summary.mass / scene.materials[body.material].eos.rho0;
  body.spacing = std::cbrt(volume / static_cast<double>(summary.count));
  if (!context.draft.position) context.draft.position = summary.centre;
  if (!context.draft.velocity) context.draft.velocity = summary.velocity;
}

BodyParameters resolve_body(const BodyContext& context, const Scene& scene, std::size_t index, const mpi::Comm* comm) {
  BodyDraft& draft = context.draft;
  BodyParameters body;
  if (draft.name.empty()) draft.name = fmt::format("body{}", index);
  body.name = draft.name;
  body.shape = context.required("shape", draft.shape, "shape = \"sphere\"");
  body.lattice = draft.lattice;
  body.material = material_of(context, scene);
  body.spin = draft.spin;
  body.damage = draft.damage;
  check_sizes(context);
  if (body.shape == Shape::kParticles) {
    resolve_file(context, body, scene, comm);
  } else {
    resolve_analytic(context, body, scene);
  }
  body.position = draft.position.value_or(Vec3d{});
  body.velocity = draft.velocity.value_or(Vec3d{});
  return body;
}

}  // namespace

void resolve_bodies(Draft& draft, Scene& scene, const Document& document, const mpi::Comm* comm) {
  if (draft.bodies.empty())
    throw UsageError(fmt::format("{}: there is no body; add [[body]] with shape = \"sphere\" and radius = \"50 km\"",
                                 document.file));
  std::uint64_t next_id = 0;
  for (std::size_t i = 0; i < draft.bodies.size(); ++i) {
    const BodyContext context{draft.bodies[i], document, fmt::format("body[{}].", i)};
    scene.bodies.push_back(resolve_body(context, scene, i, comm));
    scene.bodies.back().first_id = next_id;
    next_id += scene.bodies.back().particles;
  }
  for (std::size_t i = 0; i < draft.bodies.size(); ++i) {
    draft.bodies[i].position = scene.bodies[i].position;
    draft.bodies[i].velocity = scene.bodies[i].velocity;
  }
}

void resolve_impact(Draft& draft, Scene& scene, const Document& document) {
  if (!draft.impact) return;
  if (scene.bodies.size() != 2)
    throw UsageError(fmt::format("{}: [impact] needs exactly two bodies; the scene has {}",
                                 place_of(document, "impact.velocity"), scene.bodies.size()));
  for (std::size_t i = 0; i < 2; ++i)
    for (const char* name : {"position", "velocity"})
      for (const Entry& entry : document.entries)
        if (const std::string key = fmt::format("body[{}].{}", i, name); entry.key == key)
          fail(document, key, "follows from [impact]; remove one of them");
  if (!draft.impact->velocity) fail(document, "impact.velocity", "is missing; for example velocity = \"200 m/s\"");
  scene.impact = ImpactParameters{*draft.impact->velocity, draft.impact->angle, draft.impact->separation.value_or(0.0)};
  try {
    place_on_orbit(scene);
  } catch (const UsageError& error) {
    throw UsageError(fmt::format("{}: {}", place_of(document, "impact.separation"), error.what()));
  }
  draft.impact->separation = scene.impact->separation;
  for (std::size_t i = 0; i < 2; ++i) {
    draft.bodies[i].position = scene.bodies[i].position;
    draft.bodies[i].velocity = scene.bodies[i].velocity;
  }
}

}  // namespace breccia::scene

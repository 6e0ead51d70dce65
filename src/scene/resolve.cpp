#include "scene/resolve.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "breccia/error.hpp"
#include "scene/checks.hpp"
#include "scene/resolve_bodies.hpp"

namespace breccia::scene {

namespace {

// The name becomes a folder.
void resolve_name(Draft& draft, const Document& document) {
  std::string& name = draft.scene.name;
  if (name.empty()) name = std::filesystem::path(document.file).stem().string();
  const bool fine = std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.';
  });
  if (!fine || name.starts_with('.'))
    fail(document, "scene.name", fmt::format("\"{}\" must be made of letters, digits, \"-\", \"_\" and \".\"", name));
}

double required(const Document& document, const std::string& key, const std::optional<double>& value,
                const std::string& example) {
  if (!value) fail(document, key, fmt::format("is missing; for example {}", example));
  return *value;
}

void resolve_materials(Draft& draft, Scene& scene, const Document& document) {
  if (draft.materials.empty()) draft.materials.emplace_back();
  for (const MaterialDraft& material : draft.materials) {
    const MaterialParameters& p = material.parameters;
    const std::string prefix = fmt::format("materials.{}.", p.name);
    if (p.eos.Eiv >= p.eos.Ecv)
      fail(document, prefix + "tillotson_E_iv",
           "incipient vaporisation must be below complete vaporisation (tillotson_E_cv)");
    if (p.strength.limit <= p.strength.cohesion)
      fail(document, prefix + "strength_limit", "must be above the cohesion");
    scene.materials.push_back(p);
  }
}

}  // namespace

std::string place_of(const Document& document, const std::string& key) {
  for (const Entry& entry : document.entries)
    if (entry.key == key) return entry.place;
  const std::string path = key.substr(0, key.rfind('.'));
  for (const Section& section : document.sections)
    if (section.path == path) return section.place;
  return document.file;
}

void fail(const Document& document, const std::string& key, const std::string& problem) {
  throw UsageError(fmt::format("{}: {}: {}", place_of(document, key), key, problem));
}

Scene resolve(Draft& draft, const Document& document, const mpi::Comm* comm) {
  resolve_name(draft, document);
  Scene scene = draft.scene;
  scene.file = document.file;
  scene.time.end = required(document, "scene.end", draft.end, "end = \"1e5 s\" in [scene]");
  scene.cell = required(document, "grid.cell", draft.cell, "cell = \"2.5 km\" in [grid]");
  if (!draft.softening) draft.softening = 0.05 * scene.cell;
  scene.gravity.softening = *draft.softening;
  if (!draft.diagnostics) draft.diagnostics = scene.time.end / 200.0;
  scene.output.diagnostics_interval = *draft.diagnostics;
  if (scene.gravity.split != 0.0 && scene.gravity.split < 0.6)
    fail(document, "gravity.split",
         "the mesh resolves no split below 0.6 cells; leave it out to let gravity.error decide");

  resolve_materials(draft, scene, document);
  resolve_bodies(draft, scene, document, comm);
  resolve_impact(draft, scene, document);
  resolve_boundaries(draft, scene, document);
  check_overlap(scene, document, comm);
  check_inside_boundaries(scene, document);
  check_speeds(scene, document);
  return scene;
}

}  // namespace breccia::scene

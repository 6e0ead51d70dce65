#include "scene/parse.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <set>
#include <sstream>

#include "breccia/error.hpp"
#include "scene/document.hpp"
#include "scene/from_root.hpp"
#include "scene/instances.hpp"
#include "scene/resolve.hpp"
#include "scene/slots.hpp"
#include "scene/suggest.hpp"

namespace breccia::scene {

namespace {

std::string read_text(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored))
    throw IoError(fmt::format("{}: is a folder; give a scene file, for example scene.toml", path.string()));
  std::ifstream file(path, std::ios::binary);
  if (!file) throw IoError(fmt::format("{}: cannot be read: {}", path.string(), std::strerror(errno)));
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

// Names of [materials.NAME] in the order of the file; --set may name the one material of a scene that has none.
void find_materials(Draft& draft, const Document& document) {
  constexpr std::string_view kPrefix = "materials.";
  const auto add = [&](const std::string& path, const std::string& place) {
    if (!path.starts_with(kPrefix)) return;
    const std::string name = path.substr(kPrefix.size(), path.find('.', kPrefix.size()) - kPrefix.size());
    const auto same = [&](const MaterialDraft& material) { return material.parameters.name == name; };
    if (std::any_of(draft.materials.begin(), draft.materials.end(), same)) return;
    const bool fine = !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
      return std::isalnum(c) != 0 || c == '-' || c == '_';
    });
    if (!fine) throw UsageError(fmt::format("{}: a material name is made of letters, digits, \"-\" and \"_\"", place));
    draft.materials.emplace_back().parameters.name = name;
  };
  for (const Section& section : document.sections) add(section.path, section.place);
  if (draft.materials.empty())
    for (const Entry& entry : document.entries) add(entry.key, entry.place);
}

[[noreturn]] void unknown_key(const Draft& draft, const Entry& entry) {
  for (const char* list : {"body", "boundary"}) {
    if (entry.key.starts_with(fmt::format("{}.", list)))
      throw UsageError(fmt::format("{}: \"{}\" is a list; write [[{}]] in the file and {}[0] with --set", entry.place,
                                   list, list, list));
  }
  const std::string pattern = pattern_of(entry.key);
  const bool known =
      std::any_of(key_table().begin(), key_table().end(), [&](const Key& key) { return key.pattern == pattern; });
  if (known && pattern != entry.key) {
    const std::string owner = entry.key.substr(0, entry.key.rfind('.'));
    throw UsageError(fmt::format("{}: {}: the scene has no {}", entry.place, entry.key, owner));
  }
  std::vector<std::string> names;
  for (const KeyInstance& instance : all_instances(draft)) names.push_back(instance.name);
  throw UsageError(fmt::format("{}: unknown key \"{}\"{}", entry.place, entry.key, did_you_mean(entry.key, names)));
}

void assign_entry(Draft& draft, const Entry& entry) {
  const auto instance = find_instance(draft, entry.key);
  if (!instance) unknown_key(draft, entry);
  try {
    assign(*instance->key, instance->key->slot(draft, instance->index), entry.value);
  } catch (const UsageError& error) {
    throw UsageError(fmt::format("{}: {}: {}", entry.place, entry.key, error.what()));
  }
}

// Sections with known keys have been looked at; what is left are empty ones.
void check_sections(const Draft& draft, const Document& document) {
  std::vector<std::string> names{"materials", "impact"};
  for (const KeyInstance& instance : all_instances(draft)) {
    std::string section = instance.name.substr(0, instance.name.rfind('.'));
    if (names.back() != section) names.push_back(std::move(section));
  }
  for (const Section& section : document.sections) {
    if (std::find(names.begin(), names.end(), section.path) == names.end())
      throw UsageError(
          fmt::format("{}: unknown section \"{}\"{}", section.place, section.path, did_you_mean(section.path, names)));
  }
}

Draft read_draft(const Document& document) {
  Draft draft;
  draft.bodies.resize(document.count("body"));
  draft.boundaries.resize(document.count("boundary"));
  find_materials(draft, document);
  const bool sets_impact = std::any_of(document.entries.begin(), document.entries.end(),
                                       [](const Entry& entry) { return entry.key.starts_with("impact."); });
  if (sets_impact || document.has_section("impact")) draft.impact.emplace();
  for (const Entry& entry : document.entries) assign_entry(draft, entry);
  check_sections(draft, document);
  return draft;
}

std::vector<ResolvedKey> resolved_keys(Draft& draft, const Document& document) {
  std::set<std::string> given;
  for (const Entry& entry : document.entries) given.insert(entry.key);
  std::vector<ResolvedKey> keys;
  for (const KeyInstance& instance : all_instances(draft)) {
    const auto text = print(*instance.key, instance.key->slot(draft, instance.index));
    if (text) keys.push_back({instance.name, *text, given.contains(instance.name)});
  }
  return keys;
}

LoadedScene load(const std::filesystem::path& path, std::span<const std::string> overrides, const mpi::Comm* comm) {
  const std::string text = from_root(comm, [&] { return read_text(path); });
  const Document document = parse_document(text, path.string(), overrides);
  Draft draft = read_draft(document);
  LoadedScene loaded;
  loaded.scene = resolve(draft, document, comm);
  loaded.keys = resolved_keys(draft, document);
  return loaded;
}

}  // namespace

LoadedScene load_scene(const std::filesystem::path& path, std::span<const std::string> overrides) {
  return load(path, overrides, nullptr);
}

LoadedScene load_scene(const std::filesystem::path& path, std::span<const std::string> overrides,
                       const mpi::Comm& comm) {
  return load(path, overrides, &comm);
}

}  // namespace breccia::scene

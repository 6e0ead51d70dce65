#include "scene/instances.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace breccia::scene {

namespace {

constexpr std::string_view kMaterials = "materials.";

// "body[].", "materials.NAME.", "gravity.": keys of one section instance share it.
std::string_view section_of(std::string_view pattern) { return pattern.substr(0, pattern.rfind('.') + 1); }

// Names of the instances of a section in this draft: "body[0].", "body[1]."
std::vector<std::string> prefixes(const Draft& draft, std::string_view section) {
  std::vector<std::string> names;
  if (section == "body[].")
    for (std::size_t i = 0; i < draft.bodies.size(); ++i) names.push_back(fmt::format("body[{}].", i));
  else if (section == "boundary[].")
    for (std::size_t i = 0; i < draft.boundaries.size(); ++i) names.push_back(fmt::format("boundary[{}].", i));
  else if (section.starts_with(kMaterials))
    for (const MaterialDraft& material : draft.materials)
      names.push_back(fmt::format("materials.{}.", material.parameters.name));
  else if (section != "impact." || draft.impact)
    names.emplace_back(section);
  return names;
}

}  // namespace

std::string pattern_of(const std::string& name) {
  if (name.starts_with(kMaterials)) {
    const std::size_t end = name.find('.', kMaterials.size());
    return end == std::string::npos ? name : fmt::format("{}NAME{}", kMaterials, name.substr(end));
  }
  const std::size_t open = name.find('[');
  const std::size_t close = name.find(']');
  if (open == std::string::npos || close == std::string::npos || close < open) return name;
  return name.substr(0, open + 1) + name.substr(close);
}

std::optional<KeyInstance> find_instance(const Draft& draft, const std::string& name) {
  const std::string pattern = pattern_of(name);
  for (const Key& key : key_table()) {
    if (key.pattern != pattern) continue;
    const std::string_view section = section_of(key.pattern);
    const auto names = prefixes(draft, section);
    const auto found = std::find(names.begin(), names.end(), section_of(name));
    if (found == names.end()) return std::nullopt;
    return KeyInstance{&key, static_cast<std::size_t>(found - names.begin()), name};
  }
  return std::nullopt;
}

std::vector<KeyInstance> all_instances(const Draft& draft) {
  std::vector<KeyInstance> all;
  const auto table = key_table();
  for (auto first = table.begin(); first != table.end();) {
    const std::string_view section = section_of(first->pattern);
    const auto last =
        std::find_if(first, table.end(), [&](const Key& key) { return section_of(key.pattern) != section; });
    const auto names = prefixes(draft, section);
    for (std::size_t i = 0; i < names.size(); ++i)
      for (auto key = first; key != last; ++key)
        all.push_back({&*key, i, names[i] + std::string(key->pattern.substr(section.size()))});
    first = last;
  }
  return all;
}

}  // namespace breccia::scene

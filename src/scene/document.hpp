// The TOML text of a scene and the --set overrides as one flat list of entries.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "scene/value.hpp"

namespace breccia::scene {

/// Entries and sections in the order of the file; a --set replaces the entry of the file or is appended.
struct Document {
  std::string file;
  std::vector<Entry> entries;
  std::vector<Section> sections;

  /// How many tables [[name]] there are.
  [[nodiscard]] std::size_t count(std::string_view name) const;
  [[nodiscard]] bool has_section(std::string_view path) const;
};

/// Parses `text`; `file` is the name errors use. Throws UsageError with file and line.
Document parse_document(std::string_view text, const std::string& file, std::span<const std::string> overrides);

}  // namespace breccia::scene

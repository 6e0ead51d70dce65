#include "scene/document.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>

#include "breccia/error.hpp"

namespace breccia::scene {

namespace {

std::string join(const std::string& parent, std::string_view key) {
  return parent.empty() ? std::string(key) : fmt::format("{}.{}", parent, key);
}

Value scalar_or_list(const toml::node& node, const std::string& place) {
  if (const auto* text = node.as_string()) return {text->get()};
  if (const auto* real = node.as_floating_point()) return {real->get()};
  if (const auto* integer = node.as_integer()) return {integer->get()};
  if (const auto* flag = node.as_boolean()) return {flag->get()};
  if (const auto* array = node.as_array()) {
    std::vector<Value> items;
    for (const toml::node& item : *array) items.push_back(scalar_or_list(item, place));
    return {std::move(items)};
  }
  throw UsageError(fmt::format("{}: dates and tables are not values here; write text, a number, true or false", place));
}

// Turns the tree of tables into entries with full keys, remembering the line of each.
class Flattener {
 public:
  explicit Flattener(Document& document) : document_(document) {}

  void table(const toml::table& table, const std::string& path) {
    for (const auto& [key, node] : table) child(node, join(path, key.str()), key.source().begin.line);
  }

  /// Source order, which the sorted tables of the parser have lost.
  void restore_order() {
    std::stable_sort(entries_.begin(), entries_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    for (auto& [line, entry] : entries_) document_.entries.push_back(std::move(entry));
    std::stable_sort(sections_.begin(), sections_.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (auto& [line, section] : sections_) document_.sections.push_back(std::move(section));
  }

 private:
  using Line = toml::source_index;

  std::string place(Line line) const { return fmt::format("{}:{}", document_.file, line); }

  void section(const toml::table& content, const std::string& path, Line line) {
    sections_.emplace_back(line, Section{path, place(line)});
    table(content, path);
  }

  void child(const toml::node& node, const std::string& path, Line line) {
    if (const auto* content = node.as_table()) {
      section(*content, path, line);
      return;
    }
    const auto* array = node.as_array();
    if (array != nullptr && array->is_array_of_tables()) {
      for (std::size_t i = 0; i < array->size(); ++i) {
        const toml::node& item = (*array)[i];
        section(*item.as_table(), fmt::format("{}[{}]", path, i), item.source().begin.line);
      }
      return;
    }
    entries_.emplace_back(line, Entry{path, scalar_or_list(node, place(line)), place(line)});
  }

  Document& document_;
  std::vector<std::pair<Line, Entry>> entries_;
  std::vector<std::pair<Line, Section>> sections_;
};

// "[0, 0, 1 km]" without quotes around its items.
std::vector<Value> split_list(std::string_view text) {
  std::vector<Value> items;
  text = text.substr(1, text.size() - 2);
  while (true) {
    const std::size_t comma = text.find(',');
    std::string_view item = text.substr(0, comma);
    while (item.starts_with(' ')) item.remove_prefix(1);
    while (item.ends_with(' ')) item.remove_suffix(1);
    items.push_back({std::string(item)});
    if (comma == std::string_view::npos) return items;
    text.remove_prefix(comma + 1);
  }
}

// A value of the command line: TOML where it is TOML (numbers, true, quoted text), otherwise bare text or a bare list.
Value override_value(const std::string& text) {
  try {
    const toml::table parsed = toml::parse("value = " + text);
    const toml::node& node = *parsed.get("value");
    if (parsed.size() == 1 && !node.is_table() && !node.is_date() && !node.is_time() && !node.is_date_time())
      return scalar_or_list(node, "--set");
  } catch (const toml::parse_error&) {
    // Not TOML: bare text.
  }
  if (text.starts_with('[') && text.ends_with(']')) return {split_list(text)};
  return {text};
}

void apply_override(Document& document, const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0)
    throw UsageError(fmt::format("--set {}: write key=value, for example --set grid.cell=\"2.5 km\"", text));
  std::string key = text.substr(0, equals);
  key.erase(std::remove(key.begin(), key.end(), ' '), key.end());
  Entry entry{key, override_value(text.substr(equals + 1)), "--set"};
  const auto same = std::find_if(document.entries.begin(), document.entries.end(),
                                 [&](const Entry& other) { return other.key == key; });
  if (same == document.entries.end()) {
    document.entries.push_back(std::move(entry));
  } else {
    *same = std::move(entry);
  }
}

}  // namespace

std::size_t Document::count(std::string_view name) const {
  std::size_t n = 0;
  while (has_section(fmt::format("{}[{}]", name, n))) ++n;
  return n;
}

bool Document::has_section(std::string_view path) const {
  return std::any_of(sections.begin(), sections.end(), [&](const Section& section) { return section.path == path; });
}

Document parse_document(std::string_view text, const std::string& file, std::span<const std::string> overrides) {
  Document document{file, {}, {}};
  try {
    Flattener flattener(document);
    flattener.table(toml::parse(text), "");
    flattener.restore_order();
  } catch (const toml::parse_error& error) {
    throw UsageError(fmt::format("{}:{}: not valid TOML: {}", file, error.source().begin.line, error.description()));
  }
  for (const std::string& one : overrides) apply_override(document, one);
  return document;
}

}  // namespace breccia::scene

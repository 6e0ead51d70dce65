// What a scene file or --set gives for one key, and where.
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

namespace breccia::scene {

struct Value {
  std::variant<std::string, double, std::int64_t, bool, std::vector<Value>> data;
};

/// One key with its value. `place` is "scene.toml:14" or "--set".
struct Entry {
  std::string key;  ///< "grid.cell", "body[0].radius", "materials.basalt.density"
  Value value;
  std::string place;
};

/// A table of the file, present even if it is empty.
struct Section {
  std::string path;  ///< "impact", "body[0]", "materials.basalt"
  std::string place;
};

}  // namespace breccia::scene

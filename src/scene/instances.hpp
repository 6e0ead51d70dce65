// Keys of lists and of named tables: patterns with an index or a name filled in, and back.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "scene/keys.hpp"

namespace breccia::scene {

/// One key of a draft, with its index in the list it belongs to (0 where there is no list).
struct KeyInstance {
  const Key* key;
  std::size_t index;
  std::string name;  ///< "body[0].radius"
};

/// "body[0].radius" -> "body[].radius", "materials.rock.density" -> "materials.NAME.density".
std::string pattern_of(const std::string& name);

/// The key of this name; none if the table has no such pattern or the draft no such instance.
std::optional<KeyInstance> find_instance(const Draft& draft, const std::string& name);

/// All keys of a draft, in the order of the table; for lists and materials, instance by instance.
std::vector<KeyInstance> all_instances(const Draft& draft);

}  // namespace breccia::scene

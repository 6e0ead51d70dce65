// Values into slots and slots into text: the two uses of the descriptor table.
#pragma once

#include <optional>
#include <string>

#include "scene/keys.hpp"
#include "scene/value.hpp"

namespace breccia::scene {

/// Checks type, unit and range of `value` and stores it. Throws UsageError without place or key.
void assign(const Key& key, const Slot& slot, const Value& value);

/// The stored value with its unit; none where an optional is empty or a text or list has nothing in it.
std::optional<std::string> print(const Key& key, const Slot& slot);

/// What a key wants, for the reference: "length", "3 velocities", "text", "direct, auto".
std::string type_text(const Key& key, const Slot& slot);
/// "> 0", "0 to 1"; empty if anything goes.
std::string range_text(const Key& key);

}  // namespace breccia::scene

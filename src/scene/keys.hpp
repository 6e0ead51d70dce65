// The descriptor table of all scene keys: parsing, defaults, ranges, errors, `check` and the reference follow from it.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "scene/draft.hpp"
#include "scene/units.hpp"

namespace breccia::scene {

/// One of a few words; index into Key::choices.
struct ChoiceSlot {
  std::function<std::optional<std::size_t>()> get;
  std::function<void(std::size_t)> set;
};
/// An output interval: "every 1000 s", "1000 s".
struct IntervalSlot {
  std::optional<double> seconds;
  std::function<void(double)> set;
};

/// Where a key lives in a Draft; the alternative is its type.
using Slot = std::variant<double*, std::optional<double>*, Vec3d*, std::optional<Vec3d>*, std::string*, bool*, int*,
                          std::uint64_t*, std::optional<std::uint64_t>*, std::vector<double>*,
                          std::vector<std::string>*, ChoiceSlot, IntervalSlot>;

/// Values a number may take, in SI.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false;
  bool high_open = false;
};

struct Key {
  std::string_view pattern;  ///< "grid.cell", "body[].radius", "materials.NAME.density"
  Dimension dimension;
  Range range;
  std::vector<std::string_view> choices;  ///< in the order of the enumeration
  std::string_view word;                  ///< accepted in place of a quantity: "auto"
  std::string_view fallback;              ///< the default in words where it follows from other keys
  std::string_view help;                  ///< one line
  Slot (*slot)(Draft& draft, std::size_t index);
};

/// All keys, in the order of the reference.
std::span<const Key> key_table();

/// The keys of each part of the table.
std::vector<Key> run_keys();       ///< scene, grid, time
std::vector<Key> material_keys();  ///< materials.NAME
std::vector<Key> body_keys();      ///< body[], impact, boundary[]
std::vector<Key> method_keys();    ///< effects, gravity, numerics, parallel, output

inline constexpr Range kAny{};
inline constexpr Range kPositive{0.0, std::numeric_limits<double>::infinity(), true, false};
inline constexpr Range kNonNegative{0.0};
inline constexpr Range kFraction{0.0, 1.0};

/// A slot for an enumeration (or an optional of one) whose values count 0, 1, ... as the choices do.
template <class E>
Slot choice(E& target) {
  return ChoiceSlot{[&target] { return std::optional(static_cast<std::size_t>(target)); },
                    [&target](std::size_t i) { target = static_cast<E>(i); }};
}
template <class E>
Slot choice(std::optional<E>& target) {
  return ChoiceSlot{[&target] { return target ? std::optional(static_cast<std::size_t>(*target)) : std::nullopt; },
                    [&target](std::size_t i) { target = static_cast<E>(i); }};
}

}  // namespace breccia::scene

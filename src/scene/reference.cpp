#include <fmt/format.h>

#include <map>

#include "scene/parse.hpp"
#include "scene/slots.hpp"

namespace breccia::scene {

namespace {

// What a section is for, under its heading.
const std::map<std::string_view, std::string_view> kSections{
    {"scene", "[scene]"},
    {"grid", "[grid]"},
    {"time", "[time]"},
    {"materials.NAME", "[materials.NAME]"},
    {"body[]", "[[body]]"},
    {"impact", "[impact]"},
    {"boundary[]", "[[boundary]]"},
    {"effects", "[effects]"},
    {"gravity", "[gravity]"},
    {"numerics", "[numerics]"},
    {"parallel", "[parallel]"},
    {"output", "[output]"},
};
const std::map<std::string_view, std::string_view> kNotes{
    {"materials.NAME", "Without any material section the scene has one material, basalt with the defaults below."},
    {"body[]", "One table per body. Give `particles` or `spacing`; with neither the spacing is the grid cell."},
    {"impact",
     "Places exactly two bodies on the two-body orbit that meets these numbers at contact (sum of the radii of equal "
     "volume), centre of mass at rest in the origin, line of centres at contact along x, motion in the xy plane. With "
     "gravity off they move on straight lines."},
    {"boundary[]", "One table per plane. The matter is on the side its normal points to."},
    {"effects", "`auto` decides from the scene; `breccia check` prints the decision and its reason."},
};

constexpr std::string_view kIntroduction = R"(# Scene reference

Generated from the table of keys that also drives parsing, `breccia check` and error messages.

A scene is a TOML file. Quantities are text with a unit: `"50 km"`, `"200 m/s"`, `"1.1e-4 rad/s"`, `"15 deg"`,
`"2.7 g/cm3"`, `"4e35 1/m3"`. Units multiply with a blank or `*`, divide with `/` (the next factor only) and take
integer powers (`m/s2`, `m s^-2`); SI prefixes from `n` to `T` are understood. Zero needs no unit. Known units: m, au,
g, t, s, min, h, d, yr, rad, deg, rev, Hz, N, dyn, Pa, bar, J, erg, W. Vectors are lists of three.

Every key can be set on the command line: `--set gravity.softening="125 m"`, `--set effects.gravity=off`,
`--set 'body[0].radius=10 km'`. Unknown keys are errors.
)";

// A draft with one of everything, to read defaults from.
Draft sample_draft() {
  Draft draft;
  draft.materials.resize(1);
  draft.bodies.resize(1);
  draft.boundaries.resize(1);
  draft.impact.emplace();
  return draft;
}

std::string default_text(const Key& key, const Slot& slot) {
  if (!key.fallback.empty()) return std::string(key.fallback);
  return fmt::format("`{}`", print(key, slot).value_or(""));
}

std::string row(const Key& key, const Slot& slot, std::size_t section_length) {
  const std::string_view name = key.pattern.substr(section_length + 1);
  std::string wanted = type_text(key, slot);
  if (const std::string range = range_text(key); !range.empty()) wanted += ", " + range;
  return fmt::format("| `{}` | {} | {} | {} |\n", name, wanted, default_text(key, slot), key.help);
}

}  // namespace

std::string reference_markdown() {
  std::string text(kIntroduction);
  Draft draft = sample_draft();
  std::string_view section;
  for (const Key& key : key_table()) {
    const std::string_view owner = key.pattern.substr(0, key.pattern.rfind('.'));
    if (owner != section) {
      section = owner;
      text += fmt::format("\n## {}\n", kSections.at(section));
      if (const auto note = kNotes.find(section); note != kNotes.end()) text += fmt::format("\n{}\n", note->second);
      text += "\n| key | value | default | meaning |\n|---|---|---|---|\n";
    }
    text += row(key, key.slot(draft, 0), section.size());
  }
  return text;
}

}  // namespace breccia::scene

#include "scene/units.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "breccia/constants.hpp"
#include "breccia/error.hpp"

namespace breccia::scene {

namespace {

// A unit is factor x 10^ten in SI; powers of ten are kept apart to be applied once, correctly rounded.
struct Unit {
  std::string_view symbol;
  double factor;
  int ten;
  Dimension dimension;
  bool takes_prefix;
};

constexpr Dimension kForce{1, 1, -2, 0};
constexpr Dimension kEnergy{2, 1, -2, 0};
constexpr Dimension kPower{2, 1, -3, 0};
constexpr double kDay = 86400.0;
constexpr double kJulianYear = 365.25 * kDay;

constexpr std::array kUnits{
    Unit{"m", 1.0, 0, kLength, true},
    Unit{"au", 1.495978707, 11, kLength, false},
    Unit{"g", 1.0, -3, kMass, true},
    Unit{"t", 1.0, 3, kMass, false},
    Unit{"s", 1.0, 0, kTime, true},
    Unit{"min", 60.0, 0, kTime, false},
    Unit{"h", 3600.0, 0, kTime, false},
    Unit{"d", kDay, 0, kTime, false},
    Unit{"day", kDay, 0, kTime, false},
    Unit{"days", kDay, 0, kTime, false},
    Unit{"yr", kJulianYear, 0, kTime, true},
    Unit{"rad", 1.0, 0, kAngle, true},
    Unit{"deg", kPi / 180.0, 0, kAngle, false},
    Unit{"rev", 2.0 * kPi, 0, kAngle, false},
    Unit{"Hz", 1.0, 0, {0, 0, -1, 0}, true},
    Unit{"N", 1.0, 0, kForce, true},
    Unit{"dyn", 1.0, -5, kForce, false},
    Unit{"Pa", 1.0, 0, kPressure, true},
    Unit{"bar", 1.0, 5, kPressure, true},
    Unit{"J", 1.0, 0, kEnergy, true},
    Unit{"erg", 1.0, -7, kEnergy, false},
    Unit{"W", 1.0, 0, kPower, true},
};

struct Prefix {
  std::string_view symbol;
  int ten;
};
constexpr std::array kPrefixes{Prefix{"n", -9}, Prefix{"u", -6}, Prefix{"µ", -6}, Prefix{"m", -3},
                               Prefix{"c", -2}, Prefix{"d", -1}, Prefix{"h", 2},  Prefix{"k", 3},
                               Prefix{"M", 6},  Prefix{"G", 9},  Prefix{"T", 12}};

struct NamedDimension {
  Dimension dimension;
  std::string_view name;
  std::string_view unit;     ///< printed
  std::string_view example;  ///< what an error proposes
};
constexpr std::array kNames{
    NamedDimension{kPure, "a pure number", "", "0.5"},
    NamedDimension{kLength, "a length", "m", "2.5 km"},
    NamedDimension{kMass, "a mass", "kg", "1e15 kg"},
    NamedDimension{kTime, "a time", "s", "1000 s"},
    NamedDimension{kAngle, "an angle", "deg", "15 deg"},
    NamedDimension{kVelocity, "a velocity", "m/s", "200 m/s"},
    NamedDimension{kAngularVelocity, "an angular velocity", "rad/s", "1e-4 rad/s"},
    NamedDimension{kAcceleration, "an acceleration", "m/s2", "9.81 m/s2"},
    NamedDimension{kDensity, "a density", "kg/m3", "2700 kg/m3"},
    NamedDimension{kPressure, "a pressure", "Pa", "26.7 GPa"},
    NamedDimension{kSpecificEnergy, "a specific energy", "J/kg", "3.4 MJ/kg"},
    NamedDimension{kNumberDensity, "a number density", "1/m3", "4e35 1/m3"},
};

const NamedDimension* find_name(Dimension dimension) {
  for (const NamedDimension& entry : kNames)
    if (entry.dimension == dimension) return &entry;
  return nullptr;
}

// A product of units.
struct Scale {
  double factor = 1.0;
  int ten = 0;
  Dimension dimension;
};

Scale multiply(const Scale& a, const Scale& b) {
  const Dimension& p = a.dimension;
  const Dimension& q = b.dimension;
  return {
      a.factor * b.factor, a.ten + b.ten, {p.length + q.length, p.mass + q.mass, p.time + q.time, p.angle + q.angle}};
}

Scale power(const Scale& a, int n) {
  const Dimension& d = a.dimension;
  return {std::pow(a.factor, n), n * a.ten, {n * d.length, n * d.mass, n * d.time, n * d.angle}};
}

// Powers of ten are exact doubles up to 22, so this rounds once.
double times_ten_to(double x, int ten) { return ten < 0 ? x / std::pow(10.0, -ten) : x * std::pow(10.0, ten); }

// A unit without a prefix wins over a prefixed one: "min" is a minute, "h" an hour, "Pa" a pascal.
std::optional<Scale> find_unit(std::string_view symbol) {
  for (const Unit& unit : kUnits)
    if (unit.symbol == symbol) return Scale{unit.factor, unit.ten, unit.dimension};
  for (const Prefix& prefix : kPrefixes) {
    if (!symbol.starts_with(prefix.symbol)) continue;
    const std::string_view rest = symbol.substr(prefix.symbol.size());
    for (const Unit& unit : kUnits)
      if (unit.takes_prefix && unit.symbol == rest) return Scale{unit.factor, prefix.ten + unit.ten, unit.dimension};
  }
  return std::nullopt;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_symbol_char(char c) {
  // Bytes above ASCII belong to the UTF-8 form of the micro sign.
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || static_cast<unsigned char>(c) >= 0x80;
}

// Recursive descent over a unit expression: product = factor { ("*" | "/" | blank) factor }.
class UnitParser {
 public:
  explicit UnitParser(std::string_view text) : rest_(text) {}

  Scale parse() {
    const Scale result = product();
    if (!rest_.empty()) throw UsageError(fmt::format("unit: cannot read \"{}\"", rest_));
    return result;
  }

 private:
  Scale product() {
    Scale result = factor();
    for (skip_blanks(); !rest_.empty() && rest_.front() != ')'; skip_blanks()) {
      const bool divide = take('/');
      if (!divide) take('*');
      skip_blanks();
      result = multiply(result, power(factor(), divide ? -1 : 1));
    }
    return result;
  }

  Scale factor() {
    skip_blanks();
    Scale base;
    if (take('(')) {
      base = product();
      if (!take(')')) throw UsageError("unit: a \")\" is missing");
    } else if (!take('1')) {
      base = symbol();
    }
    return power(base, exponent());
  }

  Scale symbol() {
    std::size_t n = 0;
    while (n < rest_.size() && is_symbol_char(rest_[n])) ++n;
    if (n == 0) throw UsageError(fmt::format("unit: a symbol such as m, s or kg is expected at \"{}\"", rest_));
    const std::string_view name = rest_.substr(0, n);
    rest_.remove_prefix(n);
    const auto unit = find_unit(name);
    if (!unit) throw UsageError(fmt::format("unknown unit \"{}\"", name));
    return *unit;
  }

  int exponent() {
    const bool caret = take('^');
    const bool negative = rest_.size() > 1 && rest_.front() == '-' && is_digit(rest_[1]);
    int n = 1;
    if (!negative && (rest_.empty() || !is_digit(rest_.front()))) {
      if (caret) throw UsageError("unit: an integer is expected after \"^\"");
      return n;
    }
    const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), n);
    if (error != std::errc{} || n < -9 || n > 9) throw UsageError("unit: a power must be between -9 and 9");
    rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
    return n;
  }

  bool take(char c) {
    if (rest_.empty() || rest_.front() != c) return false;
    rest_.remove_prefix(1);
    return true;
  }
  void skip_blanks() {
    while (take(' ')) {
    }
  }

  std::string_view rest_;
};

std::string_view trim(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

std::string_view example(Dimension dimension) {
  const NamedDimension* entry = find_name(dimension);
  return entry != nullptr ? entry->example : "";
}

}  // namespace

Quantity parse_quantity(std::string_view text) {
  const std::string_view all = trim(text);
  std::string_view rest = all;
  if (rest.starts_with('+')) rest.remove_prefix(1);
  double number = 0.0;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
  if (error == std::errc::invalid_argument) throw UsageError(fmt::format("\"{}\" is not a number with a unit", all));
  if (error != std::errc{} || !std::isfinite(number))
    throw UsageError(fmt::format("\"{}\" is not a finite number", all));

  rest = trim(rest.substr(static_cast<std::size_t>(end - rest.data())));
  if (rest.empty()) return {number, kPure};
  if (rest.starts_with('*')) rest.remove_prefix(1);
  try {
    const Scale unit = UnitParser(trim(rest)).parse();
    const double value = times_ten_to(number * unit.factor, unit.ten);
    if (!std::isfinite(value)) throw UsageError("is not a finite number in SI");
    return {value, unit.dimension};
  } catch (const UsageError& problem) {
    throw UsageError(fmt::format("\"{}\": {}", all, problem.what()));
  }
}

double parse_quantity(std::string_view text, Dimension expected) {
  const Quantity quantity = parse_quantity(text);
  if (quantity.dimension == expected) return quantity.value;
  if (quantity.dimension == kPure) {
    if (quantity.value == 0.0) return 0.0;
    throw UsageError(fmt::format("\"{}\" needs a unit: {}, for example \"{}\"", trim(text), dimension_name(expected),
                                 example(expected)));
  }
  throw UsageError(fmt::format("\"{}\" is {}; what is wanted is {}, for example {}", trim(text),
                               dimension_name(quantity.dimension), dimension_name(expected), example(expected)));
}

std::string dimension_name(Dimension dimension) {
  if (const NamedDimension* entry = find_name(dimension); entry != nullptr) return std::string(entry->name);
  std::string unit;
  const std::array<std::pair<std::string_view, int>, 4> bases{
      {{"kg", dimension.mass}, {"m", dimension.length}, {"s", dimension.time}, {"rad", dimension.angle}}};
  for (const auto& [symbol, exponent] : bases) {
    if (exponent == 0) continue;
    if (!unit.empty()) unit += ' ';
    unit += symbol;
    if (exponent != 1) unit += fmt::format("^{}", exponent);
  }
  return "a quantity in " + unit;
}

std::string_view display_unit(Dimension dimension) {
  const NamedDimension* entry = find_name(dimension);
  return entry != nullptr ? entry->unit : "";
}

std::string format_quantity(double value, Dimension dimension) {
  // Degrees are rounded to hide the last bits of the conversion; all other units are printed exactly.
  if (dimension == kAngle) return fmt::format("{:.13g} deg", value * (180.0 / kPi));
  const std::string_view unit = display_unit(dimension);
  if (unit.empty()) return fmt::format("{}", value);
  if (dimension == kLength || dimension == kPressure || dimension == kSpecificEnergy) {
    for (const auto& [prefix, ten] : {Prefix{"G", 9}, Prefix{"M", 6}, Prefix{"k", 3}}) {
      if (dimension == kLength && ten > 3) continue;
      const double scaled = times_ten_to(value, -ten);
      const bool exact = times_ten_to(scaled, ten) == value;
      if (std::abs(scaled) >= 1.0 && exact) return fmt::format("{} {}{}", scaled, prefix, unit);
    }
  }
  return fmt::format("{} {}", value, unit);
}

}  // namespace breccia::scene

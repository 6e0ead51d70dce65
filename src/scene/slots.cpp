#include "scene/slots.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "breccia/error.hpp"

namespace breccia::scene {

namespace {

constexpr std::string_view kEvery = "every ";

std::string text_of(const Value& value) {
  if (const auto* text = std::get_if<std::string>(&value.data)) return *text;
  if (const auto* real = std::get_if<double>(&value.data)) return fmt::format("{}", *real);
  if (const auto* integer = std::get_if<std::int64_t>(&value.data)) return fmt::format("{}", *integer);
  if (const auto* flag = std::get_if<bool>(&value.data)) return *flag ? "true" : "false";
  throw UsageError("one value is wanted, not a list");
}

void check_range(const Key& key, double x, const std::string& written) {
  const Range& r = key.range;
  const bool inside = (r.low_open ? x > r.low : x >= r.low) && (r.high_open ? x < r.high : x <= r.high);
  if (!inside) throw UsageError(fmt::format("\"{}\" is out of range; it must be {}", written, range_text(key)));
}

double real_of(const Key& key, const Value& value) {
  if (std::holds_alternative<bool>(value.data)) throw UsageError("a number is wanted, not true or false");
  const std::string written = text_of(value);
  const double x = parse_quantity(written, key.dimension);
  check_range(key, x, written);
  return x;
}

// Integers may be written 3004, "3004", 1e6 or "1e6".
std::int64_t integer_of(const Key& key, const Value& value) {
  const double x = real_of(key, value);
  if (const auto* integer = std::get_if<std::int64_t>(&value.data)) return *integer;
  if (x != std::floor(x) || std::abs(x) > 9.0e15)
    throw UsageError(fmt::format("\"{}\" is not a whole number", text_of(value)));
  return static_cast<std::int64_t>(x);
}

std::uint64_t count_of(const Key& key, const Value& value) {
  const std::int64_t n = integer_of(key, value);
  if (n < 0) throw UsageError(fmt::format("{} is negative; it must be a whole number >= 0", n));
  return static_cast<std::uint64_t>(n);
}

Vec3d vector_of(const Key& key, const Value& value) {
  const auto* items = std::get_if<std::vector<Value>>(&value.data);
  if (items == nullptr || items->size() != 3) {
    const std::string zero(key.dimension == kPure ? "0" : "\"0\"");
    const std::string one = key.dimension == kPure ? "1" : fmt::format("\"1 {}\"", display_unit(key.dimension));
    throw UsageError(fmt::format("a list of three is wanted, for example [{}, {}, {}]", zero, zero, one));
  }
  return {real_of(key, (*items)[0]), real_of(key, (*items)[1]), real_of(key, (*items)[2])};
}

// A single value counts as a list of one.
std::vector<Value> list_of(const Value& value) {
  const auto* items = std::get_if<std::vector<Value>>(&value.data);
  return items != nullptr ? *items : std::vector<Value>{value};
}

bool flag_of(const Value& value) {
  const std::string text = text_of(value);
  if (text == "true" || text == "on") return true;
  if (text == "false" || text == "off") return false;
  throw UsageError(fmt::format("\"{}\" is neither true nor false", text));
}

std::size_t choice_of(const Key& key, const Value& value) {
  const std::string text = text_of(value);
  for (std::size_t i = 0; i < key.choices.size(); ++i)
    if (key.choices[i] == text) return i;
  const bool is_switch = key.choices.front() == "false";
  if (is_switch && (text == "off" || text == "on")) return text == "on" ? 1 : 0;
  throw UsageError(fmt::format("\"{}\" is not one of {}", text, fmt::join(key.choices, ", ")));
}

bool is_word(const Key& key, const Value& value) {
  const auto* text = std::get_if<std::string>(&value.data);
  return text != nullptr && !key.word.empty() && *text == key.word;
}

struct Assign {
  const Key& key;
  const Value& value;

  void operator()(double* slot) const { *slot = real_of(key, value); }
  void operator()(std::optional<double>* slot) const {
    slot->reset();
    if (!is_word(key, value)) *slot = real_of(key, value);
  }
  void operator()(Vec3d* slot) const { *slot = vector_of(key, value); }
  void operator()(std::optional<Vec3d>* slot) const { *slot = vector_of(key, value); }
  void operator()(std::string* slot) const {
    *slot = text_of(value);
    if (slot->empty()) throw UsageError("the text is empty");
  }
  void operator()(bool* slot) const { *slot = flag_of(value); }
  void operator()(int* slot) const { *slot = static_cast<int>(integer_of(key, value)); }
  void operator()(std::uint64_t* slot) const { *slot = count_of(key, value); }
  void operator()(std::optional<std::uint64_t>* slot) const { *slot = count_of(key, value); }
  void operator()(std::vector<double>* slot) const {
    slot->clear();
    for (const Value& item : list_of(value)) slot->push_back(real_of(key, item));
  }
  void operator()(std::vector<std::string>* slot) const {
    slot->clear();
    for (const Value& item : list_of(value)) slot->push_back(text_of(item));
  }
  void operator()(const ChoiceSlot& slot) const { slot.set(choice_of(key, value)); }
  void operator()(const IntervalSlot& slot) const {
    if (is_word(key, value)) {
      slot.set(0.0);
      return;
    }
    std::string text = text_of(value);
    if (text.starts_with(kEvery)) text.erase(0, kEvery.size());
    slot.set(real_of(key, {text}));
  }
};

using Text = std::optional<std::string>;

struct Print {
  const Key& key;

  [[nodiscard]] std::string quantity(double x) const { return format_quantity(x, key.dimension); }
  [[nodiscard]] std::string vector(const Vec3d& v) const {
    return fmt::format("[{}, {}, {}]", quantity(v.x), quantity(v.y), quantity(v.z));
  }
  Text operator()(const double* slot) const { return quantity(*slot); }
  Text operator()(const std::optional<double>* slot) const {
    if (!*slot) return key.word.empty() ? Text() : Text(key.word);
    return quantity(**slot);
  }
  Text operator()(const Vec3d* slot) const { return vector(*slot); }
  Text operator()(const std::optional<Vec3d>* slot) const { return *slot ? Text(vector(**slot)) : Text(); }
  Text operator()(const std::string* slot) const { return slot->empty() ? Text() : Text(*slot); }
  Text operator()(const bool* slot) const { return *slot ? "true" : "false"; }
  Text operator()(const int* slot) const { return fmt::format("{}", *slot); }
  Text operator()(const std::uint64_t* slot) const { return fmt::format("{}", *slot); }
  Text operator()(const std::optional<std::uint64_t>* slot) const {
    return *slot ? Text(fmt::format("{}", **slot)) : Text();
  }
  Text operator()(const std::vector<double>* slot) const {
    if (slot->empty()) return {};
    std::vector<std::string> items;
    for (const double x : *slot) items.push_back(quantity(x));
    return fmt::format("[{}]", fmt::join(items, ", "));
  }
  Text operator()(const std::vector<std::string>* slot) const {
    return slot->empty() ? Text() : Text(fmt::format("[{}]", fmt::join(*slot, ", ")));
  }
  Text operator()(const ChoiceSlot& slot) const {
    const auto index = slot.get();
    return index ? Text(key.choices[*index]) : Text();
  }
  Text operator()(const IntervalSlot& slot) const {
    if (!slot.seconds) return key.word.empty() ? Text() : Text(key.word);
    return fmt::format("{}{}", kEvery, quantity(*slot.seconds));
  }
};

struct TypeText {
  const Key& key;

  [[nodiscard]] std::string measured() const {
    std::string name = dimension_name(key.dimension);
    name.erase(0, name.find(' ') + 1);  // without the article
    return key.dimension == kPure ? "number" : name;
  }
  std::string operator()(const double*) const { return measured(); }
  std::string operator()(const std::optional<double>*) const {
    return key.word.empty() ? measured() : fmt::format("{} or {}", measured(), key.word);
  }
  std::string operator()(const Vec3d*) const { return fmt::format("3 x {}", measured()); }
  std::string operator()(const std::optional<Vec3d>*) const { return fmt::format("3 x {}", measured()); }
  std::string operator()(const std::string*) const { return "text"; }
  std::string operator()(const bool*) const { return "true or false"; }
  std::string operator()(const int*) const { return "whole number"; }
  std::string operator()(const std::uint64_t*) const { return "whole number"; }
  std::string operator()(const std::optional<std::uint64_t>*) const { return "whole number"; }
  std::string operator()(const std::vector<double>*) const { return fmt::format("list of {}", measured()); }
  std::string operator()(const std::vector<std::string>*) const { return "list of text"; }
  std::string operator()(const ChoiceSlot&) const { return fmt::format("{}", fmt::join(key.choices, ", ")); }
  std::string operator()(const IntervalSlot&) const {
    return key.word.empty() ? "every TIME" : fmt::format("every TIME or {}", key.word);
  }
};

}  // namespace

void assign(const Key& key, const Slot& slot, const Value& value) { std::visit(Assign{key, value}, slot); }

std::optional<std::string> print(const Key& key, const Slot& slot) { return std::visit(Print{key}, slot); }

std::string type_text(const Key& key, const Slot& slot) { return std::visit(TypeText{key}, slot); }

std::string range_text(const Key& key) {
  const Range& r = key.range;
  const auto number = [&](double x) { return x == 0.0 ? std::string("0") : format_quantity(x, key.dimension); };
  if (std::isfinite(r.high)) {
    const std::string_view open = r.low_open ? " (exclusive)" : "";
    return fmt::format("{}{} to {}{}", number(r.low), open, number(r.high), r.high_open ? " (exclusive)" : "");
  }
  if (std::isfinite(r.low)) return fmt::format("{} {}", r.low_open ? ">" : ">=", number(r.low));
  return "";
}

}  // namespace breccia::scene

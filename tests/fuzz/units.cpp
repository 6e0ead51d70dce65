// Quantities: any text is read to a finite number or refused; what is printed of it is read back as the same.
#include "scene/units.hpp"

#include <cmath>

#include "tests/fuzz/target.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace breccia;
  const std::string_view text = fuzz::text_of(data, size);
  fuzz::expect_user_errors([&] {
    const scene::Quantity quantity = scene::parse_quantity(text);
    if (!std::isfinite(quantity.value)) std::abort();
    for (const scene::Dimension known : {scene::kPure, scene::kLength, scene::kVelocity, scene::kPressure}) {
      if (!(quantity.dimension == known)) continue;
      const double again = scene::parse_quantity(scene::format_quantity(quantity.value, known), known);
      // Six digits and more are printed.
      if (std::abs(again - quantity.value) > 1e-5 * std::abs(quantity.value)) std::abort();
    }
  });
  return 0;
}

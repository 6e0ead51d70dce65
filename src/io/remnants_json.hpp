// Remnants as summary.json and `analyze --json` list them.
#pragma once

#include <nlohmann/json.hpp>
#include <span>

#include "analysis/remnants.hpp"

namespace breccia::io {

/// One object per remnant in the order given (find_remnants: largest first), SI. What a remnant does not have (the spin
/// period without spin, the bound mass of all but the largest) is null.
nlohmann::json remnants_json(std::span<const analysis::Remnant> remnants);

}  // namespace breccia::io

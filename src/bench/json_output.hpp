// Results of a measurement for other programs.
#pragma once

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "breccia/error.hpp"

namespace breccia::bench {

/// To `file`, to standard output for "-", nowhere if it is empty. Throws IoError.
inline void write_json(const nlohmann::ordered_json& results, const std::string& file) {
  if (file == "-") {
    fmt::print("{}\n", results.dump(2));
  } else if (!file.empty()) {
    std::ofstream out(file);
    out << results.dump(2) << '\n';
    if (!out) throw IoError(file + ": cannot be written");
  }
}

}  // namespace breccia::bench

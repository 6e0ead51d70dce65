// Machine-readable results: --json FILE, where `-` is standard output.
#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <string>

#include "breccia/linalg.hpp"
#include "mpi/comm.hpp"

namespace breccia::cli {

/// Keys in the order they were added, as a person would read them.
using Json = nlohmann::ordered_json;

void add_json_option(CLI::App& command, std::string& file);

/// True if standard output is to hold JSON and nothing else.
inline bool is_standard_output(const std::string& file) { return file == "-"; }

/// Writes `value` from the root to `file`; does nothing if that is empty. Collective; throws IoError on all ranks.
void write_json(const Json& value, const std::string& file, const mpi::Comm& comm);

inline Json to_json(Vec3d v) { return Json::array({v.x, v.y, v.z}); }

}  // namespace breccia::cli

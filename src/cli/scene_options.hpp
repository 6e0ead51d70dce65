// The scene file and its --set overrides, shared by `run` and `check`.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "mpi/comm.hpp"
#include "scene/parse.hpp"

namespace breccia::cli {

struct SceneOptions {
  std::string file;
  std::vector<std::string> overrides;  ///< "key=value"
};

void add_scene_options(CLI::App& command, SceneOptions& options);

/// The resolved scene. Collective; throws UsageError if there is no such file or the scene is wrong, IoError if the
/// file cannot be read.
scene::LoadedScene load(const SceneOptions& options, const mpi::Comm& comm);

}  // namespace breccia::cli

// A scene file to a resolved Scene.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "breccia/scene.hpp"
#include "mpi/comm.hpp"

namespace breccia::scene {

/// A scene and every key that made it, in the order of the reference.
struct LoadedScene {
  Scene scene;
  std::vector<ResolvedKey> keys;
};

/// Reads and resolves a scene. `overrides` are "key=value" with the value bare ("gravity.softening=125 m").
/// Throws IoError if a file cannot be read and UsageError, with file, line and key, if the scene is wrong.
LoadedScene load_scene(const std::filesystem::path& path, std::span<const std::string> overrides);

/// The same on all ranks of `comm`: rank 0 reads the files, all ranks resolve the same bytes and throw the same error.
/// Collective.
LoadedScene load_scene(const std::filesystem::path& path, std::span<const std::string> overrides,
                       const mpi::Comm& comm);

/// The reference of all scene keys (docs/scene-reference.md), generated from the descriptor table.
std::string reference_markdown();

}  // namespace breccia::scene

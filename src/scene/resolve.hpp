// From what was written to what it means: defaults that follow from other keys, masses, places.
#pragma once

#include "mpi/comm.hpp"
#include "scene/document.hpp"
#include "scene/draft.hpp"

namespace breccia::scene {

/// Fills every empty optional of `draft` that applies and returns the scene, [impact] done and consistency checked.
/// Throws UsageError with place and key. Collective if there is a communicator (particle files).
Scene resolve(Draft& draft, const Document& document, const mpi::Comm* comm);

/// Where a key stands: "scene.toml:14", "--set", or the place of its section, or the file.
std::string place_of(const Document& document, const std::string& key);

/// An error about a key, with its place.
[[noreturn]] void fail(const Document& document, const std::string& key, const std::string& problem);

}  // namespace breccia::scene

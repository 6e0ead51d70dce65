// Which keys of a scene a run may not change while it goes on.
#pragma once

#include <string>
#include <vector>

#include "breccia/scene.hpp"

namespace breccia::sim {

/// Throws UsageError naming every key whose change a restart cannot take: all but those of output, of the end, of the
/// time step's safety and of the accuracy of gravity. `file` holds the keys `before`.
void require_same_scene(const std::vector<ResolvedKey>& before, const std::vector<ResolvedKey>& scene,
                        const std::string& file);

/// The keys that may not change, as JSON: {"grid.cell": "10 km", ...}. Empty if there are none.
[[nodiscard]] std::string lasting_keys(const std::vector<ResolvedKey>& scene);

/// Keys from such an object; none if it is not one.
[[nodiscard]] std::vector<ResolvedKey> keys_from(const std::string& json);

}  // namespace breccia::sim

#include "cli/scene_options.hpp"

#include <filesystem>

#include "breccia/error.hpp"
#include "io/collectively.hpp"

namespace breccia::cli {

void add_scene_options(CLI::App& command, SceneOptions& options) {
  command.add_option("scene", options.file, "The scene file")->required()->type_name("SCENE.toml");
  command
      .add_option("--set", options.overrides,
                  "Another value for one key of the scene, e.g. --set gravity.softening=\"125 m\"; may be repeated")
      ->type_name("key=value")
      ->allow_extra_args(false);
}

scene::LoadedScene load(const SceneOptions& options, const mpi::Comm& comm) {
  io::on_root(comm, [&] {
    if (!std::filesystem::exists(options.file)) {
      throw UsageError(options.file + ": there is no such scene file; give the path of a .toml file");
    }
  });
  return scene::load_scene(options.file, options.overrides, comm);
}

}  // namespace breccia::cli

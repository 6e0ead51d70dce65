// Scene files written by a test, in a folder that goes with it.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "breccia/error.hpp"
#include "scene/parse.hpp"

namespace breccia::scene::test {

/// A folder for the files of one test; one per process, so ranks do not meet.
class Folder {
 public:
  Folder() : path_(std::filesystem::temp_directory_path() / ("breccia_scene_test_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(path_);
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::ofstream(path_ / name) << text;
    return path_ / name;
  }
  [[nodiscard]] std::filesystem::path path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline LoadedScene load_text(const std::string& text, const std::vector<std::string>& overrides = {}) {
  const Folder folder;
  return load_scene(folder.write("scene.toml", text), overrides);
}

/// The message of the UsageError that loading `text` throws, from the file name on; empty if there is none.
inline std::string usage_error(const std::string& text, const std::vector<std::string>& overrides = {}) {
  try {
    load_text(text, overrides);
  } catch (const UsageError& error) {
    const std::string message = error.what();
    const std::size_t at = message.find("scene.toml");
    return at == std::string::npos ? message : message.substr(at);
  }
  return "";
}

/// A scene of one sphere, to be extended.
inline const std::string kSphere = R"([scene]
end = "1000 s"
[grid]
cell = "2.5 km"
[[body]]
shape = "sphere"
radius = "50 km"
)";

/// A scene of two equal spheres that meet.
inline const std::string kImpact = R"([scene]
end = "1000 s"
[grid]
cell = "6.25 km"
[[body]]
shape = "sphere"
radius = "50 km"
[[body]]
shape = "sphere"
radius = "50 km"
[impact]
velocity = "200 m/s"
angle = "15 deg"
separation = "200 km"
)";

}  // namespace breccia::scene::test

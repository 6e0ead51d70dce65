// Scene files: any text is resolved or refused with one line. The first line of the input may be a --set.
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "scene/document.hpp"
#include "scene/parse.hpp"
#include "tests/fuzz/target.hpp"

namespace {

// In memory: a scene is a small file.
const std::filesystem::path& scene_path() {
  static const std::string folder = std::filesystem::exists("/dev/shm") ? "/dev/shm" : "/tmp";
  static const std::filesystem::path path = folder + "/breccia_fuzz_" + std::to_string(::getpid()) + ".toml";
  return path;
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace breccia;
  std::string_view text = fuzz::text_of(data, size);
  std::vector<std::string> overrides;
  if (text.starts_with("--set ")) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    overrides.emplace_back(text.substr(6, end - 6));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  std::ofstream(scene_path(), std::ios::binary) << text;
  fuzz::expect_user_errors([&] { scene::load_scene(scene_path(), overrides); });
  return 0;
}

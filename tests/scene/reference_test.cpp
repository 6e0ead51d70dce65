// The committed reference and the ready scenes agree with the table of keys.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "scene/parse.hpp"

namespace breccia::scene {
namespace {

const std::filesystem::path kSource = BRECCIA_SOURCE_DIR;

// With BRECCIA_WRITE_DOCS set in the environment the file is written anew instead.
TEST(Reference, CommittedFileIsCurrent) {
  const auto path = kSource / "docs" / "scene-reference.md";
  if (std::getenv("BRECCIA_WRITE_DOCS") != nullptr) std::ofstream(path) << reference_markdown();
  std::ostringstream committed;
  committed << std::ifstream(path).rdbuf();
  EXPECT_EQ(committed.str(), reference_markdown())
      << "run test_scene_reference with BRECCIA_WRITE_DOCS=1 and commit the file";
}

TEST(Reference, ReadyScenesLoad) {
  int scenes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kSource / "scenes")) {
    if (entry.path().extension() != ".toml") continue;
    ++scenes;
    EXPECT_NO_THROW({
      const LoadedScene loaded = load_scene(entry.path(), {});
      EXPECT_EQ(loaded.scene.name, entry.path().stem().string());
    }) << entry.path();
  }
  EXPECT_GE(scenes, 5);
}

TEST(Reference, FlagshipIsThePapersSetup) {
  const Scene scene = load_scene(kSource / "scenes" / "impact-200-15.toml", {}).scene;
  ASSERT_EQ(scene.bodies.size(), 2U);
  EXPECT_EQ(scene.bodies[0].particles + scene.bodies[1].particles, 94648U);
  EXPECT_EQ(scene.bodies[1].first_id, 47324U);
  EXPECT_NEAR(scene.bodies[0].mass, 1.413717e18, 0.5e12);
  EXPECT_NEAR(scene.bodies[0].mass / 47324, 2.987314e13, 0.5e7);
  EXPECT_DOUBLE_EQ(scene.time.end / *scene.time.step, 819200.0);
  const Vec3d apart = scene.bodies[0].position - scene.bodies[1].position;
  const Vec3d closing = scene.bodies[0].velocity - scene.bodies[1].velocity;
  EXPECT_NEAR(apart.x, 198216.01, 0.005);
  EXPECT_NEAR(apart.y, -26653.56, 0.005);
  EXPECT_NEAR(closing.x, -188.32672, 5e-6);
  EXPECT_NEAR(closing.y, 51.43862, 5e-6);
}

}  // namespace
}  // namespace breccia::scene

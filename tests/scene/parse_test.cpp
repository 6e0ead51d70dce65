// Reading scenes: values, defaults, overrides, and errors that name file, line and key.
#include "scene/parse.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "breccia/constants.hpp"
#include "scene_file.hpp"

namespace breccia::scene {
namespace {

using test::kImpact;
using test::kSphere;
using test::load_text;
using test::usage_error;

std::optional<ResolvedKey> find(const LoadedScene& loaded, const std::string& name) {
  const auto found =
      std::find_if(loaded.keys.begin(), loaded.keys.end(), [&](const ResolvedKey& key) { return key.key == name; });
  return found == loaded.keys.end() ? std::nullopt : std::optional(*found);
}

TEST(Parse, ReadsEverySection) {
  const Scene scene = load_text(R"(
[scene]
name = "all"
end = "2 h"
seed = 7
[grid]
cell = "1 km"
[time]
step = "0.1 s"
cfl = 0.3
[materials.weak]
density = "2.5 g/cm3"
shear_modulus = "1 GPa"
friction_cone = "tangent"
damaged_friction_angle = "35 deg"
[materials.rock]
weibull_k = "5e34 1/m3"
[[body]]
name = "egg"
shape = "ellipsoid"
axes = ["3 km", "2 km", "1 km"]
material = "rock"
particles = 500
lattice = "hcp"
position = [0, "10 km", "0"]
velocity = ["1 m/s", "0", "-2 cm/s"]
spin = ["0", "0", "1e-4 rad/s"]
damage = 0.5
[[body]]
shape = "box"
size = ["2 km", "2 km", "4 km"]
material = "weak"
spacing = "500 m"
lattice = "cubic"
[[boundary]]
point = ["0", "0", "-5 km"]
normal = [0, 0, 2]
kind = "friction"
friction = 0.6
[effects]
gravity = "direct"
damage = false
energy = true
[gravity]
interval = 16
softening = "10 m"
uniform = ["0", "0", "-1 cm/s2"]
[numerics]
precision = "double"
transfer = "apic"
linear_tension = false
[output]
snapshots = "every 10 min"
diagnostics = "30 s"
fields = ["Density", "Damage"]
analysis = ["100 s", "1 h"]
link = 2.5
)")
                          .scene;
  EXPECT_EQ(scene.name, "all");
  EXPECT_EQ(scene.seed, 7U);
  EXPECT_EQ(scene.time.end, 7200.0);
  EXPECT_EQ(*scene.time.step, 0.1);
  EXPECT_EQ(scene.cell, 1000.0);
  ASSERT_EQ(scene.materials.size(), 2U);
  EXPECT_EQ(scene.materials[0].name, "weak");
  EXPECT_EQ(scene.materials[0].eos.rho0, 2500.0);
  EXPECT_EQ(scene.materials[0].strength.cone, FrictionCone::kTangent);
  EXPECT_NEAR(scene.materials[0].strength.damaged_friction_angle, 35.0 * kPi / 180.0, 1e-15);
  EXPECT_EQ(scene.materials[0].eos.A, 2.67e10);
  EXPECT_EQ(scene.materials[1].damage.weibull_k, 5e34);
  const BodyParameters& egg = scene.bodies[0];
  EXPECT_EQ(egg.material, 1U);
  EXPECT_EQ(egg.position.y, 1.0e4);
  EXPECT_EQ(egg.velocity.z, -0.02);
  EXPECT_EQ(egg.spin.z, 1e-4);
  EXPECT_EQ(egg.damage, 0.5);
  EXPECT_NEAR(egg.mass, 2700.0 * 4.0 / 3.0 * kPi * 6.0e9, 1.0);
  const BodyParameters& box = scene.bodies[1];
  EXPECT_EQ(box.name, "body1");
  EXPECT_EQ(box.semi_axes.z, 2000.0);
  EXPECT_EQ(box.particles, 4U * 4U * 8U);
  EXPECT_EQ(box.first_id, 500U);
  EXPECT_EQ(scene.boundaries[0].normal.z, 1.0);
  EXPECT_EQ(scene.boundaries[0].kind, BoundaryKind::kFriction);
  EXPECT_EQ(scene.effects.gravity, GravityMethod::kDirect);
  EXPECT_EQ(scene.effects.damage, Switch::kOff);
  EXPECT_EQ(scene.effects.energy, Switch::kOn);
  EXPECT_EQ(scene.effects.shear, Switch::kAuto);
  EXPECT_EQ(scene.gravity.interval, 16);
  EXPECT_EQ(scene.gravity.uniform.z, -0.01);
  EXPECT_EQ(scene.numerics.precision, Precision::kDouble);
  EXPECT_FALSE(scene.numerics.literal.linear_tension);
  EXPECT_TRUE(scene.numerics.literal.cap_damaged_yield);
  EXPECT_EQ(scene.output.snapshot_interval, 600.0);
  EXPECT_EQ(scene.output.diagnostics_interval, 30.0);
  EXPECT_EQ(scene.output.fields.size(), 2U);
  EXPECT_EQ(scene.output.analysis_times[1], 3600.0);
  EXPECT_EQ(scene.output.link_cells, 2.5);
}

TEST(Parse, DefaultsFollowFromOtherKeys) {
  const LoadedScene loaded = load_text(kSphere);
  const Scene& scene = loaded.scene;
  EXPECT_EQ(scene.name, "scene");  // the file's
  EXPECT_EQ(scene.materials.size(), 1U);
  EXPECT_EQ(scene.materials[0].name, "basalt");
  EXPECT_FALSE(scene.time.step);
  EXPECT_EQ(scene.gravity.softening, 125.0);
  EXPECT_EQ(scene.output.diagnostics_interval, 5.0);
  EXPECT_EQ(scene.output.snapshot_interval, 0.0);
  // fcc with nearest neighbours one cell apart (physics.md 6: 47391).
  EXPECT_NEAR(static_cast<double>(scene.bodies[0].particles), 47391.0, 1.0);

  EXPECT_EQ(find(loaded, "gravity.softening")->value, "125 m");
  EXPECT_FALSE(find(loaded, "gravity.softening")->given);
  EXPECT_TRUE(find(loaded, "grid.cell")->given);
  EXPECT_EQ(find(loaded, "time.step")->value, "auto");
  EXPECT_EQ(find(loaded, "output.snapshots")->value, "start and end");
  EXPECT_EQ(find(loaded, "materials.basalt.shear_modulus")->value, "22.7 GPa");
  EXPECT_FALSE(find(loaded, "body[0].axes"));
  EXPECT_FALSE(find(loaded, "impact.velocity"));
}

TEST(Parse, OverridesTakeBareTextAndQuantities) {
  const auto scene = load_text(kImpact, {"gravity.softening=12 m", "effects.gravity=off", "body[0].radius=10 km",
                                         "impact.velocity=150 m/s", "numerics.asflip_alpha=0.97", "effects.damage=off",
                                         "materials.basalt.cohesion=1 MPa", "gravity.uniform=[0, 0, -1 m/s2]",
                                         "body[1].name=small one", "scene.seed=9", "time.step=auto"})
                         .scene;
  EXPECT_EQ(scene.gravity.softening, 12.0);
  EXPECT_EQ(scene.effects.gravity, GravityMethod::kOff);
  EXPECT_EQ(scene.effects.damage, Switch::kOff);
  EXPECT_EQ(scene.bodies[0].semi_axes.x, 1.0e4);
  EXPECT_EQ(scene.impact->velocity, 150.0);
  EXPECT_EQ(scene.numerics.asflip_alpha, 0.97);
  EXPECT_EQ(scene.materials[0].strength.cohesion, 1.0e6);
  EXPECT_EQ(scene.gravity.uniform.z, -1.0);
  EXPECT_EQ(scene.bodies[1].name, "small one");
  EXPECT_EQ(scene.seed, 9U);
  EXPECT_EQ(usage_error(kSphere, {"grid.cel=1 km"}), "--set: unknown key \"grid.cel\"; did you mean \"grid.cell\"?");
  EXPECT_EQ(usage_error(kSphere, {"grid.cell"}),
            "--set grid.cell: write key=value, for example --set grid.cell=\"2.5 km\"");
  EXPECT_EQ(usage_error(kSphere, {"body[3].radius=1 km"}), "--set: body[3].radius: the scene has no body[3]");
}

TEST(Parse, UnknownKeysAndSections) {
  EXPECT_EQ(usage_error(kSphere + "[grvity]\nsoftening = \"1 m\"\n"),
            "scene.toml:9: unknown key \"grvity.softening\"; did you mean \"gravity.softening\"?");
  EXPECT_EQ(usage_error(kSphere + "radus = \"1 m\"\n"),
            "scene.toml:8: unknown key \"body[0].radus\"; did you mean \"body[0].radius\"?");
  EXPECT_EQ(usage_error(kSphere + "[outptu]\n"), "scene.toml:8: unknown section \"outptu\"; did you mean \"output\"?");
  EXPECT_NE(usage_error("[body]\nradius = \"1 m\"\n").find("write [[body]]"), std::string::npos);
  // Keys of methods this build does not have are unknown, not ignored.
  EXPECT_NE(usage_error(kSphere + "[gravity]\nrefinement = 2\n").find("unknown key \"gravity.refinement\""),
            std::string::npos);
  EXPECT_NE(usage_error(kSphere + "[gravity]\nsplit = 0.3\n").find("below 0.6 cells"), std::string::npos);
}

TEST(Parse, WrongValuesNameFileLineAndKey) {
  const std::string head = "[scene]\nend = \"1 s\"\n[grid]\n";
  EXPECT_EQ(usage_error(head + "cell = 2500\n"),
            "scene.toml:4: grid.cell: \"2500\" needs a unit: a length, for example \"2.5 km\"");
  EXPECT_EQ(usage_error(head + "cell = \"2 kg\"\n"),
            "scene.toml:4: grid.cell: \"2 kg\" is a mass; what is wanted is a length, for example 2.5 km");
  EXPECT_EQ(usage_error(head + "cell = \"-2 km\"\n"),
            "scene.toml:4: grid.cell: \"-2 km\" is out of range; it must be > 0");
  EXPECT_EQ(usage_error(head + "cell = nan\n"), "scene.toml:4: grid.cell: \"nan\" is not a finite number");
  EXPECT_EQ(usage_error(head + "cell = true\n"), "scene.toml:4: grid.cell: a number is wanted, not true or false");
  EXPECT_EQ(usage_error(head + "cell = \n").substr(0, 31), "scene.toml:4: not valid TOML: E");
  EXPECT_EQ(usage_error(kSphere + "particles = 0\n"),
            "scene.toml:8: body[0].particles: is 0; a body needs at least 1 particle");
  EXPECT_NE(usage_error(kSphere + "particles = 2.5\n").find("not a whole number"), std::string::npos);
  EXPECT_NE(usage_error(kSphere + "particles = -3\n").find("negative"), std::string::npos);
  EXPECT_NE(usage_error(kSphere + "position = [\"1 m\", \"2 m\"]\n").find("a list of three"), std::string::npos);
  EXPECT_EQ(usage_error(kSphere + "lattice = \"fc\"\n"),
            "scene.toml:8: body[0].lattice: \"fc\" is not one of fcc, hcp, cubic, random");
  EXPECT_NE(usage_error(kSphere + "[impact]\nvelocity = \"1 m/s\"\nangle = \"100 deg\"\n").find("0 to 90 deg"),
            std::string::npos);
  EXPECT_EQ(usage_error("[grid]\ncell = \"1 m\"\n"),
            "scene.toml: scene.end: is missing; for example end = \"1e5 s\" in [scene]");
}

TEST(Parse, MissingFilesAreIoErrors) {
  EXPECT_THROW(load_scene("no/such/scene.toml", {}), IoError);
  EXPECT_THROW(load_scene(std::filesystem::temp_directory_path(), {}), IoError);
}

// Ranks above 0 have no file: they get the bytes of rank 0, and its errors.
TEST(Parse, AllRanksResolveTheBytesOfTheRoot) {
  const mpi::Comm comm;
  const test::Folder folder;
  const auto path = comm.is_root() ? folder.write("scene.toml", kImpact) : std::filesystem::path("not/here.toml");
  const Scene scene = load_scene(path, {}, comm).scene;
  EXPECT_EQ(scene.bodies.size(), 2U);
  EXPECT_NEAR(scene.bodies[0].position.x, 198216.01 / 2, 0.005);
  EXPECT_THROW(load_scene("not/here.toml", {}, comm), IoError);
}

}  // namespace
}  // namespace breccia::scene

// Scenes that are well written but make no sense: each is one clear line.
#include <gtest/gtest.h>

#include "scene_file.hpp"

namespace breccia::scene {
namespace {

using test::kImpact;
using test::kSphere;
using test::load_text;
using test::usage_error;

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

// A second body beside the sphere of 50 km in the origin.
std::string beside(const std::string& body) {
  return kSphere + "particles = 3000\n[[body]]\nparticles = 3000\n" + body;
}

TEST(Resolve, SpheresMayTouchButNotOverlap) {
  const auto at = [](const std::string& x) {
    return beside("shape = \"sphere\"\nradius = \"50 km\"\nposition = [\"" + x + "\", \"0\", \"0\"]\n");
  };
  EXPECT_EQ(usage_error(at("100 km")), "");
  EXPECT_EQ(usage_error(at("99.99 km")),
            "scene.toml:13: body[1].position: the bodies \"body0\" and \"body1\" overlap; move one of them");
}

TEST(Resolve, OtherShapesOverlapWhereTheirMatterDoes) {
  const auto box_at = [](const std::string& x, const std::string& y) {
    return beside("shape = \"box\"\nsize = [\"40 km\", \"40 km\", \"40 km\"]\nposition = [\"" + x + "\", \"" + y +
                  "\", \"0\"]\n");
  };
  EXPECT_EQ(usage_error(box_at("70 km", "0")), "");
  EXPECT_TRUE(contains(usage_error(box_at("65 km", "0")), "overlap"));
  // Bounding boxes overlap here, but the corner of the box is 57 km from the centre of the sphere.
  EXPECT_EQ(usage_error(box_at("60 km", "60 km")), "");
  // One inside the other.
  EXPECT_TRUE(contains(usage_error(beside("shape = \"cylinder\"\nradius = \"1 km\"\nheight = \"2 km\"\n")), "overlap"));
}

TEST(Resolve, SizesBelongToTheirShape) {
  EXPECT_TRUE(contains(usage_error(kSphere + "height = \"1 km\"\n"), "body[0].height: does not belong to this shape"));
  EXPECT_TRUE(contains(usage_error(beside("shape = \"box\"\nradius = \"1 km\"\n")), "body[1].radius: does not belong"));
  EXPECT_TRUE(contains(usage_error(beside("shape = \"box\"\n")), "body[1].size: is missing"));
  EXPECT_TRUE(contains(usage_error(kSphere + "particles = 10\nspacing = \"1 km\"\n"), "give one of the two"));
  EXPECT_TRUE(contains(usage_error(kSphere + "spacing = \"1 mm\"\n"), "check the unit"));
  EXPECT_TRUE(contains(usage_error(kSphere + "spacing = \"1000 km\"\n"), "larger than the body"));
}

TEST(Resolve, MaterialsAreFoundByName) {
  EXPECT_TRUE(contains(usage_error(kSphere + "material = \"basat\"\n"),
                       "there is no [materials.basat]; did you mean \"basalt\"?"));
  EXPECT_TRUE(contains(usage_error(kSphere + "[materials.a]\n[materials.b]\n"), "more than one material"));
  EXPECT_EQ(load_text(kSphere + "[materials.rock]\n").scene.materials[0].name, "rock");
  EXPECT_TRUE(contains(usage_error(kSphere + "[materials.rock]\npreset = \"ice\"\n"), "is not one of basalt"));
  EXPECT_TRUE(contains(usage_error(kSphere + "[materials.rock]\nstrength_limit = \"1 MPa\"\n"), "above the cohesion"));
}

TEST(Resolve, ImpactNeedsTwoBodiesThatCanMeet) {
  EXPECT_EQ(usage_error(kSphere + "[impact]\nvelocity = \"200 m/s\"\n"),
            "scene.toml:9: [impact] needs exactly two bodies; the scene has 1");
  EXPECT_TRUE(contains(usage_error(kImpact, {"impact.velocity=43 m/s", "impact.angle=0 deg"}), "(apocentre)"));
  EXPECT_TRUE(contains(usage_error(kImpact, {"impact.separation=90 km"}), "below the contact distance"));
  EXPECT_TRUE(contains(usage_error(kImpact, {"body[1].position=[0, 0, 1 km]"}), "follows from [impact]"));
  EXPECT_TRUE(contains(usage_error(kSphere + "[impact]\n"), "exactly two bodies"));
  EXPECT_EQ(load_text(kImpact, {"impact.separation=250 km"}).scene.impact->separation, 2.5e5);
}

TEST(Resolve, NothingIsFasterThanLight) {
  EXPECT_EQ(usage_error(kSphere + "velocity = [\"0\", \"2.9e8 m/s\", \"0\"]\n"), "");
  const std::string error = usage_error(kSphere + "velocity = [\"0\", \"-1e30 m/s\", \"0\"]\n");
  EXPECT_TRUE(contains(error, "body[0].velocity: ")) << error;
  EXPECT_TRUE(contains(error, "would move at 1e+30 m/s, faster than light")) << error;
  EXPECT_TRUE(contains(usage_error(kSphere + "spin = [\"0\", \"1e5 rad/s\", \"0\"]\n"), "body[0].spin: "));
}

TEST(Resolve, Boundaries) {
  const std::string plane = kSphere + "[[boundary]]\npoint = [\"0\", \"0\", \"-50 km\"]\n";
  EXPECT_EQ(usage_error(plane + "normal = [0, 0, 3]\nkind = \"slip\"\n"), "");
  EXPECT_TRUE(contains(usage_error(plane + "normal = [0, 0, 0]\nkind = \"slip\"\n"), "has no direction"));
  EXPECT_TRUE(contains(usage_error(plane + "kind = \"slip\"\n"), "boundary[0].normal: is missing"));
  EXPECT_TRUE(contains(usage_error(plane + "normal = [0, 0, 1]\nkind = \"friction\"\n"), "friction: is missing"));
  EXPECT_TRUE(contains(usage_error(plane + "normal = [0, 0, 1]\nkind = \"slip\"\nfriction = 1\n"), "only"));
  EXPECT_TRUE(contains(usage_error(plane + "normal = [0, 0, -1]\nkind = \"slip\"\n"), "through the plane boundary[0]"));
  const std::string periodic = plane + "normal = [0, 0, 1]\nkind = \"periodic\"\n";
  EXPECT_TRUE(contains(usage_error(periodic), "exactly one facing periodic plane"));
  EXPECT_EQ(usage_error(periodic +
                        "[[boundary]]\npoint = [\"0\", \"0\", \"50 km\"]\nnormal = [0, 0, -1]\nkind = \"periodic\"\n"),
            "");
  EXPECT_TRUE(contains(
      usage_error(periodic +
                  "[[boundary]]\npoint = [\"0\", \"0\", \"60 km\"]\nnormal = [0, 1, 0]\nkind = \"periodic\"\n"),
      "exactly one facing"));
}

}  // namespace
}  // namespace breccia::scene

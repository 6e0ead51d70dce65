// Remnants in JSON: the keys other programs rely on, and no number where there is none.
#include "io/remnants_json.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace breccia::io {
namespace {

TEST(RemnantsJson, KeysAndMissingValues) {
  analysis::Remnant first;
  first.mass = 1.3e18;
  first.mass_over_target = 0.92;
  first.a = 1.2e5;
  first.b = 9.0e4;
  first.c = 8.0e4;
  first.b_over_a = 0.75;
  first.c_over_a = 2.0 / 3.0;
  first.spin_period = 4.0e4;
  first.bound_mass = 1.35e18;
  first.shape = analysis::ShapeClass::kBilobed;
  analysis::Remnant second;
  second.mass = 1.0e10;
  second.spin_period = std::numeric_limits<double>::infinity();
  second.bound_mass = std::numeric_limits<double>::quiet_NaN();

  const std::vector<analysis::Remnant> remnants{first, second};
  const nlohmann::json json = nlohmann::json::parse(remnants_json(remnants).dump());
  ASSERT_EQ(json.size(), 2U);
  EXPECT_EQ(json[0].at("mass"), first.mass);
  EXPECT_EQ(json[0].at("mass_over_target"), first.mass_over_target);
  EXPECT_EQ(json[0].at("a"), first.a);
  EXPECT_EQ(json[0].at("b"), first.b);
  EXPECT_EQ(json[0].at("c"), first.c);
  EXPECT_EQ(json[0].at("b_over_a"), first.b_over_a);
  EXPECT_EQ(json[0].at("c_over_a"), first.c_over_a);
  EXPECT_EQ(json[0].at("class"), "bilobed");
  EXPECT_EQ(json[0].at("spin_period"), first.spin_period);
  EXPECT_EQ(json[0].at("bound_mass"), first.bound_mass);
  EXPECT_TRUE(json[1].at("spin_period").is_null());
  EXPECT_TRUE(json[1].at("bound_mass").is_null());
  EXPECT_EQ(remnants_json({}), nlohmann::json::array());
}

}  // namespace
}  // namespace breccia::io

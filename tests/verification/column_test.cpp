// Columns of grains that collapse on a plane: run-out and height after Lube et al. 2004 (physics.md 7).
#include "tests/verification/benchmark.hpp"

namespace breccia::sim::test {
namespace {

constexpr double kColumnRadius = 1.0;  // r0 [m]; 10 cells
constexpr double kGravity = 10.0;      // [m/s2]
constexpr int kCells = 10;

// A quarter of a cylinder between slip planes, on a plane that holds it. Sound is ten times as fast as a fall from the
// top, so that its weight compresses the column by a percent.
Scene column(const Folder& folder, double aspect) {
  const double cell = kColumnRadius / kCells, spacing = 0.5 * cell, height = aspect * kColumnRadius;
  ParticleFile grains;
  const int layers = static_cast<int>(std::lround(height / spacing));
  for (int i = 0; i < 2 * kCells; ++i) {
    for (int j = 0; j < 2 * kCells; ++j) {
      const double x = (i + 0.5) * spacing, y = (j + 0.5) * spacing;
      if (x * x + y * y > kColumnRadius * kColumnRadius) continue;
      for (int k = 0; k < layers; ++k)
        grains.add({x, y, (k + 0.5) * spacing}, {}, 2700.0 * spacing * spacing * spacing);
    }
  }
  grains.write(folder.file("column.hdf"));
  const double bulk = 100.0 * 2700.0 * kGravity * height;
  char material[200];
  std::snprintf(material, sizeof material,
                "[materials.grains]\ntillotson_A = \"%.10g Pa\"\ntillotson_B = 0\nshear_modulus = \"%.10g Pa\"\n"
                "damaged_friction_angle = \"30 deg\"\n",
                bulk, 0.6 * bulk);
  return load(folder,
              "[scene]\nend = \"100 s\"\n[grid]\ncell = \"" + metres(cell) + "\"\n" + material +
                  "[[body]]\nshape = \"particles\"\nfile = \"column.hdf\"\ndamage = 1\n[effects]\n"
                  "gravity = \"off\"\ndamage = false\nenergy = false\n[gravity]\nuniform = [0, 0, \"-10 m/s2\"]\n" +
                  plane({}, "[0, 0, 1]", "stick") + plane({}, "[1, 0, 0]", "slip") + plane({}, "[0, 1, 0]", "slip"));
}

struct Deposit {
  double run_out, height;  // over r0
};

// After twice the time Lube gives, 3 sqrt(h0/g). The front is where the deposit gets thinner than half a cell, on
// average over the quarter circle; its height is that of the innermost cells.
Deposit collapse(double aspect) {
  const Folder folder;
  const Scene scene = column(folder, aspect);
  Deposit deposit{};
  simulate(scene, [&](const TimeLoop& loop) {
    if (loop.time() < 6.0 * std::sqrt(aspect * kColumnRadius / kGravity)) return true;
    const ParticleOutput p = loop.engine().observe();
    std::vector<double> volume(1000, 0.0);
    for (std::size_t i = 0; i < p.size(); ++i) {
      const double r = std::hypot(p.position[i].x, p.position[i].y);
      volume[static_cast<std::size_t>(std::min(r / scene.cell, 999.0))] += p.mass[i] / 2700.0;
    }
    std::size_t front = 0;
    for (std::size_t k = 0; k < volume.size(); ++k) {
      const double area = 0.25 * kPi * (2.0 * static_cast<double>(k) + 1.0) * scene.cell * scene.cell;
      if (volume[k] / area > 0.5 * scene.cell) front = k + 1;
      if (k == 1) deposit.height = (volume[0] + volume[1]) / (4.0 * 0.25 * kPi * scene.cell * scene.cell);
    }
    deposit.run_out = static_cast<double>(front) * scene.cell / kColumnRadius - 1.0;
    return false;
  });
  return deposit;
}

// Lube: (r - r0)/r0 = 1.24 a below a = 1.7 and 1.6 sqrt(a) above; 20 % is the scatter between grains and between his
// law and Lajeunesse's.
TEST(Verification, ColumnCollapseRunsOutAfterLube) {
  for (const double aspect : {0.5, 1.0, 2.0, 5.0}) {
    const Deposit deposit = collapse(aspect);
    const double expected = aspect < 1.7 ? 1.24 * aspect : 1.6 * std::sqrt(aspect);
    const std::string name = "column collapse, a = " + std::to_string(aspect).substr(0, 3);
    record(name.c_str(), "run-out over r0", kCells, deposit.run_out, expected, "Lube et al. 2004");
    if (aspect > 1.7) {
      record(name.c_str(), "height over r0", kCells, deposit.height, 0.88 * std::pow(aspect, 1.0 / 6.0),
             "Lube et al. 2004");
    }
    EXPECT_NEAR(deposit.run_out, expected, 0.2 * expected) << aspect;
  }
}

}  // namespace
}  // namespace breccia::sim::test

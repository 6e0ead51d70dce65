// The same source in every shape: packs against scalars, run-time effects against compile-time ones.
#include <gtest/gtest.h>

#include <random>

#include "breccia/pack.hpp"
#include "material/constitutive.hpp"
#include "material_point.hpp"

namespace {

using namespace breccia;
using namespace breccia::material;
using namespace breccia::test;
using Eigen::Matrix3d;

/// Equality of every member, lane by lane.
template <class T>
void expect_same(const State<T>& a, const State<T>& b) {
  EXPECT_EQ(a.elastic.xx, b.elastic.xx);
  EXPECT_EQ(a.elastic.yz, b.elastic.yz);
  EXPECT_EQ(a.volume.high, b.volume.high);
  EXPECT_EQ(a.energy.high, b.energy.high);
  EXPECT_EQ(a.kirchhoff_pressure, b.kirchhoff_pressure);
}

// To the bit: the baseline processor of the tests has no fused multiply-add that the compiler could place differently.
TEST(Policies, PacksEqualScalarsInEveryLane) {
  using P = Pack<float, 16>;
  std::mt19937_64 engine(9);
  std::normal_distribution<double> normal;
  const auto k = make_constants<float>({}, {}, kCell);
  const auto number = [&](double amplitude) { return float(amplitude * normal(engine)); };
  const auto fill = [&](P& p, double amplitude, float offset = 0.0F) {
    for (int i = 0; i < 16; ++i) p.set(i, offset + number(amplitude));
  };
  for (int trial = 0; trial < 50; ++trial) {
    State<P> pack{};
    Mat3<P> l;
    // Lanes from tension to compression, from elastic to beyond the series, cold to vapour, intact to granular.
    for (P* p : {&pack.elastic.xx, &pack.elastic.yy, &pack.elastic.xy, &pack.elastic.xz, &pack.elastic.yz})
      for (int i = 0; i < 16; ++i) p->set(i, number(i == 3 ? 0.1 : 1e-3 * i));
    fill(pack.volume.high, 1e-3);
    pack.volume.low = P(0.0F);
    for (int i = 0; i < 16; ++i) pack.energy.high.set(i, i == 5 ? 1e7F : float(i) * 1e4F);
    pack.energy.low = P(0.0F);
    for (int i = 0; i < 16; ++i) pack.damage_root.set(i, float(i) / 15.0F);
    fill(pack.kirchhoff_pressure, 1e7);
    for (P* p : {&pack.total.xx, &pack.total.yy, &pack.total.zz, &pack.total.xy, &pack.total.xz, &pack.total.yz})
      fill(*p, 1e-4);
    for (P* p : {&l.xx, &l.xy, &l.xz, &l.yx, &l.yy, &l.yz, &l.zx, &l.zy, &l.zz}) fill(*p, 1e-3);

    State<float> lanes[16];
    Sym3<float> stress[16];
    for (int i = 0; i < 16; ++i) {
      lanes[i].elastic = {pack.elastic.xx[i], pack.elastic.yy[i], pack.elastic.xy[i], pack.elastic.xz[i],
                          pack.elastic.yz[i]};
      lanes[i].volume = {pack.volume.high[i], 0.0F};
      lanes[i].energy = {pack.energy.high[i], 0.0F};
      lanes[i].damage_root = pack.damage_root[i];
      lanes[i].kirchhoff_pressure = pack.kirchhoff_pressure[i];
      lanes[i].total = {pack.total.xx[i], pack.total.yy[i], pack.total.zz[i],
                        pack.total.xy[i], pack.total.xz[i], pack.total.yz[i]};
      const Mat3<float> li{l.xx[i], l.xy[i], l.xz[i], l.yx[i], l.yy[i], l.yz[i], l.zx[i], l.zy[i], l.zz[i]};
      Dissipation<float> d;
      update_strain(RockEffects{}, k, lanes[i], li, 0.1F);
      stress[i] = update_stress(RockEffects{}, k, lanes[i], li, 0.05F, d);
    }
    Dissipation<P> d;
    update_strain(RockEffects{}, k, pack, l, 0.1F);
    const Sym3<P> tau = update_stress(RockEffects{}, k, pack, l, 0.05F, d);
    for (int i = 0; i < 16; ++i) {
      const State<float> s{
          {pack.elastic.xx[i], pack.elastic.yy[i], pack.elastic.xy[i], pack.elastic.xz[i], pack.elastic.yz[i]},
          {pack.volume.high[i], pack.volume.low[i]},
          {pack.energy.high[i], pack.energy.low[i]},
          pack.kirchhoff_pressure[i],
          pack.damage_root[i],
          {}};
      expect_same(s, lanes[i]);
      EXPECT_EQ(tau.xx[i], stress[i].xx);
      EXPECT_EQ(tau.xy[i], stress[i].xy);
      EXPECT_EQ(pack.total.xz[i], lanes[i].total.xz);
    }
  }
}

template <class Fx>
void expect_runtime_equals(Fx) {
  MaterialPoint<double, Fx> fixed;
  MaterialPoint<double, RuntimeEffects> general;
  general.fx = {Fx::shear, Fx::strength, Fx::damage, Fx::viscosity, Fx::energy, Fx::fully_damaged};
  fixed.state.damage_root = general.state.damage_root = 0.4;
  std::mt19937_64 engine(4);
  for (int step = 0; step < 100; ++step) {
    const Matrix3d l = random_matrix(engine, 3e-3);
    EXPECT_EQ(to_eigen(fixed.advance(l)), to_eigen(general.advance(l)));
    expect_same(fixed.state, general.state);
  }
}
TEST(Policies, RuntimeEffectsReproduceEveryPolicy) {
  expect_runtime_equals(RockEffects{});
  expect_runtime_equals(GranularEffects{});
  expect_runtime_equals(ElasticEffects{});
  expect_runtime_equals(FluidEffects{});
}

TEST(Policies, GranularEqualsRockAtFullDamage) {
  MaterialPoint<double, GranularEffects> granular;
  MaterialPoint<double> rock;
  rock.state.damage_root = 1.0;
  std::mt19937_64 engine(5);
  for (int step = 0; step < 300; ++step) {
    const Matrix3d l = random_matrix(engine, 3e-3);
    EXPECT_EQ(to_eigen(granular.advance(l)), to_eigen(rock.advance(l)));
  }
}

TEST(Policies, EffectsThatAreOffLeaveTheirFieldsAlone) {
  const double mark = 123.0;
  MaterialPoint<double, RuntimeEffects> point;
  point.fx = {false, false, false, false, false, false};
  point.state = {{mark, mark, mark, mark, mark}, {0.0}, {mark}, 0.0, mark, {mark, mark, mark, mark, mark, mark}};
  std::mt19937_64 engine(6);
  const Matrix3d tau = to_eigen(point.advance(random_matrix(engine, 1e-3)));
  EXPECT_EQ(deviator(tau).norm(), 0.0);
  EXPECT_EQ(point.state.elastic.xy, mark);
  EXPECT_EQ(point.state.energy.value(), mark);
  EXPECT_EQ(point.state.damage_root, mark);
  EXPECT_EQ(point.state.total.yz, mark);
  EXPECT_NE(point.state.volume.value(), 0.0);
}

}  // namespace

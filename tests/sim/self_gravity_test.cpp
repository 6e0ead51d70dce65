// An intact elastic sphere switched on from rest under its own gravity (physics.md 6 and 7).
#include <gtest/gtest.h>

#include "tests/sim/simulation.hpp"

namespace breccia::sim::test {
namespace {

TEST(RingDown, explore) {
  for (const char* cell : {"6.25 km", "5 km"})
  for (const char* visc : {"true"}) {
    const Scene scene = load(std::string(R"([scene]
end = "300 s"
[grid]
cell = ")")+cell+R"("
[time]
cfl=0.4
[[body]]
shape = "sphere"
radius = "50 km"
[effects]
gravity = "direct"
strength = false
damage = false
viscosity = )"+visc+"\n");
    ZeroCrossings crossings;
    double last=0;
    simulate(scene, [&](const TimeLoop& loop) {
      const ParticleOutput p = loop.engine().observe();
      double a = 0.0;
      for (std::size_t i = 0; i < p.size(); ++i) a += dot(p.velocity[i], p.position[i]);
      crossings.sample(loop.time(), a);
      if (loop.time() > last) {
        last += 100;
        double s=0, n=0, e=0;
        for (std::size_t i = 0; i < p.size(); ++i) { double r2=dot(p.position[i],p.position[i])/2.5e9;
          if (r2<0.36) { s+=p.pressure[i]; n+=1; e+=1-r2*5/(3*(3-0.168774)/(1+0.168774));} }
        std::printf("t %g a %g  P %g dt %g\n", loop.time(), a, s/e/1.7355e6, loop.dt());
      }
      return loop.time() < 400;
    });
    std::printf("%s %s n %zu T %g %zu\n", cell, visc, scene.bodies[0].particles, crossings.period()/28.52, crossings.count());
  }
}

}  // namespace
}  // namespace breccia::sim::test

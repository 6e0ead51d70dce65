#include "grid/reference_step.hpp"

#include <cmath>

namespace breccia::test {
namespace {

double weight(double r) {
  const double a = std::abs(r);
  return a < 0.5 ? 0.75 - a * a : a < 1.5 ? 0.5 * (1.5 - a) * (1.5 - a) : 0.0;
}

Vec3d times(const Mat3<double>& m, Vec3d r) {
  return {m.xx * r.x + m.xy * r.y + m.xz * r.z, m.yx * r.x + m.yy * r.y + m.yz * r.z,
          m.zx * r.x + m.zy * r.y + m.zz * r.z};
}
double power(const Sym3<double>& t, const Mat3<double>& c) {
  return t.xx * c.xx + t.yy * c.yy + t.zz * c.zz + t.xy * (c.xy + c.yx) + t.xz * (c.xz + c.zx) + t.yz * (c.yz + c.zy);
}
Vec3d times(const Sym3<double>& m, Vec3d r) {
  return {m.xx * r.x + m.xy * r.y + m.xz * r.z, m.xy * r.x + m.yy * r.y + m.yz * r.z,
          m.xz * r.x + m.yz * r.y + m.zz * r.z};
}

void add_outer(Mat3<double>& c, Vec3d v, Vec3d r) {
  c = {c.xx + v.x * r.x, c.xy + v.x * r.y, c.xz + v.x * r.z, c.yx + v.y * r.x, c.yy + v.y * r.y,
       c.yz + v.y * r.z, c.zx + v.z * r.x, c.zy + v.z * r.y, c.zz + v.z * r.z};
}

// Calls visit(index, w, x_i - x_p) for the 27 nodes of a particle.
template <class F>
void for_each_node(Vec3d x, double dx, F&& visit) {
  const int base[3] = {static_cast<int>(std::floor(x.x / dx - 0.5)), static_cast<int>(std::floor(x.y / dx - 0.5)),
                       static_cast<int>(std::floor(x.z / dx - 0.5))};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      for (int k = 0; k < 3; ++k) {
        const std::array<int, 3> index{base[0] + i, base[1] + j, base[2] + k};
        const Vec3d r{index[0] * dx - x.x, index[1] * dx - x.y, index[2] * dx - x.z};
        visit(index, weight(r.x / dx) * weight(r.y / dx) * weight(r.z / dx), r);
      }
    }
  }
}

}  // namespace

ReferenceStep::ReferenceStep(const ReferenceSetup& setup, const ParticleArrays& particles,
                             const material::FlawLists& flaws)
    : setup_(setup), constants_(material::make_constants<double>(setup.material, {}, setup.cell)) {
  for (std::size_t i = 0; i < particles.size(); ++i) {
    ReferenceParticle p;
    p.x = particles.position[i];
    p.v = particles.velocity[i];
    p.mass = particles.mass[i];
    const Vec3d w = setup.spin;
    p.c = {0.0, -w.z, w.y, w.z, 0.0, -w.x, -w.y, w.x, 0.0};
    p.growth = material::crack_growth_rate(setup.material, p.mass / setup.material.eos.rho0);
    p.state.damage_root = std::cbrt(particles.damage[i]);
    if (setup.effects.damage) p.flaws.assign(flaws.of(i).begin(), flaws.of(i).end());
    particles_.push_back(p);
  }
}

void ReferenceStep::step(double dt) {
  p2g(dt);
  for (auto& [index, node] : grid_) {
    node.old_velocity = (1.0 / node.mass) * node.momentum;
    node.velocity = node.old_velocity + (dt / node.mass) * node.force;
    terms_.affine -= dt / node.mass * dot(node.force, node.affine);
    terms_.filter -= 0.5 * dt * dt / node.mass * dot(node.force, node.force);
  }
  g2p(dt);
}

void ReferenceStep::p2g(double dt) {
  grid_.clear();
  for (ReferenceParticle& p : particles_) {
    material::Dissipation<double> lost{};
    p.tau = material::update_stress(setup_.effects, constants_, p.state, p.c, 0.5 * dt, lost);
    const double volume = p.mass / setup_.material.eos.rho0;
    for_each_node(p.x, setup_.cell, [&](const Index& index, double w, Vec3d r) {
      if (w == 0.0) return;
      Node& node = grid_[index];
      node.mass += w * p.mass;
      const Vec3d affine = w * p.mass * times(p.c, r);
      node.affine += affine;
      node.momentum += w * p.mass * p.v + affine;
      node.force += w * (p.mass * setup_.gravity - (4.0 / (setup_.cell * setup_.cell) * volume) * times(p.tau, r));
    });
  }
}

void ReferenceStep::g2p(double dt) {
  const double d = 4.0 / (setup_.cell * setup_.cell);
  for (ReferenceParticle& p : particles_) {
    Vec3d updated{}, old{};
    Mat3<double> c{}, old_c{};
    for_each_node(p.x, setup_.cell, [&](const Index& index, double w, Vec3d r) {
      if (w == 0.0) return;
      const Node& node = grid_.at(index);
      updated += w * node.velocity;
      old += w * node.old_velocity;
      add_outer(c, w * d * node.velocity, r);
      add_outer(old_c, w * d * node.old_velocity, r);
    });
    const Vec3d slip = setup_.alpha * (p.v - old), taken = updated - old;
    const Vec3d twice_mean = p.v + updated + slip;
    terms_.filter += 0.5 * p.mass * dot(taken, taken);
    terms_.smoothing -= 0.5 * (1.0 - setup_.alpha) * p.mass * dot(p.v - old, twice_mean + taken);
    p.v = updated + slip;
    terms_.gradient += 0.5 * dt * p.mass / setup_.material.eos.rho0 * (power(p.tau, p.c) - power(p.tau, old_c));
    p.x += dt * (updated + setup_.beta * slip);
    p.c = c;
    material::update_strain(setup_.effects, constants_, p.state, p.c, dt);
    if (setup_.effects.damage) damage(p, dt);
  }
}

void ReferenceStep::damage(ReferenceParticle& p, double dt) const {
  const double strain = material::principal_strain(p.state);
  while (p.active < p.flaws.size() && strain > static_cast<double>(p.flaws[p.active])) ++p.active;
  if (p.active == 0 || p.state.damage_root >= 1.0) return;
  p.state.damage_root = material::grow_damage_root(p.state.damage_root, static_cast<double>(p.active),
                                                   static_cast<double>(p.flaws.size()), p.growth * dt);
  if (p.state.damage_root >= 1.0) p.state.total = {};
}

}  // namespace breccia::test

// A solver's field of a cloud that is dealt out to the ranks.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "gravity/solver.hpp"
#include "plain_sum.hpp"

namespace breccia::gravity {

using Owner = std::function<int(std::size_t)>;

inline Owner round_robin() {
  return [](std::size_t i) { return static_cast<int>(i) % mpi::Comm().size(); };
}

struct Result {
  Field field;
  Stats stats;
};

/// Deals the cloud out to the ranks, evaluates and collects the field in the order of the cloud, on all ranks.
inline Field evaluate(Solver& solver, const Cloud& cloud, const Owner& owner) {
  const mpi::Comm comm;
  Cloud mine;
  std::vector<std::size_t> index;
  for (std::size_t i = 0; i < cloud.position.size(); ++i) {
    if (owner(i) != comm.rank()) continue;
    index.push_back(i);
    mine.position.push_back(cloud.position[i]);
    mine.mass.push_back(cloud.mass[i]);
  }
  std::vector<Vec3d> acceleration(index.size());
  std::vector<double> potential(index.size());
  solver.evaluate({mine.position, mine.mass}, acceleration, potential);

  // Every particle has one owner; the others add zeros.
  std::vector<double> all(4 * cloud.position.size(), 0.0);
  for (std::size_t k = 0; k < index.size(); ++k) {
    const double values[4] = {acceleration[k].x, acceleration[k].y, acceleration[k].z, potential[k]};
    std::copy_n(values, 4, &all[4 * index[k]]);
  }
  comm.sum(std::span<double>(all));
  Field field;
  for (std::size_t i = 0; i < cloud.position.size(); ++i) {
    field.acceleration.push_back({all[4 * i], all[4 * i + 1], all[4 * i + 2]});
    field.potential.push_back(all[4 * i + 3]);
  }
  return field;
}

/// The same with a solver made for it.
inline Result evaluate(GravityMethod method, const Cloud& cloud, const Parameters& parameters, const Owner& owner,
                       int threads = 1) {
  const auto solver = make_solver(method, parameters, mpi::Comm(), threads);
  Field field = evaluate(*solver, cloud, owner);
  return {std::move(field), solver->last()};
}

inline double largest_relative_error(const std::vector<double>& a, const std::vector<double>& b) {
  double worst = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(a[i] / b[i] - 1.0));
  return worst;
}

inline Cloud two_spheres(std::size_t count) {
  Cloud cloud;
  std::mt19937_64 random(7);
  add_ball(cloud, count / 2, {-1e5, 0, 0}, 5e4, random);
  add_ball(cloud, count - count / 2, {1e5, 2e4, 0}, 5e4, random);
  return cloud;
}

}  // namespace breccia::gravity

// One cloud evaluated by the ranks together.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>

#include "gravity/solver.hpp"
#include "plain_sum.hpp"

namespace breccia::gravity {

using Owner = std::function<int(std::size_t)>;

/// Deals the cloud out to the ranks, evaluates and collects the field in the order of the cloud, on all ranks.
inline Field evaluate_spread_out(Solver& solver, const Cloud& cloud, const Owner& owner) {
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

}  // namespace breccia::gravity

// Gravity's field on a device: an engine that holds the particles of a state, at rest.
#pragma once

#include <memory>
#include <vector>

#include "bench/gravity_states.hpp"
#include "breccia/scene.hpp"
#include "gravity/resident.hpp"
#include "grid/device.hpp"
#include "mpi/comm.hpp"

namespace breccia::bench {

class DeviceField {
 public:
  /// One rank, mixed precision. Throws UsageError if there is no device.
  DeviceField(const GravityState& state, const mpi::Comm& comm);

  [[nodiscard]] const std::string& device() const { return device_; }
  [[nodiscard]] std::unique_ptr<gravity::ResidentSolver> make_solver(GravityMethod method,
                                                                     const gravity::Parameters& parameters) const;
  /// What the particles hold after an evaluation, in the order of the state [m/s2].
  [[nodiscard]] std::vector<Vec3d> held() const;

 private:
  std::string device_;
  std::unique_ptr<grid::Engine> engine_;
};

}  // namespace breccia::bench

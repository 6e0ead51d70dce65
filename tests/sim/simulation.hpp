// Whole runs as the tests want them: a scene from TOML text, stepped to an end, seen at every t_n.
#pragma once

#include <hdf5.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "mpi/comm.hpp"
#include "scene/parse.hpp"
#include "sim/effects.hpp"
#include "sim/time_loop.hpp"

namespace breccia::sim::test {

inline constexpr double kPi = std::numbers::pi;
/// Longitudinal wave speed of the default basalt, sqrt((A + 4/3 mu)/rho0) [m/s].
inline const double kLongitudinalSpeed = std::sqrt((2.67e10 + 4.0 / 3.0 * 2.27e10) / 2700.0);

/// A folder that goes with the test; one per process, so ranks do not meet.
class Folder {
 public:
  Folder() : path_(std::filesystem::temp_directory_path() / ("breccia_sim_test_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(path_);
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  [[nodiscard]] std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

/// The scene of `text`; particle files are read later, so they live in the caller's `folder`.
inline Scene load(const Folder& folder, const std::string& text, const std::vector<std::string>& overrides = {}) {
  std::ofstream(folder.file("scene.toml")) << text;
  return scene::load_scene(folder.file("scene.toml"), overrides).scene;
}
inline Scene load(const std::string& text, const std::vector<std::string>& overrides = {}) {
  return load(Folder(), text, overrides);
}

inline std::string seconds(double t) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g s", t);
  return text;
}
inline std::string metres(double x) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g m", x);
  return text;
}

using Visit = std::function<bool(const TimeLoop&)>;

/// Steps until `visit`, called at every t_n, returns false.
inline void simulate(const Scene& scene, const Visit& visit, const mpi::Comm& comm = mpi::Comm(MPI_COMM_SELF),
                     int threads = 1) {
  const ResolvedEffects effects = resolve_effects(scene);
  TimeLoop loop(scene, effects, threads, comm);
  loop.run(visit);
}

/// What this rank observes after `steps` steps.
inline ParticleOutput state_after(std::uint64_t steps, const Scene& scene,
                                  const mpi::Comm& comm = mpi::Comm(MPI_COMM_SELF), int threads = 1) {
  ParticleOutput state;
  simulate(
      scene,
      [&](const TimeLoop& loop) {
        if (loop.step() < steps) return true;
        state = loop.engine().observe();
        return false;
      },
      comm, threads);
  return state;
}

/// A particle file for shape = "particles".
struct ParticleFile {
  std::vector<double> x, v, mass;

  void add(Vec3d position, Vec3d velocity, double m) {
    x.insert(x.end(), {position.x, position.y, position.z});
    v.insert(v.end(), {velocity.x, velocity.y, velocity.z});
    mass.push_back(m);
  }

  void write(const std::string& path) const {
    const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    const hid_t group = H5Gcreate2(file, "/PartType0", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    write_rows(group, "Coordinates", x, 3);
    write_rows(group, "Velocities", v, 3);
    write_rows(group, "Masses", mass, 1);
    H5Gclose(group);
    H5Fclose(file);
  }

 private:
  void write_rows(hid_t group, const char* name, const std::vector<double>& values, hsize_t columns) const {
    const hsize_t size[2] = {mass.size(), columns};
    const hid_t space = H5Screate_simple(columns == 1 ? 1 : 2, size, nullptr);
    const hid_t set = H5Dcreate2(group, name, H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
    H5Dclose(set);
    H5Sclose(space);
  }
};

/// Times at which a sampled signal changes its sign, by linear interpolation.
class ZeroCrossings {
 public:
  void sample(double time, double value) {
    if (seen_ && (value > 0.0) != (last_value_ > 0.0)) {
      times_.push_back(last_time_ + (time - last_time_) * last_value_ / (last_value_ - value));
    }
    seen_ = true;
    last_time_ = time;
    last_value_ = value;
  }
  [[nodiscard]] std::size_t count() const { return times_.size(); }
  /// Mean period between the first and the last crossing.
  [[nodiscard]] double period() const {
    return 2.0 * (times_.back() - times_.front()) / static_cast<double>(times_.size() - 1);
  }

 private:
  bool seen_ = false;
  double last_time_ = 0.0, last_value_ = 0.0;
  std::vector<double> times_;
};

}  // namespace breccia::sim::test

#include "scene/particle_file.hpp"

#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "breccia/error.hpp"
#include "io/foreign_file.hpp"

namespace breccia::scene {

namespace {

// An HDF5 handle closed at the end of its scope.
class Handle {
 public:
  using Close = herr_t (*)(hid_t);
  Handle(hid_t id, Close close, const std::string& problem) : id_(id), close_(close) {
    if (id < 0) throw IoError(problem);
  }
  ~Handle() { close_(id_); }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  operator hid_t() const { return id_; }

 private:
  hid_t id_;
  Close close_;
};

// The library prints its own error stack otherwise; errors are one line here.
class QuietHdf5 {
 public:
  QuietHdf5() {
    H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~QuietHdf5() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }
  QuietHdf5(const QuietHdf5&) = delete;
  QuietHdf5& operator=(const QuietHdf5&) = delete;

 private:
  H5E_auto2_t function_ = nullptr;
  void* data_ = nullptr;
};

class ParticleFile {
 public:
  explicit ParticleFile(const std::string& path)
      : path_(path),
        file_(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose,
              fmt::format("{}: cannot be opened as an HDF5 file", path)) {}

  [[nodiscard]] bool has(const std::string& name) const {
    return H5Lexists(file_, "/PartType0", H5P_DEFAULT) > 0 && H5Lexists(file_, full(name).c_str(), H5P_DEFAULT) > 0;
  }

  /// Number of rows; checks that there are `columns` (1: a plain list).
  [[nodiscard]] std::uint64_t rows(const std::string& name, hsize_t columns) const {
    const Handle dataset(H5Dopen2(file_, full(name).c_str(), H5P_DEFAULT), H5Dclose, missing(name));
    const Handle space(H5Dget_space(dataset), H5Sclose, missing(name));
    std::array<hsize_t, 2> size{0, 1};
    const int rank = H5Sget_simple_extent_ndims(space);
    if (rank == 1 || rank == 2) H5Sget_simple_extent_dims(space, size.data(), nullptr);
    if ((rank != 1 && rank != 2) || size[1] != columns) {
      const std::string want = columns == 1 ? "(N)" : fmt::format("(N, {})", columns);
      throw IoError(fmt::format("{}: {} must have the shape {}", path_, full(name), want));
    }
    return size[0];
  }

  /// `count` rows from `begin`, row by row, as double.
  [[nodiscard]] std::vector<double> read(const std::string& name, hsize_t columns, std::uint64_t begin,
                                         std::uint64_t count) const {
    const std::string problem = fmt::format("{}: cannot read {}", path_, full(name));
    const Handle dataset(H5Dopen2(file_, full(name).c_str(), H5P_DEFAULT), H5Dclose, missing(name));
    const Handle space(H5Dget_space(dataset), H5Sclose, problem);
    const std::array<hsize_t, 2> start{begin, 0};
    const std::array<hsize_t, 2> size{count, columns};
    const int rank = H5Sget_simple_extent_ndims(space);
    const Handle memory(H5Screate_simple(rank, size.data(), nullptr), H5Sclose, problem);
    if (H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, size.data(), nullptr) < 0)
      throw IoError(problem);
    std::vector<double> values(count * columns);
    if (H5Dread(dataset, H5T_NATIVE_DOUBLE, memory, space, H5P_DEFAULT, values.data()) < 0) throw IoError(problem);
    return values;
  }

 private:
  [[nodiscard]] static std::string full(const std::string& name) { return "/PartType0/" + name; }
  [[nodiscard]] std::string missing(const std::string& name) const {
    return fmt::format("{}: {} is missing", path_, full(name));
  }

  std::string path_;
  Handle file_;
};

std::vector<Vec3d> as_vectors(const std::vector<double>& rows) {
  std::vector<Vec3d> result(rows.size() / 3);
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = {rows[3 * i], rows[3 * i + 1], rows[3 * i + 2]};
  return result;
}

std::uint64_t particle_count(const ParticleFile& file, const std::string& path) {
  const std::uint64_t n = file.rows("Coordinates", 3);
  if (file.rows("Velocities", 3) != n || file.rows("Masses", 1) != n ||
      (file.has("Damage") && file.rows("Damage", 1) != n))
    throw IoError(fmt::format("{}: the datasets of /PartType0 differ in length", path));
  if (n == 0) throw UsageError(fmt::format("{}: there are no particles in /PartType0", path));
  return n;
}

void check_values(const ParticleFileSlice& all, const std::string& path) {
  for (std::size_t i = 0; i < all.mass.size(); ++i) {
    const Vec3d sum = all.position[i] + all.velocity[i];
    if (!std::isfinite(sum.x + sum.y + sum.z)) throw UsageError(fmt::format("{}: particle {} is not finite", path, i));
    if (!(all.mass[i] > 0.0) || !std::isfinite(all.mass[i]))
      throw UsageError(fmt::format("{}: particle {} has the mass {} kg; it must be > 0", path, i, all.mass[i]));
    if (!all.damage.empty() && !(all.damage[i] >= 0.0 && all.damage[i] <= 1.0))
      throw UsageError(fmt::format("{}: particle {} has the damage {}; it must be 0 to 1", path, i, all.damage[i]));
  }
}

ParticleFileSlice read_slice(const ParticleFile& file, std::uint64_t begin, std::uint64_t count) {
  return {as_vectors(file.read("Coordinates", 3, begin, count)), as_vectors(file.read("Velocities", 3, begin, count)),
          file.read("Masses", 1, begin, count),
          file.has("Damage") ? file.read("Damage", 1, begin, count) : std::vector<double>{}};
}

}  // namespace

ParticleFileSummary summarize_particle_file(const std::string& path) {
  io::require_harmless(path);
  const QuietHdf5 quiet;
  const ParticleFile file(path);
  ParticleFileSummary summary;
  summary.count = particle_count(file, path);
  const ParticleFileSlice all = read_slice(file, 0, summary.count);
  check_values(all, path);
  for (std::size_t i = 0; i < all.mass.size(); ++i) {
    summary.mass += all.mass[i];
    summary.centre += all.mass[i] * all.position[i];
    summary.velocity += all.mass[i] * all.velocity[i];
  }
  summary.centre = (1.0 / summary.mass) * summary.centre;
  summary.velocity = (1.0 / summary.mass) * summary.velocity;
  for (const Vec3d& x : all.position) {
    const Vec3d d = x - summary.centre;
    Vec3d& h = summary.half_extent;
    h = {std::max(h.x, std::abs(d.x)), std::max(h.y, std::abs(d.y)), std::max(h.z, std::abs(d.z))};
  }
  return summary;
}

ParticleFileSlice read_particle_file(const std::string& path, std::uint64_t begin, std::uint64_t count) {
  const QuietHdf5 quiet;
  const ParticleFile file(path);
  return read_slice(file, begin, count);
}

}  // namespace breccia::scene

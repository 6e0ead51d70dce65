#include "bench/gravity_bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "bench/cpu_time.hpp"
#include "bench/device_field.hpp"
#include "bench/gravity_states.hpp"
#include "bench/json_output.hpp"
#include "gravity/method.hpp"
#include "gravity/points.hpp"
#include "gravity/solver.hpp"
#include "gravity/verify.hpp"

namespace breccia::bench {
namespace {

constexpr std::int64_t kVerified = 10'000;

// Of more particles the pull on the first body is summed only where that is asked for: at a million, a minute.
constexpr std::int64_t kMostForBody = 100'000;

// Particles summed directly per slice: long enough to time, short enough to follow each evaluation.
constexpr std::int64_t kSlicePairs = 1'000'000'000;

// The slab of x of this rank, of equal numbers of particles; all of a state are on every rank.
struct Share {
  explicit Share(const GravityState& state) {
    const mpi::Comm comm;
    const auto all = static_cast<std::int64_t>(state.position.size());
    const auto cut = [&](int r) { return static_cast<std::size_t>(all * r / comm.size()); };
    first = cut(comm.rank());
    count = cut(comm.rank() + 1) - first;
    view = {std::span(state.position).subspan(first, count), std::span(state.mass).subspan(first, count)};
  }
  std::size_t first = 0, count = 0;
  gravity::ParticlesView view;
};

// Of the slowest rank; wall time unless one thread on one rank does all.
double seconds_since(Timing start, int threads) {
  const mpi::Comm comm;
  return comm.max(since(start, threads * comm.size()));
}

// Seconds the float direct sum would take, from a slice of its targets.
class DirectSlice {
 public:
  DirectSlice(const GravityState& state, int threads) : softening_(state.softening), threads_(threads) {
    points_.fill({state.position, state.mass}, state.mass.front());
    const auto n = static_cast<std::int64_t>(state.position.size());
    groups_ = std::clamp<std::int64_t>(kSlicePairs / n / gravity::kTargetGroup, 1, n / gravity::kTargetGroup);
    scale_ = static_cast<double>(n) / static_cast<double>(groups_ * gravity::kTargetGroup * mpi::Comm().size());
    for (auto& s : sums_) s.assign(static_cast<std::size_t>(gravity::padded(n)), 0.0);
  }
  double seconds() {
    mpi::Comm().barrier();
    const Timing start = now();
#pragma omp parallel for num_threads(threads_) schedule(static)
    for (std::int64_t g = 0; g < groups_; ++g) {
      sum_pairs(gravity::PairTask<float>{.targets = points_.arrays(),
                                         .begin = g * gravity::kTargetGroup,
                                         .end = (g + 1) * gravity::kTargetGroup,
                                         .sources = points_.arrays(),
                                         .same = true,
                                         .softening_squared = static_cast<float>(softening_ * softening_),
                                         .acceleration = {sums_[0].data(), sums_[1].data(), sums_[2].data()},
                                         .potential = nullptr});
    }
    return scale_ * seconds_since(start, threads_);
  }

 private:
  double softening_;
  int threads_;
  gravity::Points<float> points_;
  std::int64_t groups_ = 0;
  double scale_ = 1.0;
  std::vector<double> sums_[3];
};

struct Setting {
  std::string method;
  std::string name;
  GravityMethod kind;
  gravity::Parameters parameters;
};

struct Measured {
  double seconds = 1e300;
  double direct = 1e300;
  gravity::FieldErrors errors;
  std::optional<double> body_momentum;
  gravity::Stats stats;
};

double norm(Vec3d a) { return std::sqrt(dot(a, a)); }

// What one state is measured against, computed once: direct sums of a sample, and the pull on the first body.
class Reference {
 public:
  Reference(const GravityState& state, const Share& share, const GravityBenchOptions& options)
      : share_(share), in_body_(std::span(state.in_body).subspan(share.first, share.count)) {
    const auto all = static_cast<std::int64_t>(state.position.size());
    for (std::int64_t k = 0; k < std::min(kVerified, all); ++k) {
      const auto i = static_cast<std::size_t>(all * k / std::min(kVerified, all));
      if (i >= share.first && i < share.first + share.count)
        sample_.push_back(static_cast<std::int64_t>(i - share.first));
    }
    exact_ = gravity::direct_acceleration(share.view, sample_, state.softening, comm_, options.threads);
    if (all > kMostForBody && !options.body) return;
    pull_ = gravity::pull_on_body(share.view, in_body_, state.softening, comm_, options.threads);
  }
  [[nodiscard]] gravity::FieldErrors errors(std::span<const Vec3d> a) const {
    std::vector<Vec3d> is;
    for (const std::int64_t i : sample_) is.push_back(a[static_cast<std::size_t>(i)]);
    return gravity::field_errors(is, exact_, comm_);
  }
  // Spurious acceleration of the body over the true pull on it.
  [[nodiscard]] std::optional<double> body_error(std::span<const Vec3d> a) const {
    if (!pull_) return std::nullopt;
    return norm(gravity::mean_acceleration(share_.view, in_body_, a, comm_) - *pull_) / norm(*pull_);
  }

 private:
  const Share& share_;
  std::span<const char> in_body_;
  mpi::Comm comm_;
  std::vector<std::int64_t> sample_;
  std::vector<Vec3d> exact_;
  std::optional<Vec3d> pull_;
};

Measured measure(const Share& share, const Reference& reference, DirectSlice& slice, const Setting& setting,
                 const GravityBenchOptions& options) {
  const mpi::Comm comm;
  const auto solver = gravity::make_solver(setting.kind, setting.parameters, comm, options.threads);
  std::vector<Vec3d> acceleration(share.count);
  Measured best;
  for (int k = 0; k < options.pairs; ++k) {
    comm.barrier();
    const Timing start = now();
    solver->evaluate(share.view, acceleration, {});
    best.seconds = std::min(best.seconds, seconds_since(start, options.threads));
    best.direct = std::min(best.direct, slice.seconds());
  }
  best.errors = reference.errors(acceleration);
  best.body_momentum = reference.body_error(acceleration);
  best.stats = solver->last();
  return best;
}

// Direct sums of more would take minutes.
constexpr std::int64_t kMostDirect = 2'000'000;

// The same on a device: wall time, after one evaluation that makes room. What the direct sum takes is left to its row.
Measured measure_on_device(const DeviceField& device, const Reference& reference, const Setting& setting,
                           const GravityBenchOptions& options) {
  const auto solver = device.make_solver(setting.kind, setting.parameters);
  Measured best;
  solver->evaluate_and_hold(0.0);
  for (int k = 0; k < options.pairs; ++k) {
    const double start = MPI_Wtime();
    solver->evaluate_and_hold(0.0);
    best.seconds = std::min(best.seconds, MPI_Wtime() - start);
  }
  const std::vector<Vec3d> acceleration = device.held();
  best.errors = reference.errors(acceleration);
  best.body_momentum = reference.body_error(acceleration);
  best.stats = solver->last();
  return best;
}

// The levels of gravity.md 7, or the openings asked for.
std::vector<Setting> settings(const GravityBenchOptions& options, std::int64_t n, double softening) {
  std::vector<Setting> list;
  if (options.device == "cuda" && n <= kMostDirect) {
    list.push_back({"direct", "all pairs", GravityMethod::kDirect, {.softening = softening}});
  }
  if (options.openings.empty()) {
    for (const double error : {1e-3, 3.5e-4, 1.2e-4}) {
      const gravity::Parameters p{.softening = softening, .error = error};
      list.push_back({"tree", fmt::format("error {:.1e}", error), GravityMethod::kTree, p});
    }
  }
  for (const double opening : options.openings) {
    const gravity::Parameters p{.softening = softening, .opening = opening};
    list.push_back({"tree", fmt::format("opening {:.1e}", opening), GravityMethod::kTree, p});
  }
  for (const double error : {1e-3, 3.5e-4, 1e-4}) {
    const gravity::Parameters p{.softening = softening, .error = error};
    list.push_back({"treepm", fmt::format("error {:.1e}", error), GravityMethod::kTreePm, p});
  }
  list.push_back({"auto", "default", GravityMethod::kAuto, {.softening = softening}});
  const auto& wanted = options.methods;
  std::erase_if(list, [&](const Setting& s) {
    return !wanted.empty() && std::find(wanted.begin(), wanted.end(), s.method) == wanted.end();
  });
  return list;
}

nlohmann::ordered_json as_json(char state, std::int64_t n, const Setting& setting, const Measured& m, int threads) {
  const mpi::Comm comm;
  nlohmann::ordered_json row{{"state", std::string(1, state)},
                             {"particles", n},
                             {"method", setting.method},
                             {"setting", setting.name},
                             {"chosen", gravity::name_of(m.stats.method)},
                             {"threads", threads},
                             {"ranks", comm.size()},
                             {"seconds", m.seconds},
                             {"direct_seconds", m.direct},
                             {"ratio_to_direct", m.direct / m.seconds},
                             {"rms", m.errors.rms},
                             {"p99", m.errors.p99},
                             {"max", m.errors.max},
                             {"net_momentum", m.stats.momentum_error},
                             {"boxes", m.stats.boxes},
                             {"pairs", comm.sum(m.stats.pairs)}};
  row["body_momentum"] = m.body_momentum ? nlohmann::ordered_json(*m.body_momentum) : nullptr;
  row["cell_interactions"] = comm.sum(m.stats.cell_interactions);
  row["expansions"] = comm.sum(m.stats.expansions);
  row["most_bytes_sent"] = comm.max(m.stats.bytes_sent);
  row["most_cells_imported"] = comm.max(m.stats.cells_imported);
  row["most_particles_imported"] = comm.max(m.stats.particles_imported);
  for (std::size_t k = 0; k < m.stats.phases.seconds.size(); ++k) {
    row["phases"][gravity::kPhaseNames[k]] = comm.max(m.stats.phases.seconds[k]);
  }
  return row;
}

void print(std::FILE* table, const nlohmann::ordered_json& row) {
  const auto number = [&](const char* key) { return row[key].is_null() ? NAN : row[key].get<double>(); };
  const double n = number("particles");
  fmt::print(table,
             "{:<5} {:>9} {:<8} {:<16} {:>9.1f} {:>7.1f} {:>9.1e} {:>9.1e} {:>9.1e} {:>9.1e} {:>9.2f} {:>9.3g}\n",
             row["state"].get<std::string>(), n, row["method"].get<std::string>(), row["setting"].get<std::string>(),
             1e3 * number("seconds"), number("ratio_to_direct"), number("rms"), number("p99"), number("max"),
             number("body_momentum"), 1e-9 * n * n / number("direct_seconds"), 1e-6 * number("most_bytes_sent"));
  std::fflush(table);
}

// The rows of one state.
void measure_state(char name, std::int64_t n, const GravityBenchOptions& options, std::FILE* table,
                   nlohmann::ordered_json& results) {
  const mpi::Comm comm;
  const GravityState state = gravity_state(name, n);
  const Share share(state);
  const Reference reference(state, share, options);
  std::optional<DeviceField> device;
  std::optional<DirectSlice> slice;
  if (options.device == "cuda") {
    device.emplace(state, options.precision == "double" ? Precision::kDouble : Precision::kMixed, comm);
  } else {
    slice.emplace(state, options.threads);
  }
  double direct = std::numeric_limits<double>::quiet_NaN();
  for (const Setting& setting : settings(options, n, state.softening)) {
    Measured m = device ? measure_on_device(*device, reference, setting, options)
                        : measure(share, reference, *slice, setting, options);
    if (device) {
      if (setting.kind == GravityMethod::kDirect) direct = m.seconds;
      m.direct = direct;
    }
    results.push_back(as_json(name, n, setting, m, options.threads));
    if (comm.is_root()) print(table, results.back());
  }
}

}  // namespace

void run_gravity_bench(const GravityBenchOptions& options) {
  const mpi::Comm comm;
  std::vector<std::int64_t> sizes = options.particles;
  if (sizes.empty())
    sizes = options.quick ? std::vector<std::int64_t>{94648} : std::vector<std::int64_t>{94648, 1000000};
  nlohmann::ordered_json results = nlohmann::ordered_json::array();
  std::FILE* table = options.json == "-" ? stderr : stdout;
  if (comm.is_root()) {
    fmt::print(table, "{:<5} {:>9} {:<8} {:<16} {:>9} {:>7} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9}\n", "state",
               "particles", "method", "setting", "ms", "ratio", "rms", "p99", "max", "body", "Gpair/s", "MB sent");
  }
  for (const std::int64_t n : sizes) {
    for (const char name : options.states) measure_state(name, n, options, table, results);
  }
  if (comm.is_root()) write_json(results, options.json);
}

}  // namespace breccia::bench

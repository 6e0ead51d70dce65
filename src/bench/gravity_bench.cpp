#include "bench/gravity_bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>

#include "bench/cpu_time.hpp"
#include "bench/gravity_states.hpp"
#include "bench/json_output.hpp"
#include "gravity/points.hpp"
#include "gravity/solver.hpp"
#include "gravity/verify.hpp"

namespace breccia::bench {
namespace {

constexpr std::int64_t kVerified = 10'000;

// Bodies of more particles are too dear to sum directly for their momentum.
constexpr std::int64_t kLargestBody = 100'000;

// Particles summed directly per slice: long enough to time, short enough to follow each evaluation.
constexpr std::int64_t kSlicePairs = 1'000'000'000;

// Seconds the float direct sum would take, from a slice of its targets.
class DirectSlice {
 public:
  DirectSlice(const GravityState& state, int threads) : softening_(state.softening), threads_(threads) {
    points_.fill({state.position, state.mass}, state.mass.front());
    const auto n = static_cast<std::int64_t>(state.position.size());
    groups_ = std::clamp<std::int64_t>(kSlicePairs / n / gravity::kTargetGroup, 1, n / gravity::kTargetGroup);
    scale_ = static_cast<double>(n) / static_cast<double>(groups_ * gravity::kTargetGroup);
    for (auto& s : sums_) s.assign(static_cast<std::size_t>(gravity::padded(n)), 0.0);
  }
  double seconds() {
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
    return scale_ * since(start, threads_);
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

Vec3d mean_acceleration(const GravityState& state, std::span<const Vec3d> a) {
  Vec3d force{};
  double mass = 0.0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(state.body); ++i) {
    force += state.mass[i] * a[i];
    mass += state.mass[i];
  }
  return (1.0 / mass) * force;
}

double norm(Vec3d a) { return std::sqrt(dot(a, a)); }

// What one state is measured against, computed once.
class Reference {
 public:
  Reference(const GravityState& state, int threads) : state_(state) {
    if (state.body > kLargestBody) return;
    std::vector<std::int64_t> body(static_cast<std::size_t>(state.body));
    std::iota(body.begin(), body.end(), 0);
    const mpi::Comm self(MPI_COMM_SELF);
    pull_ = mean_acceleration(
        state, gravity::direct_acceleration({state.position, state.mass}, body, state.softening, self, threads));
  }
  // Spurious acceleration of the body over the true pull on it.
  [[nodiscard]] std::optional<double> body_error(std::span<const Vec3d> a) const {
    if (!pull_) return std::nullopt;
    return norm(mean_acceleration(state_, a) - *pull_) / norm(*pull_);
  }

 private:
  const GravityState& state_;
  std::optional<Vec3d> pull_;
};

Measured measure(const GravityState& state, const Reference& reference, DirectSlice& slice, const Setting& setting,
                 const GravityBenchOptions& options) {
  const mpi::Comm self(MPI_COMM_SELF);
  const gravity::ParticlesView view{state.position, state.mass};
  const auto solver = gravity::make_solver(setting.kind, setting.parameters, self, options.threads);
  std::vector<Vec3d> acceleration(state.position.size());
  Measured best;
  for (int k = 0; k < options.pairs; ++k) {
    const Timing start = now();
    solver->evaluate(view, acceleration, {});
    best.seconds = std::min(best.seconds, since(start, options.threads));
    best.direct = std::min(best.direct, slice.seconds());
  }
  best.errors = verify(view, acceleration, state.softening, kVerified, self, options.threads);
  best.body_momentum = reference.body_error(acceleration);
  best.stats = solver->last();
  return best;
}

// The levels of gravity.md 7, or the openings asked for.
std::vector<Setting> settings(const GravityBenchOptions& options, double softening) {
  std::vector<Setting> list;
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
  return list;
}

}  // namespace

void run_gravity_bench(const GravityBenchOptions& options) {
  std::vector<std::int64_t> sizes = options.particles;
  if (sizes.empty())
    sizes = options.quick ? std::vector<std::int64_t>{94648} : std::vector<std::int64_t>{94648, 1000000};
  nlohmann::ordered_json results = nlohmann::ordered_json::array();
  std::FILE* table = options.json == "-" ? stderr : stdout;
  fmt::print(table, "{:<5} {:>9} {:<8} {:<16} {:>9} {:>7} {:>9} {:>9} {:>9} {:>9} {:>9}\n", "state", "particles",
             "method", "setting", "ms", "ratio", "rms", "p99", "max", "body", "Gpair/s");
  for (const std::int64_t n : sizes) {
    for (const char name : options.states) {
      const GravityState state = gravity_state(name, n);
      const Reference reference(state, options.threads);
      DirectSlice slice(state, options.threads);
      for (const Setting& setting : settings(options, state.softening)) {
        const Measured m = measure(state, reference, slice, setting, options);
        fmt::print(table, "{:<5} {:>9} {:<8} {:<16} {:>9.1f} {:>7.1f} {:>9.1e} {:>9.1e} {:>9.1e} {:>9.1e} {:>9.2f}\n",
                   name, n, setting.method, setting.name, 1e3 * m.seconds, m.direct / m.seconds, m.errors.rms,
                   m.errors.p99, m.errors.max, m.body_momentum.value_or(NAN),
                   1e-9 * static_cast<double>(n * n) / m.direct);
        std::fflush(table);
        nlohmann::ordered_json row{{"state", std::string(1, name)}, {"particles", n},
                                   {"method", setting.method},      {"setting", setting.name},
                                   {"threads", options.threads},    {"seconds", m.seconds},
                                   {"direct_seconds", m.direct},    {"ratio_to_direct", m.direct / m.seconds},
                                   {"rms", m.errors.rms},           {"p99", m.errors.p99},
                                   {"max", m.errors.max},           {"net_momentum", m.stats.momentum_error}};
        for (std::size_t k = 0; k < m.stats.phases.seconds.size(); ++k) {
          row["phases"][gravity::kPhaseNames[k]] = m.stats.phases.seconds[k];
        }
        row["body_momentum"] = m.body_momentum ? nlohmann::ordered_json(*m.body_momentum) : nullptr;
        results.push_back(row);
      }
    }
  }
  write_json(results, options.json);
}

}  // namespace breccia::bench

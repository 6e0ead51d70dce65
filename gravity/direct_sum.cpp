#include "gravity/direct_sum.hpp"

#include <algorithm>

#include "breccia/constants.hpp"
#include "gravity/evaluation.hpp"
#include "gravity/pair_kernel.hpp"

namespace breccia::gravity {
namespace {

// MPI moves large messages only inside its calls, so the sum is cut into this many slices with a call after each.
constexpr std::int64_t kSlices = 16;

constexpr int kRingTag = 71;

}  // namespace

DirectSum::DirectSum(const Parameters& parameters, const mpi::Comm& comm, int threads)
    : parameters_(parameters), comm_(comm), threads_(std::max(threads, 1)) {}

void DirectSum::evaluate(ParticlesView particles, std::span<Vec3d> acceleration, std::span<double> potential) {
  check_sizes(particles, acceleration, potential);
  stats_ = {.method = GravityMethod::kDirect};
  const Stopwatch watch(stats_.seconds);
  const auto targets = static_cast<std::size_t>(padded(static_cast<std::int64_t>(particles.position.size())));
  for (std::size_t c = 0; c < 4; ++c) sums_[c].assign(c < 3 || !potential.empty() ? targets : 0, 0.0);

  const double mass_unit = heaviest(particles.mass, comm_);
  stats_.phases.time(Phase::kPairs, [&] {
    if (parameters_.precision == Precision::kMixed) {
      sum_over_ring(float_ring_, particles, mass_unit);
    } else {
      sum_over_ring(double_ring_, particles, mass_unit);
    }
  });
  write(particles, mass_unit, acceleration, potential);
  const auto all = static_cast<double>(comm_.sum(static_cast<std::uint64_t>(particles.position.size())));
  work_.assign(particles.position.size(), all);

  book_momentum(particles, acceleration, comm_, stats_);
}

template <class Real>
void DirectSum::sum_over_ring(Ring<Real>& ring, ParticlesView particles, double mass_unit) {
  const int ranks = comm_.size();
  const std::vector<std::int64_t> counts = comm_.allgather(static_cast<std::int64_t>(particles.position.size()));
  const auto origin = [&](int step) { return static_cast<std::size_t>((comm_.rank() - step + ranks) % ranks); };
  const int next = (comm_.rank() + 1) % ranks;
  const int previous = static_cast<int>(origin(1));

  ring.own.fill(particles, mass_unit);
  ring.here = ring.own;
  for (int step = 0; step < ranks; ++step) {
    std::array<MPI_Request, 2> in_flight{MPI_REQUEST_NULL, MPI_REQUEST_NULL};
    if (step + 1 < ranks) {
      ring.arriving.resize(counts[origin(step + 1)]);
      auto& incoming = ring.arriving.data();
      auto& outgoing = ring.here.data();
      MPI_Irecv(incoming.data(), static_cast<int>(incoming.size()), mpi::datatype<Real>(), previous, kRingTag,
                comm_.handle(), &in_flight[0]);
      MPI_Isend(outgoing.data(), static_cast<int>(outgoing.size()), mpi::datatype<Real>(), next, kRingTag,
                comm_.handle(), &in_flight[1]);
      stats_.bytes_sent += static_cast<double>(outgoing.size() * sizeof(Real));
    }
    sum_over_sources(ring.own, ring.here, step == 0, in_flight);
    MPI_Waitall(2, in_flight.data(), MPI_STATUSES_IGNORE);
    std::swap(ring.here, ring.arriving);
  }
}

template <class Real>
void DirectSum::sum_over_sources(const Points<Real>& own, const Points<Real>& sources, bool same,
                                 std::array<MPI_Request, 2>& in_flight) {
  const PairTask<Real> whole{.targets = own.arrays(),
                             .begin = 0,
                             .end = 0,
                             .sources = sources.arrays(),
                             .same = same,
                             .softening_squared = static_cast<Real>(parameters_.softening * parameters_.softening),
                             .acceleration = {sums_[0].data(), sums_[1].data(), sums_[2].data()},
                             .potential = sums_[3].empty() ? nullptr : sums_[3].data()};
  const std::int64_t groups = padded(whole.targets.count) / kTargetGroup;
  for (std::int64_t slice = 0; slice < kSlices; ++slice) {
    const std::int64_t first = groups * slice / kSlices;
    const std::int64_t last = groups * (slice + 1) / kSlices;
#pragma omp parallel for num_threads(threads_) schedule(static)
    for (std::int64_t group = first; group < last; ++group) {
      PairTask<Real> task = whole;
      task.begin = group * kTargetGroup;
      task.end = task.begin + kTargetGroup;
      sum_pairs(task);
    }
    int done = 0;
    MPI_Testall(2, in_flight.data(), &done, MPI_STATUSES_IGNORE);
  }
  stats_.pairs += static_cast<double>(whole.targets.count) * static_cast<double>(whole.sources.count);
}

void DirectSum::write(ParticlesView particles, double mass_unit, std::span<Vec3d> acceleration,
                      std::span<double> potential) {
  const double unit = kGravitationalConstant * mass_unit;
  for (std::size_t i = 0; i < particles.position.size(); ++i) {
    acceleration[i] = unit * Vec3d{sums_[0][i], sums_[1][i], sums_[2][i]};
  }
  for (std::size_t i = 0; i < potential.size(); ++i) potential[i] = unit * sums_[3][i];
}

}  // namespace breccia::gravity

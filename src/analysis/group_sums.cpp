#include "analysis/group_sums.hpp"

#include <algorithm>
#include <unordered_map>

namespace breccia::analysis {
namespace {

using Partials = std::vector<std::vector<GroupSums>>;  // one list for each rank

// The groups that have members here. Each is looked after by one rank, its keeper, found from the label.
class LocalGroups {
 public:
  LocalGroups(std::span<const std::uint64_t> label, int ranks) : partials_(static_cast<std::size_t>(ranks)) {
    std::unordered_map<std::uint64_t, Slot> slot_of;
    slots_.reserve(label.size());
    for (const std::uint64_t l : label) {
      const std::uint64_t keeper = l % static_cast<std::uint64_t>(ranks);
      const auto [entry, is_new] = slot_of.try_emplace(l, Slot{keeper, partials_[keeper].size()});
      if (is_new) partials_[keeper].emplace_back().label = l;
      slots_.push_back(entry->second);
    }
  }

  GroupSums& of_particle(std::size_t i) { return partials_[slots_[i].keeper][slots_[i].index]; }
  [[nodiscard]] const Partials& partials() const { return partials_; }
  void set_partials(Partials partials) { partials_ = std::move(partials); }

 private:
  struct Slot {
    std::uint64_t keeper;
    std::size_t index;
  };
  std::vector<Slot> slots_;
  Partials partials_;
};

// The keeper's view: what came from each rank, and the totals.
class KeptGroups {
 public:
  explicit KeptGroups(Partials from_ranks) : from_ranks_(std::move(from_ranks)) {
    for (const auto& list : from_ranks_) {
      for (const GroupSums& part : list) {
        const auto [entry, is_new] = index_of_.try_emplace(part.label, totals_.size());
        if (is_new) totals_.emplace_back().label = part.label;
        GroupSums& total = totals_[entry->second];
        total.particles += part.particles;
        total.mass += part.mass;
        total.position += part.position;  // moments, until divide_by_mass
        total.velocity += part.velocity;
      }
    }
  }

  void divide_by_mass() {
    for (GroupSums& total : totals_) {
      const double per_mass = total.mass > 0.0 ? 1.0 / total.mass : 0.0;
      total.position = per_mass * total.position;
      total.velocity = per_mass * total.velocity;
    }
  }

  void add_second_order(const Partials& from_ranks) {
    for (const auto& list : from_ranks) {
      for (const GroupSums& part : list) {
        GroupSums& total = totals_[index_of_.at(part.label)];
        total.angular_momentum += part.angular_momentum;
        total.second_moment = total.second_moment + part.second_moment;
      }
    }
  }

  // The totals in the order of the parts that came.
  [[nodiscard]] Partials replies() const {
    Partials to = from_ranks_;
    for (auto& list : to) {
      for (GroupSums& part : list) part = totals_[index_of_.at(part.label)];
    }
    return to;
  }
  [[nodiscard]] const std::vector<GroupSums>& totals() const { return totals_; }

 private:
  Partials from_ranks_;
  std::unordered_map<std::uint64_t, std::size_t> index_of_;
  std::vector<GroupSums> totals_;
};

void add_first_order(const ParticleArrays& particles, LocalGroups& local) {
  for (std::size_t i = 0; i < particles.size(); ++i) {
    GroupSums& group = local.of_particle(i);
    const double m = particles.mass[i];
    ++group.particles;
    group.mass += m;
    group.position += m * particles.position[i];
    group.velocity += m * particles.velocity[i];
  }
}

// About the centres of mass: absolute positions of 1e7 m would cancel.
void add_second_order(const ParticleArrays& particles, LocalGroups& local) {
  for (std::size_t i = 0; i < particles.size(); ++i) {
    GroupSums& group = local.of_particle(i);
    const double m = particles.mass[i];
    const Vec3d x = particles.position[i] - group.position;
    const Vec3d v = particles.velocity[i] - group.velocity;
    group.angular_momentum += m * cross(x, v);
    group.second_moment =
        group.second_moment + m * Sym3<double>{x.x * x.x, x.y * x.y, x.z * x.z, x.x * x.y, x.x * x.z, x.y * x.z};
  }
}

Groups collect(const std::vector<GroupSums>& kept, const mpi::Comm& comm) {
  Groups result;
  std::vector<GroupSums> mine;
  for (const GroupSums& group : kept) {
    if (group.particles > 1) {
      mine.push_back(group);
    } else {
      ++result.singles.particles;
      result.singles.mass += group.mass;
    }
  }
  result.groups = comm.allgather_arrays(std::span<const GroupSums>(mine));
  std::sort(result.groups.begin(), result.groups.end(), [](const GroupSums& a, const GroupSums& b) {
    return a.mass != b.mass ? a.mass > b.mass : a.label < b.label;
  });
  result.singles = {comm.sum(result.singles.particles), comm.sum(result.singles.mass)};
  return result;
}

}  // namespace

Groups sum_groups(const ParticleArrays& particles, std::span<const std::uint64_t> label, const mpi::Comm& comm) {
  LocalGroups local(label, comm.size());
  add_first_order(particles, local);
  KeptGroups kept(comm.alltoall(local.partials()));
  kept.divide_by_mass();
  local.set_partials(comm.alltoall(kept.replies()));
  add_second_order(particles, local);
  kept.add_second_order(comm.alltoall(local.partials()));
  return collect(kept.totals(), comm);
}

}  // namespace breccia::analysis

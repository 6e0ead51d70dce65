#include "gravity/tree/essential.hpp"

#include <cmath>

#include "gravity/tree/opening.hpp"

namespace breccia::gravity {
namespace {

// A cell on its way. What it does not name stays with its rank.
struct SentCell {
  Vec3d centre;
  double mass, radius;
  float second[6];
  std::int32_t count;      // particles in it
  std::int32_t children;   // that follow
  std::int32_t particles;  // that follow
  std::int32_t top;        // leaf of the top it is, or -1
};

struct SentParticle {
  Vec3d position;
  double mass;
};

// All that one rank needs. Cells come in the order of a search in breadth: first the opened leaves of the top.
struct Parcel {
  std::vector<SentCell> cells;
  std::vector<SentParticle> particles;
};

// Plays the walks of one rank's targets over the cells below this rank's leaves, and notes which of them are opened.
// Cells of the top are the same on both, so there it knows; what happens below another rank's leaf it bounds.
class Opener {
 public:
  Opener(const Tree& sources, const SharedTree& targets, const std::vector<char>& wanted, double tolerance,
         std::vector<char>& opened)
      : sources_(sources), targets_(targets), wanted_(wanted), tolerance_(tolerance), opened_(opened) {}

  void run(const std::vector<const TopLeaf*>& leaf_of) {
    leaf_of_ = &leaf_of;
    candidates_.assign(1, 0);
    if (!targets_.tree().cells.empty() && wanted_[0] != 0) visit(0, 0, 1);
  }

 private:
  void open(std::int32_t s) {
    const Cell& source = sources_.cell(s);
    opened_[static_cast<std::size_t>(s)] = 1;
    for (std::int32_t c = source.first_child + source.children; c-- > source.first_child;) {
      // Only cells with particles of this rank lead to anything it could send.
      if (sources_.cell(c).end > sources_.cell(c).begin) stack_.push_back(c);
    }
  }

  void visit(std::int32_t t, std::size_t begin, std::size_t end) {
    const Cell& target = targets_.tree().cell(t);
    const double allowed = tolerance_ * targets_.scales()[static_cast<std::size_t>(t)];
    const TopLeaf* leaf = (*leaf_of_)[static_cast<std::size_t>(t)];
    const std::size_t first = candidates_.size();
    for (std::size_t k = begin; k < end; ++k) {
      stack_.assign(1, candidates_[k]);
      while (!stack_.empty()) {
        const std::int32_t s = stack_.back();
        stack_.pop_back();
        const Cell& source = sources_.cell(s);
        if (leaf != nullptr) {
          if (may_be_opened(source, target, *leaf, allowed)) open(s);
        } else if (expandable(source, target, allowed)) {
          continue;
        } else if (!source.is_leaf() && source.radius >= target.radius) {
          open(s);
        } else {
          candidates_.push_back(s);
        }
      }
    }
    if (leaf == nullptr) {
      const std::size_t last = candidates_.size();
      for (std::int32_t c = target.first_child; c < target.first_child + target.children; ++c) {
        if (wanted_[static_cast<std::size_t>(c)] != 0) visit(c, first, last);
      }
    }
    candidates_.resize(first);
  }

  // Whether any target in a leaf of the top may open the source. Of those inside, with centre T and radius R,
  // |T - centre| + R <= reach: their particles are at least D - reach away, and so is T by R more.
  [[nodiscard]] static bool may_be_opened(const Cell& source, const Cell& leaf, const TopLeaf& top, double allowed) {
    if (source.count <= kFewParticles) return true;
    if (leaf.count <= kGroupParticles && !top.may_be_divided) return opening(source, leaf, allowed) == Opening::kOpen;
    const Vec3d d = leaf.centre - source.centre;
    const double nearest = (1.0 - 1e-9) * (std::sqrt(dot(d, d)) - top.reach);
    const double b = source.radius;
    if (nearest <= b / kLargestOpening) return true;
    using detail::square;
    const double octupole = kOctupole * source.moments.mass * (b * b * b);
    if (octupole >= allowed * square(square(nearest)) * nearest) return true;
    if (source.is_leaf()) return false;
    // Cells above the groups open a source as large as they are unless they can expand it: R <= b.
    const double x = 2.0 * b / (nearest + b);
    if (x >= kLargestOpening) return true;
    const double rest = square(1.0 - x);
    const double ratio = b / nearest;
    return source.moments.mass * (square(square(x)) + kOctupole * (ratio * ratio * ratio) * rest) >=
           allowed * square(nearest) * rest;
  }

  const Tree& sources_;
  const SharedTree& targets_;
  const std::vector<char>& wanted_;
  double tolerance_;
  std::vector<char>& opened_;
  const std::vector<const TopLeaf*>* leaf_of_ = nullptr;
  std::vector<std::int32_t> candidates_, stack_;
};

std::vector<const TopLeaf*> leaves_by_cell(const SharedTree& tree) {
  std::vector<const TopLeaf*> leaf_of(tree.top_size(), nullptr);
  for (const TopLeaf& leaf : tree.leaves()) leaf_of[static_cast<std::size_t>(leaf.cell)] = &leaf;
  return leaf_of;
}

// Cells of the top that hold targets of `rank`.
std::vector<char> wanted_by(const SharedTree& tree, int rank) {
  std::vector<char> wanted(tree.top_size(), 0);
  for (const TopLeaf& leaf : tree.leaves()) wanted[static_cast<std::size_t>(leaf.cell)] = leaf.owner == rank ? 1 : 0;
  const std::vector<const TopLeaf*> leaf_of = leaves_by_cell(tree);
  for (std::size_t i = wanted.size(); i-- > 0;) {
    if (leaf_of[i] != nullptr) continue;
    const Cell& c = tree.tree().cells[i];
    for (std::int32_t k = c.first_child; k < c.first_child + c.children; ++k) {
      if (wanted[static_cast<std::size_t>(k)] != 0) wanted[i] = 1;
    }
  }
  return wanted;
}

SentCell sent(const Tree& tree, std::int32_t i, bool opened, std::int32_t top) {
  const Cell& c = tree.cell(i);
  const Sym3<double>& s = c.moments.second;
  SentCell cell{c.centre, c.moments.mass, c.radius, {}, static_cast<std::int32_t>(c.count), 0, 0, top};
  const double second[6] = {s.xx, s.yy, s.zz, s.xy, s.xz, s.yz};
  for (int k = 0; k < 6; ++k) cell.second[k] = static_cast<float>(second[k]);
  if (opened && c.is_leaf()) cell.particles = c.end - c.begin;
  if (opened && !c.is_leaf()) cell.children = c.children;
  return cell;
}

Parcel pack(const SharedTree& sources, const std::vector<char>& opened, int rank) {
  const Tree& tree = sources.tree();
  Parcel parcel;
  std::vector<std::int32_t> queue;
  const auto add = [&](std::int32_t i, std::int32_t top) {
    const bool is_opened = opened[static_cast<std::size_t>(i)] != 0;
    parcel.cells.push_back(sent(tree, i, is_opened, top));
    if (is_opened) queue.push_back(i);
  };
  for (const TopLeaf& leaf : sources.leaves()) {
    if (leaf.owner == rank && opened[static_cast<std::size_t>(leaf.cell)] != 0) add(leaf.cell, leaf.cell);
  }
  for (std::size_t next = 0; next < queue.size();) {
    const Cell& c = tree.cell(queue[next++]);
    for (std::int32_t k = 0; k < c.children; ++k) add(c.first_child + k, -1);
    for (std::int64_t i = c.begin; c.is_leaf() && i < c.end; ++i) {
      parcel.particles.push_back({tree.particles.position(i), tree.particles.mass[static_cast<std::size_t>(i)]});
    }
  }
  return parcel;
}

void graft(Tree& tree, const std::vector<SentCell>& cells, const std::vector<SentParticle>& particles) {
  // Where in the tree each cell that was sent lies; children are met in the order of their parents.
  std::vector<std::int32_t> place(cells.size(), -1);
  std::size_t next_child = 0, next_particle = 0;
  while (next_child < cells.size() && cells[next_child].top >= 0) {
    place[next_child] = cells[next_child].top;
    ++next_child;
  }
  for (std::size_t q = 0; q < cells.size(); ++q) {
    const SentCell& from = cells[q];
    const auto first = static_cast<std::int32_t>(tree.cells.size());
    for (std::int32_t k = 0; k < from.children; ++k, ++next_child) {
      const SentCell& c = cells[next_child];
      place[next_child] = static_cast<std::int32_t>(tree.cells.size());
      Cell child;
      child.count = c.count;
      child.radius = c.radius;
      child.centre = c.centre;
      child.moments = {c.mass, {c.second[0], c.second[1], c.second[2], c.second[3], c.second[4], c.second[5]}};
      child.is_target = false;
      child.children = kUnknownChildren;
      tree.cells.push_back(child);
    }
    Cell& cell = tree.cells[static_cast<std::size_t>(place[q])];
    if (from.children > 0) {
      cell.first_child = first;
      cell.children = from.children;
    }
    if (from.particles > 0) {
      cell.begin = static_cast<std::int32_t>(tree.particles.x.size());
      for (std::int32_t k = 0; k < from.particles; ++k, ++next_particle) {
        tree.particles.append(particles[next_particle].position, particles[next_particle].mass);
      }
      cell.end = static_cast<std::int32_t>(tree.particles.x.size());
      cell.children = 0;
    }
  }
}

}  // namespace

EssentialCount import_essential(SharedTree& sources, std::span<const SharedTree* const> targets, double tolerance,
                                const mpi::Comm& comm) {
  EssentialCount count;
  if (comm.size() == 1) return count;
  std::vector<std::vector<const TopLeaf*>> leaf_of;
  for (const SharedTree* t : targets) leaf_of.push_back(leaves_by_cell(*t));

  const auto ranks = static_cast<std::size_t>(comm.size());
  std::vector<std::vector<SentCell>> cells(ranks);
  std::vector<std::vector<SentParticle>> particles(ranks);
  std::vector<char> opened;
  for (std::size_t r = 0; r < ranks; ++r) {
    const Tree& tree = sources.tree();
    if (static_cast<int>(r) == comm.rank() || tree.cells.empty() || !tree.cell(0).is_target) continue;
    opened.assign(tree.cells.size(), 0);
    for (std::size_t k = 0; k < targets.size(); ++k) {
      const std::vector<char> wanted = wanted_by(*targets[k], static_cast<int>(r));
      Opener(tree, *targets[k], wanted, tolerance, opened).run(leaf_of[k]);
    }
    Parcel parcel = pack(sources, opened, comm.rank());
    count.bytes_sent +=
        static_cast<double>(parcel.cells.size() * sizeof(SentCell) + parcel.particles.size() * sizeof(SentParticle));
    cells[r] = std::move(parcel.cells);
    particles[r] = std::move(parcel.particles);
  }
  const auto cells_here = comm.alltoall(cells);
  const auto particles_here = comm.alltoall(particles);
  for (std::size_t r = 0; r < ranks; ++r) {
    graft(sources.tree(), cells_here[r], particles_here[r]);
    count.cells += static_cast<double>(cells_here[r].size());
    count.particles += static_cast<double>(particles_here[r].size());
  }
  return count;
}

}  // namespace breccia::gravity

// The engine on host cores: threads over planes of tiles, each even plane before its odd neighbours, so that no node is
// written twice at once and sums are the same for any number of threads.
#pragma once

#include <algorithm>

#include "grid/blocks.hpp"
#include "grid/boundary.hpp"
#include "grid/cell_counts.hpp"
#include "grid/engine.hpp"
#include "grid/occupancy.hpp"
#include "grid/ordered_sums.hpp"
#include "grid/period_images.hpp"
#include "grid/sweep_board.hpp"
#include "grid/sweep_plan.hpp"
#include "grid/tile.hpp"
#include "mpi/halo.hpp"
#include "mpi/slabs.hpp"
#include "mpi/standing_requests.hpp"

namespace breccia::grid {

/// What a thread finds of the particles it settles.
struct SettledShare {
  Occupancy occupancy;
  std::vector<std::vector<std::byte>> leaving;  ///< records, by rank
};

/// Nodes of a block that a rank asks their owner for: bit n for the plane n across the slabs.
struct BlockRequest {
  BlockKey key;
  std::uint32_t planes;
  friend bool operator==(const BlockRequest&, const BlockRequest&) = default;
};

template <class P>
class HostEngine final : public Engine {
 public:
  using Real = typename P::Real;

  HostEngine(const EngineSetup& setup, const mpi::Comm& comm);

  void insert(const ParticleArrays& particles, const material::FlawLists& flaws,
              std::span<const Vec3d> spin_of_body) override;
  [[nodiscard]] EngineState save() const override;
  [[nodiscard]] material::FlawLists flaws() const override;
  void restore(const EngineState& state, const material::FlawLists& flaws) override;
  double sort() override;
  [[nodiscard]] double work_beyond_period() const override;
  [[nodiscard]] const mpi::Slabs& slabs() const override { return slabs_; }
  [[nodiscard]] mpi::PlaneWork work(std::span<const double> more) const override;
  void cut(const mpi::Slabs& slabs) override;
  void scatter(double half_step) override;
  void update_grid(double kick) override;
  void gather(double step) override;
  void gather_scatter(double step) override;
  void predict(double time, std::vector<Vec3d>& position, std::vector<double>& mass) const override;
  void hold_gravity(std::span<const Vec3d> acceleration) override;
  void kick_velocities(double time) override;
  [[nodiscard]] ParticleOutput observe() const override;
  [[nodiscard]] ParticleOutput inspect() const override;
  [[nodiscard]] bool strayed() const override { return strayed_packs_ != 0 || boundary_strayed() || lone_strayed(); }
  [[nodiscard]] std::optional<ParticleSample> fastest() const override;
  [[nodiscard]] std::vector<double> volume_ratios() const override;
  [[nodiscard]] double elastic_energy() const override;
  [[nodiscard]] SignalSpeeds signal_speeds() const override;
  bool finish_damage() override;
  [[nodiscard]] PassReport passes() const override { return report_; }
  [[nodiscard]] EngineStats stats() const override;
  void record(Timeline* timeline) override { timeline_ = timeline; }

 private:
  static constexpr std::size_t kLanes = P::kLanes;
  static constexpr std::uint32_t packs_for(std::uint32_t particles) { return (particles + P::kLanes - 1) / P::kLanes; }

  // Passes (host_engine.cpp, host_engine_sweep.cpp).
  PassArguments<P> pass_arguments(double step, double half_step);
  NodeArguments<P> node_arguments(double kick);
  void run_pass(const PassArguments<P>& arguments, const NodeArguments<P>* trailing = nullptr);
  void book(std::span<const TileReport> reports);
  void report_fault();
  void run_work(SweepWork work, const SweepPlane& plane, const PassArguments<P>& arguments,
                const NodeArguments<P>* trailing, std::vector<TileReport>& reports);
  void update_stack(const Tile& tile, const NodeArguments<P>& arguments);

  // Memory (host_engine_memory.cpp).
  [[nodiscard]] bool has_few_nodes() const;   // beside particles
  [[nodiscard]] bool outgrows_cache() const;  // so that nodes come from memory in every step
  [[nodiscard]] std::size_t places() const { return node_places_; }
  [[nodiscard]] std::uint32_t velocity_half(std::uint32_t place, std::uint32_t h) const {
    return kernels_.velocity_half(place, h, places());
  }
  void hold(LargeArray<Real>& values, std::size_t places);
  void hold_sums();
  void hold_velocities();
  void drop_sums();  // and the next: where nodes are few
  void drop_velocities();
  void drop_gradients();
  [[nodiscard]] std::size_t bytes_held() const;
  void count_bytes(std::size_t beside);  // held now, with some beside

  // Exchange with other ranks (host_engine_halo.cpp).
  [[nodiscard]] bool has_neighbours() const { return !sum_exchange_.empty() || !velocity_exchange_.empty(); }
  void send_sums();                                       // once the boundary tiles have scattered
  void progress(const NodeArguments<P>* arguments);       // of messages; null: the kick is not known yet
  void update_shared(const NodeArguments<P>& arguments);  // with the sums that have arrived; sends velocities
  void finish_sums(const NodeArguments<P>& arguments);
  void finish_velocities();
  void copy_to_images(std::span<const PeriodImages::Image> images);
  void wait_for_velocities();
  // Calls work(); its time is a bar of the timeline.
  template <class F>
  void noted(const char* name, F&& work) {
    const auto begin = Timeline::Clock::now();
    work();
    note(name, Timeline::Lane::kTiles, begin, Timeline::Clock::now());
  }
  void note(const char* name, Timeline::Lane lane, Timeline::Clock::time_point begin, Timeline::Clock::time_point end) {
    if (timeline_ != nullptr) timeline_->add(name, lane, begin, end);
  }

  // Sorting and migration (host_engine_sort.cpp, _arrange, _migrate.cpp, _lone.cpp, _connect.cpp, _insert.cpp,
  // _slabs.cpp).
  void settle(std::span<const Placement> placements);
  template <class F>
  void settle_shares(std::span<const std::uint32_t> bounds, F&& for_each_placement);
  Occupancy join_shares(std::span<SettledShare> shares, std::span<const std::uint32_t> bounds);
  [[nodiscard]] std::vector<std::uint32_t> share_packs() const;
  void choose_slabs(std::span<const Placement> placements);
  [[nodiscard]] Placement place(std::size_t slot, BlockCoord stack) const;  // of a particle that has moved
  [[nodiscard]] double work_of_periods() const;  // of the uniform field, before particles are put back
  [[nodiscard]] std::vector<Placement> place_all() const;
  void require_in_grid() const;
  void set_destination(BlockCell cell, std::size_t slot);
  void put_record(const Placement& p, std::vector<std::byte>& message);  // of a particle that leaves
  void take_records(const std::vector<std::vector<std::byte>>& messages, Occupancy& occupancy);
  [[nodiscard]] std::vector<char> find_lone(Occupancy& occupancy) const;  // for each block of it
  void tell_neighbours(Occupancy& occupancy) const;                       // of what this rank's blocks hold
  // By more than a node since the last sorting: other ranks know of no node that far.
  [[nodiscard]] bool boundary_strayed() const;
  [[nodiscard]] bool has_drifted(std::size_t slot, std::int32_t sorted_node) const;
  [[nodiscard]] bool lone_strayed() const;  // more than a node since the last sorting
  // Calls visit(slot, cell) for the particles of packs first .. last - 1 that have been sent to a cell, in the order of
  // their slots.
  template <class F>
  void for_each_destination(std::size_t first, std::size_t last, F&& visit) const {
    for (std::size_t p = first; p < last; ++p) {
      const Kinematics<P>& k = store_.kinematics[p];
      for (std::size_t l = 0; l < kLanes; ++l) {
        const int lane = static_cast<int>(l);
        if (k.mass[lane] > Real(0)) visit(p * kLanes + l, BlockCell::of(k.node[lane]));
      }
    }
  }
  void arrange(Occupancy& occupancy);
  [[nodiscard]] std::vector<std::uint32_t> order_particles(const Occupancy& occupancy,
                                                           std::span<const std::uint32_t> tile_of_block);
  void lay_out_tiles(CellCounts& counts);
  [[nodiscard]] std::vector<std::uint32_t> find_tiles(const Occupancy& occupancy, std::span<const char> lone);
  void connect_tiles();
  [[nodiscard]] std::vector<SweepTile> sweep_tiles() const;
  void insert_stacks();
  [[nodiscard]] std::vector<std::vector<BlockRequest>> reach_blocks();
  void connect_halo();
  [[nodiscard]] std::vector<mpi::SharedNodes> nodes_of(const std::vector<std::vector<BlockRequest>>& requests) const;
  [[nodiscard]] std::vector<mpi::SharedNodes> velocity_halves_of(const std::vector<mpi::SharedNodes>& peers) const;
  [[nodiscard]] BlockCoord stored(BlockCoord block) const;  // as whose nodes those of a tile's block lie in memory
  std::uint32_t insert_owned(BlockCoord stored_block);      // its index
  void share_with_images();
  void sort_cells_by_id(std::span<std::uint32_t> source, const CellCounts& ends) const;
  void compact_flaws();
  void switch_damage_off();

  // Of a checkpoint (host_engine_checkpoint.cpp).
  void save_flaws(std::span<const Placement> placements, EngineState& state) const;
  std::vector<Placement> restore_places(const EngineState& state);
  void restore_field(const FieldDescriptor& field, const EngineState& state);
  void restore_flaws(const EngineState& state, const material::FlawLists& flaws);
  void take_flaws(const material::FlawLists& flaws);  // into the arena
  // The flaws of list `row` become those of `slot`; the first `active` of them grow already.
  void set_flaws(std::size_t slot, const material::FlawLists& flaws, std::size_t row, std::uint32_t active);

  // Slabs. Planes are those of nodes across the slabs; sets of the four of a block have bit n for its plane n.
  [[nodiscard]] int owner(const Placement& p) const { return slabs_.owner(p.node[slabs_.axis()]); }
  [[nodiscard]] std::int32_t first_plane(BlockCoord block) const {
    return kBlockWidth * component(block, slabs_.axis());
  }
  [[nodiscard]] std::uint32_t own_planes(BlockCoord block) const;
  static constexpr std::uint32_t kAllPlanes = 0b1111;
  [[nodiscard]] std::size_t plane_in_stack(std::size_t slot) const;  // of a particle's node, just after a sorting
  [[nodiscard]] std::int32_t planes_kept_together(int axis) const;   // no cut runs between them

  // Calls visit(slot, stack) for every particle, in storage order; its node is relative to that block.
  template <class F>
  void for_each_particle(F&& visit) const {
    for_each_particle_of(0, static_cast<std::uint32_t>(store_.packs()), visit);
  }
  // The same of the tiles that begin, and the particles without grid that lie, in the packs first .. last - 1.
  template <class F>
  void for_each_particle_of(std::uint32_t first, std::uint32_t last, F&& visit) const {
    auto tile = std::ranges::lower_bound(tiles_, first, {}, &Tile::first_pack);
    for (; tile != tiles_.end() && tile->first_pack < last; ++tile) {
      const BlockCoord stack = block_coord(stacks_[static_cast<std::size_t>(tile - tiles_.begin())]);
      for (std::uint32_t n = 0; n < tile->particles; ++n) visit(tile->first_pack * kLanes + n, stack);
    }
    const auto lone_before = [&](std::uint32_t pack) {
      const std::size_t lanes = kLanes * (std::max(pack, lone_.first_pack) - lone_.first_pack);
      return std::min(lanes, std::size_t{lone_.particles});
    };
    for (std::size_t n = lone_before(first); n < lone_before(last); ++n) {
      visit(lone_.first_pack * kLanes + n, lone_stack_[n]);
    }
  }
  // Of an observation: what the grid says of each slot; empty vectors without a grid.
  struct GridView {
    std::vector<Real> new_velocity, node_mass, gradient;
  };
  [[nodiscard]] GridView probe() const;
  [[nodiscard]] ParticleOutput read_particles(const GridView& grid) const;
  [[nodiscard]] ParticleSample sample(std::size_t slot, BlockCoord block) const;
  [[nodiscard]] Placement node_of(std::size_t slot, BlockCoord stack) const;  // not put back into a period
  [[nodiscard]] Vec3d unfolded_position(std::size_t slot, BlockCoord block) const;
  [[nodiscard]] Vec3d position(std::size_t slot, BlockCoord block) const;
  [[nodiscard]] double mass(std::size_t slot) const {
    return static_cast<double>(store_.kinematics[slot / kLanes].mass[static_cast<int>(slot % kLanes)]);
  }
  [[nodiscard]] std::uint64_t id(std::size_t slot) const;
  [[nodiscard]] std::uint32_t material(std::size_t slot) const;
  [[nodiscard]] std::span<const material::FlawCode> flaws_of(std::size_t slot) const;
  [[nodiscard]] double hencky_norm(std::size_t slot) const;  // |dev h| of the elastic strain

  EngineSetup setup_;
  mpi::Comm comm_;
  const Kernels<P>& kernels_;
  std::vector<material::Constants<Real>> constants_;
  std::vector<material::Constants<double>> double_constants_;
  Periodicity periodicity_;
  BoundarySet boundaries_;
  TransferParameters transfer_;

  ParticleStore<P> store_;
  std::vector<material::FlawCode> flaw_codes_;
  std::vector<Tile> tiles_;
  std::vector<BlockKey> stacks_;               // lowest block of each tile
  std::size_t occupied_blocks_ = 0;            // of the tiles
  std::vector<OccupiedCells> occupied_cells_;  // of each tile at the last sorting
  Sweep sweep_;
  LonePacks lone_;
  std::vector<BlockCoord> lone_stack_;
  std::vector<std::int32_t> lone_node_;  // packed node at the last sorting
  std::vector<LonePull<P>> lone_pull_;
  double kick_ = 0.0;  // of the last grid update [s]
  BlockTable blocks_;
  NodeColumns columns_{kChannels * sizeof(Real)};  // of blocks_, and behind them those of ordered_
  std::size_t node_places_ = 0;                    // of the former alone
  PeriodImages images_;
  LargeArray<Real> sums_;
  LargeArray<Real> velocities_;
  std::vector<RowMask> rows_;
  std::vector<BlockSums> block_sums_;        // by owned block
  std::vector<std::int32_t> boundary_node_;  // packed, of the particles of boundary tiles at the last sorting
  std::vector<char> is_boundary_;            // by tile: it reaches shared blocks or those of other ranks
  double trailing_kick_ = 0.0;               // that the next grid update must have; 0: any
  std::size_t owned_blocks_ = 0;
  double smallest_mass_ = 0.0;
  std::uint64_t strayed_packs_ = 0;  // seen since the last sorting; reported there, on all ranks at once

  mpi::Slabs slabs_;
  mpi::StandingRequests<BlockRequest> block_requests_;
  OrderedSums ordered_;  // of a reproducible run
  mpi::NodeExchange<Real, kChannels> sum_exchange_{1};
  mpi::NodeExchange<Real, kVelocityChannels> velocity_exchange_{2};
  bool shared_updated_ = false;   // since the sums were sent
  Timeline* timeline_ = nullptr;  // of the run; null: none wanted
  PassReport report_;
  std::uint64_t gathers_ = 0;   // since the last sorting
  std::size_t most_bytes_ = 0;  // held at once since the gather before the last sorting
  PassFault fault_;             // of the last pass
};

extern template class HostEngine<MixedPrecision>;
extern template class HostEngine<DoublePrecision>;

}  // namespace breccia::grid

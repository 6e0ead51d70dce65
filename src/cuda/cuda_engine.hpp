// The MPM engine on one CUDA device: particles and grid stay there from the first step to the last. A step is three
// launches, captured in a graph; on several ranks five, and an exchange of what they share. The host waits at
// sortings and where it looks at results.
#pragma once

#include <memory>
#include <vector>

#include "cuda/cuda_gravity.hpp"
#include "cuda/device_array.hpp"
#include "cuda/device_grid.hpp"
#include "cuda/device_load.hpp"
#include "cuda/device_particles.hpp"
#include "cuda/halo.hpp"
#include "cuda/launchers.hpp"
#include "cuda/observe_kernels.hpp"
#include "cuda/step_graph.hpp"
#include "grid/boundary.hpp"
#include "grid/engine.hpp"

namespace breccia::cuda {

template <class P>
class CudaEngine final : public grid::Engine, public gravity::ResidentParticles {
 public:
  using Real = typename P::Real;

  /// On the current device.
  CudaEngine(const grid::EngineSetup& setup, const mpi::Comm& comm);

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
  [[nodiscard]] std::unique_ptr<gravity::ResidentSolver> make_resident_solver(
      GravityMethod method, const gravity::Parameters& parameters) override;
  void kick_velocities(double time) override;
  [[nodiscard]] ParticleOutput observe() const override;
  [[nodiscard]] ParticleOutput inspect() const override;
  [[nodiscard]] bool strayed() const override;
  [[nodiscard]] std::optional<grid::ParticleSample> fastest() const override;
  [[nodiscard]] std::vector<double> volume_ratios() const override;
  [[nodiscard]] double elastic_energy() const override;
  [[nodiscard]] grid::SignalSpeeds signal_speeds() const override;
  bool finish_damage() override;
  [[nodiscard]] grid::PassReport passes() const override;
  [[nodiscard]] grid::EngineStats stats() const override;
  void abandon() override { halo_.abandon(); }

 private:
  // Copies of a field's components on the host.
  struct HostFields;

  [[nodiscard]] PassArguments<Real> pass_arguments(double step, double half_step) const;
  [[nodiscard]] NodeArguments<Real> node_arguments(double kick) const;
  [[nodiscard]] PredictArguments<Real> predict_arguments(double time) const;
  void launch_pass(PassArguments<Real> arguments);
  void settle();
  void restore_flaws(const EngineState& state, const material::FlawLists& flaws);
  // What a probe of the grid says of each particle, component after component; empty vectors without a grid.
  struct GridView {
    std::vector<Real> new_velocity, node_mass, gradient;
  };
  [[nodiscard]] ParticleOutput read_particles(const GridView& grid) const;
  // On several ranks (cuda_engine_ranks.cpp).
  [[nodiscard]] OwnPlanes own_planes() const { return planes_of_rank(slabs_, comm_.rank()); }
  void migrate();
  void take(std::span<const unsigned> staying, std::vector<grid::BlockKey> keys,
            const std::vector<std::vector<std::byte>>& messages);
  [[nodiscard]] std::vector<std::vector<std::byte>> messages_of(const std::vector<std::vector<unsigned>>& leaving,
                                                                std::span<const grid::BlockKey> keys);
  void drop_flaws_of_others();
  void save_flaws(EngineState& state) const;
  void switch_damage_off();
  [[nodiscard]] double work_of_periods() const;  // of the uniform field, before particles are put back
  [[nodiscard]] std::vector<Vec3d> unfolded_positions() const;
  [[nodiscard]] std::vector<Vec3d> positions() const;
  [[nodiscard]] std::vector<double> hencky_norms() const;
  [[nodiscard]] std::vector<double> component(const char* field, int index) const;

  grid::EngineSetup setup_;
  mpi::Comm comm_;
  grid::BoundarySet boundaries_;
  Stream stream_;
  DeviceParticles<P> particles_;
  DeviceGrid<P> grid_;
  DeviceArray<material::Constants<Real>> constants_;
  DeviceArray<material::Constants<double>> double_constants_;
  DeviceArray<BoundaryPlane> walls_;
  DeviceArray<float> flaw_thresholds_;
  std::vector<float> flaw_thresholds_host_;  // the same: they never change, and go with particles to other ranks
  std::size_t own_flaws_ = 0;                // of them, the others belonging to particles that have gone
  DeviceArray<PassSums> pass_sums_;
  // What the host asks for once a window: memory that is there already, as to make some would wait for the device.
  DeviceArray<unsigned> unbroken_;
  DeviceArray<PassSums> total_;
  mutable DeviceArray<FastestSignals> fastest_;
  DeviceArray<unsigned> counts_;  // strayed particles; volume changes cut since the last sorting
  Transfer<Real> transfer_{};
  double smallest_mass_ = 0.0;
  double kick_ = 0.0;           // of the last grid update [s]
  bool grid_is_ahead_ = false;  // the last graph has updated the grid already
  StepGraph graph_;
  mpi::Slabs slabs_;
  Halo<Real> halo_;
};

extern template class CudaEngine<MixedPrecision>;
extern template class CudaEngine<DoublePrecision>;

}  // namespace breccia::cuda

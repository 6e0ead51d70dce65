// From a scene to an engine that holds its particles.
#pragma once

#include <memory>

#include "breccia/scene.hpp"
#include "grid/engine.hpp"
#include "sim/effects.hpp"

namespace breccia::sim {

/// An engine that goes on from a saved state; flaws are drawn again. Collective. Throws IoError if the state is not one
/// of the scene.
std::unique_ptr<grid::Engine> make_restored_engine(const Scene& scene, const ResolvedEffects& effects,
                                                   const EngineState& state, int threads, const mpi::Comm& comm,
                                                   grid::EngineMaker make = &grid::make_host_engine);

/// An engine with the particles, flaws and spins of the scene. Collective.
std::unique_ptr<grid::Engine> make_loaded_engine(const Scene& scene, const ResolvedEffects& effects, int threads,
                                                 const mpi::Comm& comm,
                                                 grid::EngineMaker make = &grid::make_host_engine);
/// The same with these particles of this rank, ordered by id, in place of those the scene makes.
std::unique_ptr<grid::Engine> make_loaded_engine(const Scene& scene, const ResolvedEffects& effects,
                                                 const ParticleArrays& particles, int threads, const mpi::Comm& comm,
                                                 grid::EngineMaker make = &grid::make_host_engine);

/// What the engine of a scene is made for.
grid::EngineSetup engine_setup(const Scene& scene, const ResolvedEffects& effects, int threads);

/// Mean distance of the particles in all bodies as they are made [m]: a restarted run finds the same.
double mean_spacing(const Scene& scene);

/// Bytes of all fields of a particle, flaw thresholds (mean number) included, without sorting and grid.
double bytes_per_particle(const Scene& scene, const ResolvedEffects& effects);

}  // namespace breccia::sim

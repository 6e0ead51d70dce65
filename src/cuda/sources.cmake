# The CUDA engine: what the device's compiler reads, and the host side of it. Built into the plug-in with nvcc and, for
# tests, with the host compiler against the emulation.
set(breccia_cuda_kernels census.cu direct_gravity.cu gravity_kernels.cu lone_pass.cu mesh_nodes.cu mesh_sort.cu near_pairs.cu node_update.cu
                         observe_kernels.cu primitives.cu
                         sort_kernels.cu tile_pass_double.cu tile_pass_mixed.cu tree_build.cu tree_sums.cu tree_walk.cu)
set(breccia_cuda_host body_sets.cpp box_gravity.cpp cuda_engine.cpp cuda_engine_observe.cpp cuda_engine_ranks.cpp cuda_engine_state.cpp cuda_gravity.cpp
                      device_census.cpp device_convolution.cpp device_fft.cpp device_grid.cpp device_load.cpp device_memory.cpp device_mpi.cpp device_plan.cpp device_particles.cpp device_tree.cpp
                      gravity_bodies.cpp gravity_choice.cpp gravity_memory.cpp halo.cpp halo_messages.cpp mpi_messages.cpp stream_signal.cpp nccl_library.cpp nccl_messages.cpp tree_gravity.cpp
                      unsplit_gravity.cpp)
list(TRANSFORM breccia_cuda_kernels PREPEND ${CMAKE_SOURCE_DIR}/src/cuda/)
list(TRANSFORM breccia_cuda_host PREPEND ${CMAKE_SOURCE_DIR}/src/cuda/)
# For nvcc. Floats below the normal ones are zero; quotients and roots of floats may be two units in the last place off.
set(breccia_cuda_flags --expt-relaxed-constexpr -ftz=true)
set(breccia_cuda_rounding -prec-div=false -prec-sqrt=false)

# CMake 3.25.1 does not know how nvcc is told about C++20.
set(CMAKE_CUDA_ARCHITECTURES 80-real 90)
enable_language(CUDA)
set(CMAKE_CUDA20_STANDARD_COMPILE_OPTION "-std=c++20")
set(CMAKE_CUDA20_EXTENSION_COMPILE_OPTION "-std=c++20")

# The constitutive update as device code: it compiles, and a register spill is an error.
add_library(cuda_physics OBJECT constitutive_device.cu)
target_include_directories(cuda_physics PRIVATE ${CMAKE_SOURCE_DIR}/include ${CMAKE_SOURCE_DIR}/src)
set_target_properties(cuda_physics PROPERTIES CUDA_STANDARD 20)
target_compile_options(cuda_physics PRIVATE --expt-relaxed-constexpr -Xptxas --warn-on-spills -Werror all-warnings)

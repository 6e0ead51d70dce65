# What a user may choose, and the flags every target shares.
option(BRECCIA_TESTS "Build the tests" ON)
option(BRECCIA_FUZZ "Build the libFuzzer targets of tests/fuzz (needs clang)" OFF)
option(BRECCIA_CUDA "Build the CUDA engine (needs nvcc; the program runs without it and without a device)" OFF)
set(BRECCIA_SANITIZE "" CACHE STRING "Sanitizers for every target, e.g. address,undefined")
set(BRECCIA_ISAS "x86-64-v2;x86-64-v3;x86-64-v4" CACHE STRING
    "Instruction sets the kernel files are compiled for; the best one the processor has is taken at start")

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()
set(CMAKE_CXX_FLAGS_RELEASE "-O3 -DNDEBUG")
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR})

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE_PROGRAM})
  set(CMAKE_C_COMPILER_LAUNCHER ${CCACHE_PROGRAM})
endif()

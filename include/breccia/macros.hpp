// Function attributes shared by host scalars, host SIMD packs and CUDA threads.
#pragma once

#if defined(__CUDACC__)
#define BRECCIA_HD __host__ __device__ __forceinline__
#else
// always_inline: kernel files are compiled once per instruction set, so no out-of-line copy may exist that the
// linker could pick for a processor that lacks the instructions.
#define BRECCIA_HD inline __attribute__((always_inline))
#endif

// For lambdas inside inlined kernel code: g++ would otherwise emit them as weak symbols, one of which the linker keeps
// for every instruction set.
#define BRECCIA_INLINE_LAMBDA __attribute__((always_inline))

// Before a loop: how often its body is to be repeated.
#define BRECCIA_PRAGMA(text) _Pragma(#text)
#if defined(__CUDACC__)
#define BRECCIA_UNROLL(times) BRECCIA_PRAGMA(unroll times)
#else
#define BRECCIA_UNROLL(times) BRECCIA_PRAGMA(GCC unroll times)
#endif

// Which compiled copy of the kernels this processor can run.
#pragma once

namespace breccia {

/// x86-64 micro-architecture levels the kernel files are compiled for.
enum class Isa { kV2 = 2, kV3 = 3, kV4 = 4 };

/// True if the level was compiled in and this processor has it.
bool available(Isa isa);

/// The best level that was compiled in and that this processor has. The environment variable BRECCIA_ISA (v2, v3, v4)
/// asks for a lower one. Throws UsageError if that is unknown or not available.
Isa active_isa();

/// "x86-64-v4 (AVX-512)" and so on.
const char* isa_name(Isa isa);

}  // namespace breccia

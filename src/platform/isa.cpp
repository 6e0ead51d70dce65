#include "breccia/isa.hpp"

#include <cstdlib>
#include <string>
#include <string_view>

#include "breccia/error.hpp"

namespace breccia {
namespace {

#ifdef BRECCIA_HAVE_V4
constexpr bool kHaveV4 = true;
#else
constexpr bool kHaveV4 = false;
#endif
#ifdef BRECCIA_HAVE_V3
constexpr bool kHaveV3 = true;
#else
constexpr bool kHaveV3 = false;
#endif
#ifdef BRECCIA_HAVE_V2
constexpr bool kHaveV2 = true;
#else
constexpr bool kHaveV2 = false;
#endif

// clang 16 knows no levels, but features: those that a processor of the level got last.
#ifdef __clang__
bool processor_has_v4() { return __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq"); }
bool processor_has_v3() { return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"); }
bool processor_has_v2() { return __builtin_cpu_supports("sse4.2"); }
#else
bool processor_has_v4() { return __builtin_cpu_supports("x86-64-v4") != 0; }
bool processor_has_v3() { return __builtin_cpu_supports("x86-64-v3") != 0; }
bool processor_has_v2() { return __builtin_cpu_supports("x86-64-v2") != 0; }
#endif

}  // namespace

bool available(Isa isa) {
  switch (isa) {
    case Isa::kV4:
      return kHaveV4 && processor_has_v4();
    case Isa::kV3:
      return kHaveV3 && processor_has_v3();
    case Isa::kV2:
      return kHaveV2 && processor_has_v2();
  }
  return false;
}

namespace {

std::string_view short_name(Isa isa) {
  switch (isa) {
    case Isa::kV4:
      return "v4";
    case Isa::kV3:
      return "v3";
    default:
      return "v2";
  }
}

Isa choose() {
  __builtin_cpu_init();
  if (const char* wish = std::getenv("BRECCIA_ISA"); wish != nullptr && *wish != '\0') {
    for (const Isa isa : {Isa::kV2, Isa::kV3, Isa::kV4}) {
      if (short_name(isa) != wish) continue;
      if (available(isa)) return isa;
      throw UsageError("BRECCIA_ISA=" + std::string(wish) + ": not compiled in, or this processor lacks it");
    }
    throw UsageError("BRECCIA_ISA=" + std::string(wish) + ": unknown; use v2, v3 or v4");
  }
  for (const Isa isa : {Isa::kV4, Isa::kV3, Isa::kV2}) {
    if (available(isa)) return isa;
  }
  throw UsageError("this processor lacks every instruction set breccia was built for; rebuild with BRECCIA_ISAS");
}

}  // namespace

Isa active_isa() {
  static const Isa isa = choose();
  return isa;
}

const char* isa_name(Isa isa) {
  switch (isa) {
    case Isa::kV4:
      return "x86-64-v4 (AVX-512)";
    case Isa::kV3:
      return "x86-64-v3 (AVX2)";
    default:
      return "x86-64-v2 (SSE4.2)";
  }
}

}  // namespace breccia

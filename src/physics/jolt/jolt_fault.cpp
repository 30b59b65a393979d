// SPDX-License-Identifier: MIT
// The start-up self-test. Jolt is compiled for some instruction sets and with some options; a processor without the first stops at its
// first instruction, and headers seen with other options than the library was built with stop in RegisterTypes(). So both are looked
// at before anything of Jolt runs.

#include <Jolt/Jolt.h>

#include <Jolt/RegisterTypes.h>

#include "physics/jolt/jolt_world.h"

namespace kiln::physics {

std::string_view jolt_fault() {
#if defined(__x86_64__)
#ifdef __AVX512F__
    if (!__builtin_cpu_supports("avx512f")) return "it was built for AVX-512, which this processor lacks";
#endif
#ifdef __AVX2__
    if (!__builtin_cpu_supports("avx2")) return "it was built for AVX2, which this processor lacks";
#endif
#ifdef __FMA__
    if (!__builtin_cpu_supports("fma")) return "it was built for FMA, which this processor lacks";
#endif
#endif
    if (!JPH::VerifyJoltVersionID())
        return "the library was built with other options than its headers were read with: build Jolt as Release or "
               "Distribution, with "
               "DEBUG_RENDERER_IN_DEBUG_AND_RELEASE=OFF and PROFILER_IN_DEBUG_AND_RELEASE=OFF, and Kiln anew";
    return {};
}

}  // namespace kiln::physics

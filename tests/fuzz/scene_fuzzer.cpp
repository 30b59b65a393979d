// SPDX-License-Identifier: MIT
// Scene files for libFuzzer: build/fuzz/bin/fuzz_scene [words of libFuzzer].

#include "feed.h"

#include <cstdio>
#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::string complaint = kiln::scene::scene_complaint({reinterpret_cast<const char*>(data), size});
    if (complaint.empty()) return 0;
    std::fprintf(stderr, "%s\n", complaint.c_str());
    std::abort();
}

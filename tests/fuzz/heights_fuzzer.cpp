// SPDX-License-Identifier: MIT
// Height images (PNG) for libFuzzer: build/fuzz/bin/fuzz_heights [words of libFuzzer].

#include "feed.h"

#include <cstdio>
#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::string complaint = kiln::scene::heights_complaint({data, size});
    if (complaint.empty()) return 0;
    std::fprintf(stderr, "%s\n", complaint.c_str());
    std::abort();
}

// SPDX-License-Identifier: MIT
// Journals for libFuzzer: build/fuzz/bin/fuzz_journal [words of libFuzzer].

#include "feed.h"

#include <cstdio>
#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::string complaint = kiln::scene::journal_complaint({reinterpret_cast<const char*>(data), size});
    if (complaint.empty()) return 0;
    std::fprintf(stderr, "%s\n", complaint.c_str());
    std::abort();
}

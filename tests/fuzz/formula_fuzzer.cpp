// SPDX-License-Identifier: MIT
// Formulas, GLSL and .vm models for libFuzzer: build/fuzz/bin/fuzz_formula [words of libFuzzer].

#include "sdf/feed.h"

#include <cstdio>
#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace kiln::sdf;
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    std::string complaint = formula_complaint(parse_formula(text));
    if (complaint.empty()) complaint = formula_complaint(read_glsl(text));
    if (complaint.empty()) complaint = formula_complaint(read_vm(text));
    if (complaint.empty()) return 0;
    std::fprintf(stderr, "%s\n", complaint.c_str());
    std::abort();
}

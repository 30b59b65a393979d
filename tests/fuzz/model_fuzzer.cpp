// SPDX-License-Identifier: MIT
// Models of every format for libFuzzer: build/fuzz/bin/fuzz_model [words of libFuzzer]. Every reader gets the bytes, whatever they begin with.

#include "model/feed.h"

#include <cstdio>
#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace kiln::model;
    const std::string_view bytes(reinterpret_cast<const char*>(data), size);
    std::string complaint = drawable_complaint(parse_gltf_drawable(bytes, "m.glb", "/nowhere/"), "m.glb");
    for (const std::string_view ending : kReaders)
        if (complaint.empty()) complaint = triangles_complaint(parse(ending, bytes), "m" + std::string(ending));
    if (complaint.empty()) return 0;
    std::fprintf(stderr, "%s\n", complaint.c_str());
    std::abort();
}

// SPDX-License-Identifier: MIT
// Pictures (PNG, JPEG, OpenEXR) for libFuzzer: build/fuzz/bin/fuzz_image [words of libFuzzer].

#include "image/exr_file.h"
#include "image/feed.h"
#include "image/jpeg_file.h"
#include "image/png_file.h"

#include <cstdio>
#include <cstdlib>
#include <span>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace kiln::image;
    const auto bytes = std::as_bytes(std::span(data, size));
    std::string complaint = pixels_complaint(decode_png(bytes, "f.png"), "f.png");
    if (complaint.empty()) complaint = pixels_complaint(decode_jpeg(bytes, "f.jpg"), "f.jpg");
    if (complaint.empty()) complaint = pixels_complaint(decode_exr(bytes, "f.exr", 1 << 20), "f.exr");
    if (complaint.empty()) return 0;
    std::fprintf(stderr, "%s\n", complaint.c_str());
    std::abort();
}

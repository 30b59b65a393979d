// SPDX-License-Identifier: MIT
// Where the bytes of one read-back are: nowhere yet, in a buffer the GPU is still filling, or fetched.
#pragma once

#include "render/graph.h"

#include <optional>

namespace kiln::render {

// Rows of images are copied with a pitch that every backend accepts.
constexpr uint32_t kCopyRowAlignment = 256;

struct ReadbackState {
    uint32_t row_bytes = 0;     // tight; 0: not an image
    uint32_t row_pitch = 0;     // in the buffer
    uint32_t row_count = 0;     // of all slices
    uint64_t buffer_bytes = 0;  // of the buffer
    std::string name;

    // Set by the runner; null again once it has taken the buffer back.
    rhi::Device* device = nullptr;
    rhi::BufferHandle buffer = {};
    rhi::SubmitId submit = 0;
    std::optional<Error> failed = {};
    std::optional<std::vector<std::byte>> bytes = {};

    void fetch();  // waits
};

}  // namespace kiln::render

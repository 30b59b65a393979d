// SPDX-License-Identifier: MIT
// An equirectangular image as the words that environment.gpu.h reads, and that text for C++.
#pragma once

#include "image/image.h"
#include "math/math.gpu.h"

#include <span>
#include <vector>

namespace kiln::render::shade {
using namespace kiln::gpu;

// Where the table of levels begins, and how many lobes there are.
inline constexpr uint kEnvironmentLevels = 28u;
inline constexpr uint kEnvironmentLobes = 8u;
// Larger images are brought to this: the words fill at most the largest buffer that every device can bind (128 MiB).
inline constexpr int kEnvironmentWidth = 4096, kEnvironmentHeight = 2048;

struct EnvironmentMap {
    std::vector<uint> words;
};

// `image` has 3 or more channels (of which the first 3 count) or is grey, and holds no NaN or infinity; what is below 0 counts
// as 0. The same words for any number of workers (0: all cores).
EnvironmentMap make_environment_map(const image::FloatPixels& image, int workers = 0);

// environment.gpu.h over a map's words, which must outlive it.
struct EnvironmentLight {
    std::span<const uint> words;

    uint environment_word(uint i) const { return words[i]; }
#include "render/lib/environment.gpu.h"
};

}  // namespace kiln::render::shade

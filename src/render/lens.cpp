// SPDX-License-Identifier: MIT
#include "render/lens.h"

#include "base/parallel_for.h"
#include "render/lib/tonemap.gpu.h"
#include "render/passes/bloom.gpu.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace kiln::render {

namespace {

using namespace kiln::gpu;

constexpr float kFinerShare = 0.75f;  // light of an octave, of the next coarser one's

struct Texels {
    int width = 0, height = 0;
    std::vector<vec3> texels;

    Texels(int w, int h) : width(w), height(h), texels(size_t(w) * size_t(h)) {}
    const vec3& at(int x, int y) const {
        return texels[size_t(std::clamp(y, 0, height - 1)) * size_t(width) + size_t(std::clamp(x, 0, width - 1))];
    }
};

// The texts of lib/bloom.gpu.h over an image.
struct Filter {
    const Texels& from;

    vec3 bloom_sample(vec2 at) const {
        const float x = at.x - 0.5f, y = at.y - 0.5f, x_0 = std::floor(x), y_0 = std::floor(y);
        const int i = int(x_0), j = int(y_0);
        return mix(mix(from.at(i, j), from.at(i + 1, j), x - x_0),
                   mix(from.at(i, j + 1), from.at(i + 1, j + 1), x - x_0), y - y_0);
    }
#include "render/lib/bloom.gpu.h"
};

template <typename Texel>
void fill(Texels& out, int workers, Texel&& texel) {
    parallel_for(out.height, workers, [&](int y) {
        for (int x = 0; x < out.width; ++x) out.texels[size_t(y) * size_t(out.width) + size_t(x)] = texel(x, y);
    });
}

// Where the middle of a texel is in texels that are `finer` times as many along a side.
vec2 middle(int x, int y, float finer) { return {(float(x) + 0.5f) * finer, (float(y) + 0.5f) * finer}; }

// The glow at full size.
Texels pyramid(const Texels& picture, float size, int workers) {
    std::vector<Texels> levels;
    const std::vector<BloomLevel> plan = bloom_levels(picture.width, picture.height, size);
    for (const BloomLevel& level : plan) {
        Texels out(level.width, level.height);
        const Texels& from = levels.empty() ? picture : levels.back();
        Filter filter{from};
        fill(out, workers, [&](int x, int y) { return filter.bloom_down(middle(x, y, 2)); });
        levels.push_back(std::move(out));
    }
    for (size_t i = levels.size() - 1; i-- > 0;) {
        Filter filter{levels[i + 1]};
        const Texels here = levels[i];
        fill(levels[i], workers,
             [&](int x, int y) { return mix(here.at(x, y), filter.bloom_up(middle(x, y, 0.5f)), plan[i].coarser); });
    }
    Texels out(picture.width, picture.height);
    Filter filter{levels.front()};
    fill(out, workers, [&](int x, int y) { return filter.bloom_up(middle(x, y, 0.5f)); });
    return out;
}

Texels blurred(const Texels& picture, float multiplier, float threshold, int workers) {
    Texels now = picture;
    for (vec3& c : now.texels)
        if (!(shade::luminance(c) * multiplier >= threshold)) c = {};
    std::array<float, 2 * kBlurReach + 1> weights;
    float sum = 0;
    for (int i = -kBlurReach; i <= kBlurReach; ++i)
        sum += weights[size_t(i + kBlurReach)] = std::exp(-0.125f * float(i * i));
    for (int pass = 0; pass < kBlurPasses; ++pass) {
        Texels next(now.width, now.height);
        fill(next, workers, [&](int x, int y) {
            vec3 c{};
            for (int i = -kBlurReach; i <= kBlurReach; ++i)
                c = c + (pass % 2 == 0 ? now.at(x + i, y) : now.at(x, y + i)) * weights[size_t(i + kBlurReach)];
            return c * (1 / sum);
        });
        now = std::move(next);
    }
    return now;
}

}  // namespace

std::vector<BloomLevel> bloom_levels(int width, int height, float size) {
    const float widest = std::log2(std::max(size * float(height), 2.0f));
    std::vector<BloomLevel> out;
    // Below the widest octave all of one, above it what is left of one.
    const auto half_sized = [](int pixels, int i) { return (pixels + (1 << i) - 1) >> i; };
    for (int i = 1; i == 1 || (float(i) - widest < 1 && half_sized(width, i) > 1 && half_sized(height, i) > 1); ++i)
        out.push_back({half_sized(width, i), half_sized(height, i), 0});
    float below = 0;
    for (size_t i = out.size(); i-- > 0;) {
        const float octave = float(i + 1) - widest;
        float light = std::pow(kFinerShare, -octave) * std::clamp(1 - octave, 0.0f, 1.0f);
        if (i == 0) light /= 1 - kFinerShare;
        out[i].coarser = below + light > 0 ? below / (below + light) : 0;
        below += light;
    }
    return out;
}

bool needs_whole_picture(const Camera& camera) { return camera.bloom > 0 || camera.auto_exposure; }

shade::ExposureState measured_exposure(std::span<const float> rgba, const Camera& camera, float seconds,
                                       const shade::ExposureState& was) {
    if (!camera.auto_exposure) return {.multiplier = camera.exposure, .stops = 0, .measured = 0, .known = 0};
    std::array<uint64_t, shade::kExposureBins> counts{};
    for (size_t i = 0; i + 3 < rgba.size(); i += 4)
        ++counts[size_t(shade::exposure_bin(shade::luminance({rgba[i], rgba[i + 1], rgba[i + 2]})))];
    float lit = 0, before = 0, shares = 0, sum = 0;
    for (size_t bin = 1; bin < counts.size(); ++bin) lit += float(counts[bin]);
    for (size_t bin = 1; bin < counts.size(); ++bin) {
        const float share = shade::exposure_share(before, float(counts[bin]), lit);
        shares += share;
        sum += share * shade::exposure_stops(int(bin));
        before += float(counts[bin]);
    }
    return shade::exposure_after(was, shares > 0 ? sum / shares : shade::kExposureLowest - 1, seconds, camera.exposure);
}

std::vector<vec3> glow_of(const Picture& picture, const Camera& camera, float multiplier, int workers) {
    Texels light(picture.width, picture.height);
    fill(light, workers, [&](int x, int y) {
        const float* const p = picture.rgba.data() + (size_t(y) * size_t(picture.width) + size_t(x)) * 4;
        return vec3{p[0], p[1], p[2]};
    });
    return camera.bloom_kind == BloomKind::Gaussian ? blurred(light, multiplier, camera.bloom_threshold, workers).texels
                                                    : pyramid(light, camera.bloom_size, workers).texels;
}

void develop(Picture& picture, const Camera& camera, const shade::ExposureState& exposure, int workers) {
    std::vector<vec3> glow;
    if (camera.bloom > 0) glow = glow_of(picture, camera, exposure.multiplier, workers);
    picture.srgb.resize(picture.rgba.size());
    parallel_for(picture.height, workers, [&](int y) {
        for (int x = 0; x < picture.width; ++x) {
            const size_t i = size_t(y) * size_t(picture.width) + size_t(x);
            const float* const p = picture.rgba.data() + i * 4;
            vec3 c{p[0], p[1], p[2]};
            if (!glow.empty()) {
                c = camera.bloom_kind == BloomKind::Gaussian ? c + glow[i] * camera.bloom
                                                             : mix(c, glow[i], camera.bloom);
            }
            c = shade::srgb_from_linear3(shade::tone_map(uint(camera.tone_map), c * exposure.multiplier));
            uint8_t* const out = picture.srgb.data() + i * 4;
            out[0] = uint8_t(shade::byte_from_unit(c.x));
            out[1] = uint8_t(shade::byte_from_unit(c.y));
            out[2] = uint8_t(shade::byte_from_unit(c.z));
            out[3] = 255;
        }
    });
}

}  // namespace kiln::render

// SPDX-License-Identifier: MIT

#include "render/lib/environment_map.h"

#include "base/assert.h"
#include "base/parallel_for.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>

namespace kiln::render::shade {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

struct Equirect {
    int width = 0, height = 0;
    std::vector<vec3> texels;

    vec3 at(int x, int y) const { return texels[size_t(y) * size_t(width) + size_t(x)]; }
};

// Shares of the old cells in a new one along an axis; `size` of a cell between two edges is measured by `measure`.
struct Share {
    int cell;
    float weight;
};
template <typename Measure>
std::vector<std::vector<Share>> shares(int from, int to, const Measure& measure) {
    std::vector<std::vector<Share>> out(static_cast<size_t>(to));
    for (int i = 0; i < to; ++i) {
        const double lo = double(i) / to, hi = double(i + 1) / to, whole = measure(hi) - measure(lo);
        for (int k = int(lo * from); k < from && double(k) / from < hi; ++k) {
            const double a = std::max(lo, double(k) / from), b = std::min(hi, double(k + 1) / from);
            if (b > a) out[size_t(i)].push_back({k, float((measure(b) - measure(a)) / whole)});
        }
    }
    return out;
}

// Means by solid angle.
Equirect resized(const Equirect& image, int width, int height) {
    const auto columns = shares(image.width, width, [](double x) { return x; });
    const auto rows = shares(image.height, height, [](double y) { return -std::cos(std::numbers::pi * y); });
    Equirect out{width, height, std::vector<vec3>(size_t(width) * size_t(height))};
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            vec3 sum{};
            for (const Share& row : rows[size_t(y)])
                for (const Share& column : columns[size_t(x)])
                    sum = sum + image.at(column.cell, row.cell) * (row.weight * column.weight);
            out.texels[size_t(y) * size_t(width) + size_t(x)] = sum;
        }
    }
    return out;
}

// Nine harmonics of an image of constant texels, exactly: over a texel every one is a product of integrals in height and turn.
std::array<std::array<double, 3>, 9> harmonics(const Equirect& image) {
    std::array<std::array<double, 3>, 9> sum{};
    for (int j = 0; j < image.height; ++j) {
        // Integrals between two polar angles of {1, c, 3 c² - 1} s, {1, c} s², s³ for c, s the cosine and sine.
        const auto integrals = [&](double angle) {
            const double c = std::cos(angle), s = std::sin(angle);
            return std::array{-c, -c * c / 2, c - c * c * c, angle / 2 - s * c / 2, s * s * s / 3, c * c * c / 3 - c};
        };
        auto down = integrals(std::numbers::pi * (j + 1) / image.height);
        const auto top = integrals(std::numbers::pi * j / image.height);
        for (size_t k = 0; k < down.size(); ++k) down[k] -= top[k];
        for (int i = 0; i < image.width; ++i) {
            // x = s sin(turn), z = -s cos(turn): the middle of the image is -Z.
            const double a = kTurn * (double(i) / image.width - 0.5), b = kTurn * (double(i + 1) / image.width - 0.5);
            const double one = b - a, x = std::cos(a) - std::cos(b), z = std::sin(a) - std::sin(b);
            const double xz = (std::cos(2 * b) - std::cos(2 * a)) / 4;     // of -sin cos
            const double xx_zz = (std::sin(2 * a) - std::sin(2 * b)) / 2;  // of sin² - cos²
            const double y[9] = {down[0] * one, down[1] * one, down[3] * x,   down[3] * z,    down[4] * x,
                                 down[4] * z,   down[5] * xz,  down[2] * one, down[5] * xx_zz};
            const vec3 c = image.at(i, j);
            for (size_t k = 0; k < 9; ++k) {
                sum[k][0] += y[k] * double(c.x);
                sum[k][1] += y[k] * double(c.y);
                sum[k][2] += y[k] * double(c.z);
            }
        }
    }
    // Squares of the harmonics' factors, by what a Lambert surface keeps: 1, 2/3, 1/4.
    constexpr double pi = std::numbers::pi;
    constexpr double one = 1 / (4 * pi), linear = 3 / (4 * pi) * 2 / 3, mixed = 15 / (4 * pi) / 4,
                     zonal = 5 / (16 * pi) / 4, square = 15 / (16 * pi) / 4;
    constexpr double keep[9] = {one, linear, linear, linear, mixed, mixed, mixed, zonal, square};
    for (size_t k = 0; k < 9; ++k)
        for (double& channel : sum[k]) channel *= keep[k];
    return sum;
}

vec3 direction_of(double x, double y) {
    const double turn = kTurn * (x - 0.5), fall = std::numbers::pi * y;
    return {float(std::sin(fall) * std::sin(turn)), float(std::cos(fall)), float(-std::sin(fall) * std::cos(turn))};
}

// Images of half the size each, down to one of a few texels.
std::vector<Equirect> pyramid(Equirect image) {
    std::vector<Equirect> out{std::move(image)};
    while (out.back().width > 4 && out.back().height > 2)
        out.push_back(resized(out.back(), out.back().width / 2, out.back().height / 2));
    return out;
}

vec3 bilinear(const Equirect& image, vec3 d) {
    const float x = (std::atan2(d.x, -d.z) / kTwoPi + 0.5f) * float(image.width) - 0.5f;
    const float fall = std::acos(std::clamp(d.y, -1.0f, 1.0f)) / kPi;
    const float y = std::clamp(fall * float(image.height) - 0.5f, 0.0f, float(image.height - 1));
    const int x_0 = int(std::floor(x)), y_0 = int(std::floor(y)), y_1 = std::min(y_0 + 1, image.height - 1);
    const int left = (x_0 + image.width) % image.width, right = (x_0 + 1) % image.width;
    const float s = x - float(x_0), t = y - float(y_0);
    return mix(mix(image.at(left, y_0), image.at(right, y_0), s), mix(image.at(left, y_1), image.at(right, y_1), s), t);
}

// Means over GGX lobes seen along their middle, weighted by the cosine (Karis 2013): the sum over all texels, for wide lobes.
Equirect wide_lobe_means(const Equirect& image, float roughness, int workers) {
    const float a2 = std::pow(roughness, 4.0f);
    std::vector<vec3> directions;
    std::vector<float> areas;
    for (int y = 0; y < image.height; ++y) {
        const double top = kTurn / 2 * y / image.height, low = kTurn / 2 * (y + 1) / image.height;
        for (int x = 0; x < image.width; ++x) {
            directions.push_back(direction_of((x + 0.5) / image.width, (y + 0.5) / image.height));
            areas.push_back(float(std::cos(top) - std::cos(low)));
        }
    }
    Equirect out{image.width, image.height, std::vector<vec3>(image.texels.size())};
    parallel_for(int(directions.size()), workers, [&](int i) {
        const vec3 r = directions[size_t(i)];
        vec3 sum{};
        float total = 0;
        for (size_t k = 0; k < directions.size(); ++k) {
            const float cosine = dot(r, directions[k]);
            if (cosine <= 0) continue;
            const float q = 0.5f * (1 + cosine) * (a2 - 1) + 1;
            const float weight = areas[k] * cosine / (q * q);
            sum = sum + image.texels[k] * weight;
            total += weight;
        }
        out.texels[size_t(i)] = sum * (1 / total);
    });
    return out;
}

// The same for narrow lobes, by `count` samples a texel. They read the pyramid where its texels are as large as their share of the
// lobe (Krivanek and Colbert, "Real-time Shading with Filtered Importance Sampling", 2008).
Equirect lobe_means(const std::vector<Equirect>& images, float roughness, int width, int height, int count,
                    int workers) {
    struct Sample {
        float x, y, z, weight, level;
    };
    std::vector<Sample> samples;
    const double a2 = std::pow(double(roughness), 4);
    const double texel = 4 * std::numbers::pi / (double(images[0].width) * images[0].height);
    double total = 0;
    for (int i = 0; i < count; ++i) {
        // Halfway vectors by the distribution's cosine-weighted density; turns by the golden ratio.
        const double u = (i + 0.5) / count, phi = kTurn * std::fmod(i * 0.6180339887498949, 1.0);
        const double c2 = (1 - u) / (1 + (a2 - 1) * u), c = std::sqrt(c2), s = std::sqrt(std::max(0.0, 1 - c2));
        const double z = 2 * c2 - 1;
        if (z <= 0) continue;
        const double d = c2 * (a2 - 1) + 1, density = a2 / (std::numbers::pi * d * d) / 4;
        const double level = 0.5 * std::log2(1 / (count * density) / texel);
        samples.push_back({float(2 * c * s * std::cos(phi)), float(2 * c * s * std::sin(phi)), float(z), float(z),
                           float(std::clamp(level, 0.0, double(images.size() - 1)))});
        total += z;
    }
    for (Sample& sample : samples) sample.weight = float(double(sample.weight) / total);
    Equirect out{width, height, std::vector<vec3>(size_t(width) * size_t(height))};
    parallel_for(height, workers, [&](int y) {
        for (int x = 0; x < width; ++x) {
            const vec3 n = direction_of((x + 0.5) / width, (y + 0.5) / height);
            const Basis basis = basis_around(n);
            vec3 sum{};
            for (const Sample& sample : samples) {
                const vec3 l = basis.tangent * sample.x + basis.bitangent * sample.y + n * sample.z;
                const size_t finer = std::min(size_t(sample.level), images.size() - 1);
                const size_t coarser = std::min(finer + 1, images.size() - 1);
                const vec3 seen =
                    mix(bilinear(images[finer], l), bilinear(images[coarser], l), sample.level - float(finer));
                sum = sum + seen * sample.weight;
            }
            out.texels[size_t(y) * size_t(width) + size_t(x)] = sum;
        }
    });
    return out;
}

}  // namespace

EnvironmentMap make_environment_map(const image::FloatPixels& pixels, int workers) {
    KILN_ASSERT(pixels.width > 0 && pixels.height > 0 && pixels.channels > 0);
    Equirect image{pixels.width, pixels.height, {}};
    image.texels.resize(size_t(pixels.width) * size_t(pixels.height));
    const size_t channels = size_t(pixels.channels);
    for (size_t i = 0; i < image.texels.size(); ++i) {
        const float* c = pixels.values.data() + i * channels;
        const bool grey = channels < 3;
        image.texels[i] = max(vec3{c[0], c[grey ? 0 : 1], c[grey ? 0 : 2]}, vec3{0, 0, 0});
    }
    const auto sum = harmonics(image);
    if (image.width > kEnvironmentWidth || image.height > kEnvironmentHeight)
        image = resized(image, std::min(image.width, kEnvironmentWidth), std::min(image.height, kEnvironmentHeight));

    EnvironmentMap out;
    out.words.resize(kEnvironmentLevels + 4 * (kEnvironmentLobes + 1));
    for (size_t k = 0; k < 9; ++k)
        for (size_t c = 0; c < 3; ++c) out.words[3 * k + c] = std::bit_cast<uint>(float(sum[k][c]));
    const auto add = [&](uint level, const Equirect& texels) {
        uint* const entry = out.words.data() + kEnvironmentLevels + 4 * level;
        entry[0] = uint(out.words.size());
        entry[1] = uint(texels.width);
        entry[2] = uint(texels.height);
        for (const vec3 c : texels.texels)
            for (const float v : {c.x, c.y, c.z}) out.words.push_back(std::bit_cast<uint>(v));
    };
    add(0, image);
    // Lobes begin at a sixteenth of a radian: images of 1024 x 512 are fine enough for all of them.
    const std::vector<Equirect> images =
        pyramid(resized(image, std::min(image.width, 1024), std::min(image.height, 512)));
    const Equirect coarse = resized(image, 64, 32);
    for (uint level = 1; level <= kEnvironmentLobes; ++level) {
        const float roughness = float(level) / float(kEnvironmentLobes);
        if (level > 3) {
            add(level, wide_lobe_means(coarse, roughness, workers));
            continue;
        }
        const int width = std::clamp(512 >> (level - 1), 64, std::max(images[0].width, 64));
        add(level, lobe_means(images, roughness, width, width / 2, 32 << (level - 1), workers));
    }
    return out;
}

}  // namespace kiln::render::shade

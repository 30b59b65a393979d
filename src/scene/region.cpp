// SPDX-License-Identifier: MIT
#include "scene/region.h"

#include "scene/json_source.h"

#include "base/format.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>

namespace kiln::scene {

using field::ivec3;

namespace {

constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
constexpr int kFarthestPoint = 1 << 20;
constexpr int64_t kMostPoints = int64_t(1) << 24;  // of its grid, with the air around it
constexpr int kAir = sdf::MeshGrid::kAirCells + 1;

// Six bits a letter, lowest first.
class Letters {
public:
    void put(uint32_t byte) {
        bits_ |= byte << count_;
        for (count_ += 8; count_ >= 6; count_ -= 6, bits_ >>= 6) out_ += kDigits[bits_ & 63u];
    }
    std::string done() {
        if (count_ > 0) out_ += kDigits[bits_ & 63u];
        return std::move(out_);
    }

private:
    std::string out_;
    uint32_t bits_ = 0;
    int count_ = 0;
};

Error wrong(const char* what) {
    return {formatted("a region {}; regions are written by the program, take it from where it was", what),
            ErrorKind::Input};
}

// N numbers by commas, and a colon.
template <typename T, size_t N>
bool numbers(std::string_view& text, T (&out)[N]) {
    for (size_t i = 0; i < N; ++i) {
        const auto [at, error] = std::from_chars(text.data(), text.data() + text.size(), out[i]);
        if (error != std::errc{}) return false;
        text.remove_prefix(size_t(at - text.data()));
        if (text.empty() || text.front() != (i + 1 < N ? ',' : ':')) return false;
        text.remove_prefix(1);
    }
    return true;
}

}  // namespace

bool region_fits(ivec3 size) {
    constexpr int kAround = 2 * kAir + sdf::MeshGrid::kBrickCells;
    int64_t points = 1;
    for (const int n : {size.x, size.y, size.z}) {
        if (n < 1 || n > kFarthestPoint) return false;
        points *= n + kAround;
        if (points > kMostPoints) return false;
    }
    return true;
}

std::string region_text(const field::RegionMask& mask) {
    Letters letters;
    const auto run = [&](size_t length) {
        for (; length >= 128; length >>= 7) letters.put(uint32_t(length & 127u) | 128u);
        letters.put(uint32_t(length));
    };
    bool inside = false;
    size_t from = 0;
    for (size_t i = 0; i < mask.inside.size(); ++i) {
        if (mask.inside[i] == inside) continue;
        run(i - from);
        from = i;
        inside = !inside;
    }
    run(mask.inside.size() - from);
    return formatted("{}{}:{},{},{}:{},{},{}:{}", kRegion, shortest(mask.voxel_size), mask.first.x, mask.first.y,
                     mask.first.z, mask.size.x, mask.size.y, mask.size.z, letters.done());
}

Result<field::RegionMask> read_region(std::string_view text) {
    text.remove_prefix(std::min(text.size(), kRegion.size()));
    float voxel_size[1];
    int first[3], size[3];
    if (!numbers(text, voxel_size) || !numbers(text, first) || !numbers(text, size))
        return wrong("without its voxel size, first point and size");
    if (!std::isfinite(voxel_size[0]) || !(voxel_size[0] > 0)) return wrong("whose voxel size is not above 0");
    for (const int at : first)
        if (std::abs(int64_t(at)) > kFarthestPoint) return wrong("out of bounds");
    if (!region_fits({size[0], size[1], size[2]})) return wrong("of no size, or too large");
    const int64_t points = int64_t(size[0]) * size[1] * size[2];
    field::RegionMask out{{first[0], first[1], first[2]}, {size[0], size[1], size[2]}, voxel_size[0], {}};
    out.inside.reserve(size_t(points));
    bool inside = false;
    uint32_t bits = 0;
    int count = 0, shift = 0;
    int64_t run = 0;
    for (const char letter : text) {
        const size_t digit = kDigits.find(letter);
        if (digit == std::string_view::npos) return wrong("with a letter that no mask has");
        bits |= uint32_t(digit) << count;
        count += 6;
        if (count < 8) continue;
        run |= int64_t(bits & 127u) << shift;
        shift += 7;
        const bool more = (bits & 128u) != 0;
        bits >>= 8;
        count -= 8;
        if (more && shift < 28) continue;
        if (more || run > points - int64_t(out.inside.size())) return wrong("whose mask is longer than its size");
        if (run == 0 && (inside || !out.inside.empty())) return wrong("with a run of no points");
        out.inside.insert(out.inside.end(), size_t(run), inside);
        inside = !inside;
        run = 0;
        shift = 0;
    }
    if (int64_t(out.inside.size()) != points) return wrong("whose mask is shorter than its size");
    return out;
}

// Every coarse cell has a brick: a region is little more than its surface's surroundings.
sdf::MeshGrid region_grid(const field::RegionMask& mask) {
    constexpr int kCells = sdf::MeshGrid::kBrickCells;
    const auto bricks = [](int points) { return (points + 2 * kAir - 1 + kCells - 1) / kCells; };
    sdf::MeshGrid out;
    out.cell = mask.voxel_size;
    out.columns = bricks(mask.size.x);
    out.rows = bricks(mask.size.y);
    out.layers = bricks(mask.size.z);
    field::RegionMask wide{mask.first - ivec3{kAir, kAir, kAir},
                           {out.columns * kCells + 1, out.rows * kCells + 1, out.layers * kCells + 1},
                           mask.voxel_size,
                           {}};
    const auto at = [](ivec3 size, int x, int y, int z) {
        return (size_t(z) * size_t(size.y) + size_t(y)) * size_t(size.x) + size_t(x);
    };
    wide.inside.resize(size_t(wide.size.x) * size_t(wide.size.y) * size_t(wide.size.z));
    for (int z = 0; z < mask.size.z; ++z)
        for (int y = 0; y < mask.size.y; ++y)
            for (int x = 0; x < mask.size.x; ++x)
                wide.inside[at(wide.size, x + kAir, y + kAir, z + kAir)] = mask.inside[at(mask.size, x, y, z)];
    const field::RegionField field(wide);
    const std::vector<float>& samples = field.samples();
    out.lo = field.bounds().min;
    out.hi = field.bounds().max;
    const ivec3 lattice{out.columns + 1, out.rows + 1, out.layers + 1};
    const size_t pairs = size_t(lattice.x) * size_t(lattice.y) * size_t(lattice.z);
    const size_t first = (2 * pairs + sdf::MeshGrid::kBlock - 1) / sdf::MeshGrid::kBlock;
    out.values.assign(first * sdf::MeshGrid::kBlock, 0.0f);
    size_t block = first;
    for (int z = 0; z < lattice.z; ++z)
        for (int y = 0; y < lattice.y; ++y)
            for (int x = 0; x < lattice.x; ++x) {
                const size_t pair = 2 * at(lattice, x, y, z);
                out.values[pair] = samples[at(wide.size, x * kCells, y * kCells, z * kCells)];
                const bool brick = x < out.columns && y < out.rows && z < out.layers;
                out.values[pair + 1] = brick ? float(block++) : -1.0f;
            }
    for (int z = 0; z < out.layers; ++z)
        for (int y = 0; y < out.rows; ++y)
            for (int x = 0; x < out.columns; ++x)
                for (int k = 0; k <= kCells; ++k)
                    for (int j = 0; j <= kCells; ++j)
                        for (int i = 0; i <= kCells; ++i)
                            out.values.push_back(
                                samples[at(wide.size, x * kCells + i, y * kCells + j, z * kCells + k)]);
    return out;
}

}  // namespace kiln::scene

// SPDX-License-Identifier: MIT

#include "physics/cell_triangles.h"

#include "field/cell_cases.h"
#include "field/words.gpu.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace kiln::physics {

using field::ivec3;

namespace {

constexpr int kLeaf = 4;                  // voxels a side that are asked together
constexpr float kHalfDiagonal = 0.8661f;  // of a side
constexpr float kFarthest = 1e6f;         // voxels from the origin

// Of an edge of cell_cases.h: where it lies between the corners' values.
vec3 crossing(int edge, const std::array<float, 8>& value) {
    const int axis = edge / 4, u = edge & 1, v = edge >> 1 & 1;
    const int x = axis == 0 ? 0 : u, y = axis == 0 ? u : axis == 1 ? 0 : v, z = axis == 2 ? 0 : v;
    const size_t low = size_t(x + 2 * y + 4 * z), high = low + (size_t(1) << axis);
    const float t = value[low] / (value[low] - value[high]);
    return {float(x) + (axis == 0 ? t : 0), float(y) + (axis == 1 ? t : 0), float(z) + (axis == 2 ? t : 0)};
}

}  // namespace

void triangles_in(const field::SdfField& field, float h, const Box3& box, std::vector<vec3>& out) {
    out.clear();
    const Box3 solid = box_intersection(box, field.bounds().inflated(h));
    if (solid.empty() || !solid.finite()) return;
    const auto voxel = [&](float v) { return int(std::floor(std::clamp(v / h, -kFarthest, kFarthest))); };
    const ivec3 low{voxel(solid.min.x), voxel(solid.min.y), voxel(solid.min.z)};
    const ivec3 high{voxel(solid.max.x), voxel(solid.max.y), voxel(solid.max.z)};
    struct Block {
        ivec3 low;
        int side;  // voxels
    };
    int side = kLeaf;
    while (side <= std::max({high.x - low.x, high.y - low.y, high.z - low.z})) side *= 2;
    std::vector<Block> blocks{{low, side}};
    constexpr int kPoints = kLeaf + 1;
    std::array<float, size_t(kPoints) * kPoints * kPoints> x, y, z, d;
    while (!blocks.empty()) {
        const Block b = blocks.back();
        blocks.pop_back();
        if (b.low.x > high.x || b.low.y > high.y || b.low.z > high.z) continue;
        const float across = float(b.side) * h, half = 0.5f * across;
        const vec3 at = vec3{float(b.low.x), float(b.low.y), float(b.low.z)} * h;
        // 1-Lipschitz, but for what interpolation adds: no surface in it.
        if (std::abs(field.distance(at + vec3{half, half, half})) > kHalfDiagonal * across + 2 * field.error())
            continue;
        if (b.side > kLeaf) {
            const int s = b.side / 2;
            for (int k = 7; k >= 0; --k)
                blocks.push_back({{b.low.x + (k & 1) * s, b.low.y + (k >> 1 & 1) * s, b.low.z + (k >> 2) * s}, s});
            continue;
        }
        size_t n = 0;
        for (int k = 0; k < kPoints; ++k)
            for (int j = 0; j < kPoints; ++j)
                for (int i = 0; i < kPoints; ++i, ++n)
                    x[n] = float(b.low.x + i) * h, y[n] = float(b.low.y + j) * h, z[n] = float(b.low.z + k) * h;
        field.distances({x.data(), y.data(), z.data(), int(n)}, d.data());
        for (int k = 0; k < kLeaf; ++k)
            for (int j = 0; j < kLeaf; ++j)
                for (int i = 0; i < kLeaf; ++i) {
                    const ivec3 v{b.low.x + i, b.low.y + j, b.low.z + k};
                    if (v.x > high.x || v.y > high.y || v.z > high.z) continue;
                    std::array<float, 8> value;
                    uint32_t signs = 0;
                    for (int c = 0; c < 8; ++c) {
                        value[size_t(c)] =
                            d[size_t(((k + (c >> 2)) * kPoints + j + (c >> 1 & 1)) * kPoints + i + (c & 1))];
                        signs |= uint32_t(value[size_t(c)] <= 0) << c;
                    }
                    const field::CellTriangles& cut = field::cell_tables().triangles[signs];
                    for (size_t e = 0; e < 3 * size_t(cut.count); ++e)
                        out.push_back((vec3{float(v.x), float(v.y), float(v.z)} + crossing(cut.edges[e], value)) * h);
                }
    }
}

}  // namespace kiln::physics

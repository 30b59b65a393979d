// SPDX-License-Identifier: MIT
#include "measure/slow.h"

#include "base/hash.h"
#include "base/parallel_for.h"
#include "sdf/eval.h"

#include <cmath>
#include <vector>

namespace kiln::measure {
namespace {

using namespace field;

constexpr float kPeerBandVoxels = 3;  // of a level set's customary band

struct Cell {
    uint64_t index;
    ivec3 at;  // world cell
};

std::vector<Cell> every(const GridParams& grid, uint64_t stride) {
    std::vector<Cell> out;
    uint64_t index = 0;
    for (int z = 0; z < grid.size_z; ++z) {
        for (int y = 0; y < grid.size_y; ++y) {
            for (int x = 0; x < grid.size_x; ++x, ++index) {
                if (index % stride == 0) out.push_back({index, {grid.cell_x + x, grid.cell_y + y, grid.cell_z + z}});
            }
        }
    }
    return out;
}

uint64_t checksum_of(uint64_t cell, bool occupied, bool inside, std::span<const float> texels) {
    return hash_combine(hash_combine(0, cell), occupied ? hash64_of(texels) : uint64_t(inside));
}

}  // namespace

Stored stored(const HostBricks& bricks, uint64_t stride) {
    Stored out;
    float texels[kBrickTexelCount];
    for (const Cell& cell : every(bricks.field().grid(), stride)) {
        const uint32_t word = bricks.field().cell_word(cell.at.x, cell.at.y, cell.at.z);
        const bool occupied = (word & kCellOccupied) != 0;
        if (occupied) {
            for (int i = 0; i < kBrickTexelCount; ++i)
                texels[i] = bricks.texel(word & kCellSlotMask, i & 7, (i >> 3) & 7, i >> 6);
        }
        out.checksum += checksum_of(cell.index, occupied, (word & kCellInside) != 0, texels);
        out.bricks += occupied;
        ++out.cells;
    }
    return out;
}

Stored brute_force(const sdf::Program& program, const Field& field, uint64_t stride) {
    const std::vector<Cell> cells = every(field.grid(), stride);
    const float h = field.grid().voxel_size;
    const bool half = field.options().format == DistanceFormat::Half;
    std::vector<Stored> parts(cells.size());
    parallel_for(cells.size(), [&](int i) {
        const Cell& cell = cells[size_t(i)];
        float x[kBrickTexelCount], y[kBrickTexelCount], z[kBrickTexelCount], d[kBrickTexelCount];
        for (int k = 0; k < kBrickTexelCount; ++k) {
            x[k] = float(cell.at.x * kBrickVoxels + (k & 7)) * h;
            y[k] = float(cell.at.y * kBrickVoxels + ((k >> 3) & 7)) * h;
            z[k] = float(cell.at.z * kBrickVoxels + (k >> 6)) * h;
        }
        sdf::evaluate(sdf::view(program), {x, y, z, kBrickTexelCount}, d);
        Stored& part = parts[size_t(i)];
        const bool inside = d[0] < 0;
        bool occupied = false;
        for (int k = 0; k < kBrickTexelCount; ++k) {
            occupied = occupied || std::fabs(d[k]) < field.options().own_voxels * h;
            const bool own = (k & 7) < kBrickVoxels && ((k >> 3) & 7) < kBrickVoxels && (k >> 6) < kBrickVoxels;
            part.band_voxels += own && std::fabs(d[k]) < kPeerBandVoxels * h;
            d[k] = half ? stored_half(d[k] * (1.0f / h)) : stored_snorm8(d[k] * (1.0f / h));
        }
        part.checksum = checksum_of(cell.index, occupied, inside, d);
        part.bricks = occupied;
    });
    Stored out;
    out.cells = cells.size();
    for (const Stored& part : parts) {
        out.checksum += part.checksum;
        out.bricks += part.bricks;
        out.band_voxels += part.band_voxels;
    }
    return out;
}

}  // namespace kiln::measure

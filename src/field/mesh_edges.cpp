// SPDX-License-Identifier: MIT
#include "field/mesh_edges.h"

#include "base/parallel_for.h"

namespace kiln::field {
namespace {

enum Lower { kX, kXY, kY, kXaboveY, kYZ, kXZ, kZ, kXaboveZ, kYaboveZ };  // kLower's places

constexpr Slice kRow = 0xff;
constexpr Slice kColumn = 0x0101010101010101u;
constexpr Slice kInnerRows = 0x00ffffffffffff00u;
constexpr Slice kInnerColumns = 0x7e7e7e7e7e7e7e7eu;
constexpr Slice kLastRow = kRow << 56;
constexpr Slice kLastColumn = kColumn << 7;

constexpr int kCountGrain = 4;

}  // namespace

MeshEdges::MeshEdges(const MeshBricks& bricks) : bricks_(bricks) { edges_.resize(bricks.bricks().size()); }

void MeshEdges::count(int workers, Count items) {
    const std::span<const MeshBricks::Row> rows = bricks_.rows();
    parallel_for(
        rows.size(), workers, [&](int i) { count_row(rows[size_t(i)], items); }, kCountGrain);
    for (size_t i = 0; i < edges_.size(); ++i) {
        edges_[i].first_edge = edge_count_;
        edges_[i].first_item = item_count_;
        edge_count_ += edges_[i].edges;
        item_count_ += edges_[i].items;
    }
}

void MeshEdges::count_row(const MeshBricks::Row& row, Count items) {
    const std::span<const MeshBrick> all = bricks_.bricks();
    // The rows that hold lower neighbours, each with how far it has been read.
    struct Cursor {
        uint32_t at, end;
    };
    const auto cursor = [&](int y, int z) {
        const MeshBricks::Row* r = bricks_.row(y, z);
        return r != nullptr ? Cursor{r->first, r->end} : Cursor{0, 0};
    };
    Cursor below = cursor(row.y - 1, row.z), behind = cursor(row.y, row.z - 1),
           behind_below = cursor(row.y - 1, row.z - 1), behind_above = cursor(row.y + 1, row.z - 1);
    // The brick of cell x + step, or -1. x only rises, and the cursor waits at x - 1 for all three steps.
    const auto find = [&](Cursor& c, int x, int step) {
        while (c.at < c.end && all[c.at].cell.x < x - 1) ++c.at;
        for (uint32_t i = c.at; i < c.end && all[i].cell.x <= x + step; ++i)
            if (all[i].cell.x == x + step) return int32_t(i);
        return int32_t(-1);
    };
    for (uint32_t i = row.first; i < row.end; ++i) {
        BrickEdges& brick = edges_[i];
        brick.edges = brick.items = 0;
        brick.solid = solid_texels(all[i].codes, bricks_.format() == DistanceFormat::Half ? 2 : 1);
        Slice any = 0, every = ~Slice(0);
        for (const Slice s : brick.solid) any |= s, every &= s;
        brick.crossed = any != 0 && every != ~Slice(0);
        if (!brick.crossed) continue;

        const int x = all[i].cell.x;
        const auto has = [](int32_t neighbour) { return neighbour >= 0; };
        std::array<int32_t, 9>& n = brick.lower;
        n[kX] = i > row.first && all[i - 1].cell.x == x - 1 ? int32_t(i - 1) : -1;
        n[kXY] = find(below, x, -1);
        n[kY] = find(below, x, 0);
        n[kXaboveY] = find(below, x, 1);
        n[kYZ] = find(behind_below, x, 0);
        n[kXZ] = find(behind, x, -1);
        n[kZ] = find(behind, x, 0);
        n[kXaboveZ] = find(behind, x, 1);
        n[kYaboveZ] = find(behind_above, x, 0);

        // Edges that a lower neighbour holds: along x in the faces y = 0 and z = 0, and so on.
        const Slice low_row = has(n[kY]) ? kRow : 0, low_column = has(n[kX]) ? kColumn : 0;
        Slice x_first = has(n[kZ]) ? kInnerRows : 0, y_first = has(n[kZ]) ? kInnerColumns : 0;
        if (has(n[kZ]) || has(n[kYZ])) x_first |= kRow;
        if (has(n[kZ]) || has(n[kYaboveZ])) x_first |= kLastRow;
        if (has(n[kZ]) || has(n[kXZ])) y_first |= kColumn;
        if (has(n[kZ]) || has(n[kXaboveZ])) y_first |= kLastColumn;
        Slice along_z = low_row | low_column;
        if (has(n[kXY])) along_z |= 1;
        if (has(n[kXaboveY])) along_z |= 0x80;
        uint32_t total = 0;
        for (int axis = 0; axis < 3; ++axis) {
            for (int z = 0; z < 8; ++z) {
                Slice foreign = axis == 0 ? low_row : axis == 1 ? low_column : along_z;
                if (z == 0) foreign |= axis == 0 ? x_first : axis == 1 ? y_first : 0;
                const size_t at = size_t(axis * 8 + z);
                brick.owned[at] = crossed_edges(brick.solid, axis, z) & ~foreign;
                brick.rank[at] = uint16_t(total);
                total += bits_of(brick.owned[at]);
            }
        }
        brick.edges = total;
        brick.items = items.call(items.object, brick);
    }
}

uint32_t MeshEdges::number_of(int32_t brick, int axis, int x, int y, int z) const {
    const BrickEdges& b = edges_[size_t(brick)];
    const size_t at = size_t(axis * 8 + z);
    return b.first_edge + b.rank[at] + bits_of(b.owned[at] & ((Slice(1) << (y * 8 + x)) - 1));
}

void MeshEdges::number(size_t index, EdgeNumbers& out) const {
    const BrickEdges& brick = edges_[index];
    const std::array<int32_t, 9>& n = brick.lower;
    uint32_t next = brick.first_edge;
    for (int axis = 0; axis < 3; ++axis) {
        for (int z = 0; z < 8; ++z) {
            const size_t first = size_t(axis * 512 + z * 64);
            const Slice owned = brick.owned[size_t(axis * 8 + z)];
            for (Slice left = owned; left != 0; left &= left - 1) out[first + size_t(std::countr_zero(left))] = next++;
            for (Slice left = crossed_edges(brick.solid, axis, z) & ~owned; left != 0; left &= left - 1) {
                const int bit = std::countr_zero(left), x = bit & 7, y = bit >> 3;
                // The first brick that holds the edge, in order.
                int owner = kZ;
                const auto first_of = [&](std::initializer_list<int> in_order) {
                    for (const int l : in_order) {
                        if (n[size_t(l)] < 0) continue;
                        owner = l;
                        return;
                    }
                };
                if (axis == 0) {
                    if (z == 0 && y == 0)
                        first_of({kYZ, kZ, kY});
                    else if (z == 0 && y == 7)
                        first_of({kZ, kYaboveZ});
                    else
                        owner = z == 0 && y != 0 ? kZ : kY;
                } else if (axis == 1) {
                    if (z == 0 && x == 0)
                        first_of({kXZ, kZ, kX});
                    else if (z == 0 && x == 7)
                        first_of({kZ, kXaboveZ});
                    else
                        owner = z == 0 && x != 0 ? kZ : kX;
                } else {
                    if (x == 0 && y == 0)
                        first_of({kXY, kY, kX});
                    else if (x == 7 && y == 0)
                        first_of({kY, kXaboveY});
                    else
                        owner = y == 0 ? kY : kX;
                }
                const ivec3 step = kLower[owner];
                out[first + size_t(bit)] =
                    number_of(n[size_t(owner)], axis, x - 7 * step.x, y - 7 * step.y, z - 7 * step.z);
            }
        }
    }
}

}  // namespace kiln::field

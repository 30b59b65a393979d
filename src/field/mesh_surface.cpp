// SPDX-License-Identifier: MIT
#include "field/meshing.h"

#include "base/parallel_for.h"

#include <algorithm>
#include <cmath>

namespace kiln::field {

MeshSurface surface_of(const HostBricks& host, const MeshBricks& bricks, const Mesh& mesh, bool normals, int workers) {
    constexpr size_t kMost = 512;             // points asked at once
    constexpr float kStepVoxels = 1.0f / 32;  // as in the sharp mesher
    MeshSurface out;
    out.mixes.resize(mesh.vertex_count());
    if (normals) out.normals.resize(mesh.vertex_count());
    const ExactBrick exact = exact_of(host, bricks);
    const Field& field = host.field();
    const float step = kStepVoxels * bricks.voxel_size();
    const auto points = [&](size_t brick, size_t first, size_t count) {
        float x[kMost], y[kMost], z[kMost], value[kMost], plus[kMost], minus[kMost];
        const auto fill = [&](vec3 by) {
            for (size_t i = 0; i < count; ++i) {
                const vec3 p = mesh.positions[first + i] + by;
                x[i] = p.x, y[i] = p.y, z[i] = p.z;
            }
        };
        const sdf::Points at{x, y, z, int(count)};
        fill({});
        sdf::evaluate_materials(sdf::view(field.program(), field.code_of(bricks.bricks()[brick].slot)), at, value,
                                out.mixes.data() + first);
        if (!normals) return;
        float slopes[3][kMost];
        for (int axis = 0; axis < 3; ++axis) {
            const vec3 by{axis == 0 ? step : 0, axis == 1 ? step : 0, axis == 2 ? step : 0};
            fill(by);
            exact(brick, at, plus);
            fill(-by);
            exact(brick, at, minus);
            for (size_t i = 0; i < count; ++i) slopes[axis][i] = plus[i] - minus[i];
        }
        for (size_t i = 0; i < count; ++i) {
            const vec3 g{slopes[0][i], slopes[1][i], slopes[2][i]};
            const float size = length(g);
            out.normals[first + i] = size > 1e-3f * step ? g / size : vec3{};
        }
    };
    parallel_for(
        bricks.bricks().size(), workers,
        [&](int brick) {
            const size_t end = mesh.brick_vertices[size_t(brick) + 1];
            for (size_t first = mesh.brick_vertices[size_t(brick)]; first < end; first += kMost)
                points(size_t(brick), first, std::min(kMost, end - first));
        },
        16);
    // The late ones by runs of one brick.
    const Buffer<uint32_t>& late = mesh.late_bricks;
    const size_t before = mesh.vertex_count() - late.size();
    std::vector<size_t> runs;
    for (size_t i = 0; i < late.size(); ++i)
        if (i == 0 || late[i] != late[i - 1] || i - runs.back() == kMost) runs.push_back(i);
    parallel_for(
        runs.size(), workers,
        [&](int run) {
            const size_t first = runs[size_t(run)],
                         end = size_t(run) + 1 < runs.size() ? runs[size_t(run) + 1] : late.size();
            points(late[first], before + first, end - first);
        },
        16);
    return out;
}

}  // namespace kiln::field

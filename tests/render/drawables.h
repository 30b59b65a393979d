// SPDX-License-Identifier: MIT
// Small meshes made by code.
#pragma once

#include "model/drawable.h"

#include <kiln/renderer.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

namespace kiln::render::meshes {

inline std::shared_ptr<const model::Drawable> of_surface(std::vector<model::Vertex> vertices,
                                                         std::vector<uint32_t> corners, model::Surface surface,
                                                         std::vector<model::Image> images = {}) {
    auto d = std::make_shared<model::Drawable>();
    model::Primitive p;
    p.index_count = uint32_t(corners.size());
    p.vertex_count = uint32_t(vertices.size());
    d->vertices = std::move(vertices);
    d->indices = std::move(corners);
    d->primitives = {p};
    d->surfaces = {std::move(surface)};
    d->images = std::move(images);
    d->nodes.emplace_back().primitive_count = 1;
    model::finish(*d);
    return d;
}

inline model::Surface matte(vec3 color, float roughness = 0.5f) {
    model::Surface s;
    s.base_color = {color.x, color.y, color.z, 1};
    s.metallic = 0;
    s.roughness = roughness;
    return s;
}

inline model::Surface of_material(const Material& m) {
    model::Surface s = matte(m.base_color, m.roughness);
    s.metallic = m.metallic;
    s.emissive = m.emissive;
    return s;
}

// Rings of quads round the Y axis.
inline std::shared_ptr<const model::Drawable> sphere(float radius, int around, model::Surface surface) {
    const int rings = around / 2;
    std::vector<model::Vertex> v;
    for (int j = 0; j <= rings; ++j) {
        for (int i = 0; i <= around; ++i) {
            const double polar = std::numbers::pi * j / rings, turn = 2 * std::numbers::pi * i / around;
            model::Vertex q;
            q.normal = {float(std::sin(polar) * std::cos(turn)), float(std::cos(polar)),
                        float(-std::sin(polar) * std::sin(turn))};
            q.position = q.normal * radius;
            q.uv[0] = {float(i) / float(around), float(j) / float(rings)};
            v.push_back(q);
        }
    }
    std::vector<uint32_t> c;
    for (int j = 0; j < rings; ++j) {
        for (int i = 0; i < around; ++i) {
            const auto at = uint32_t(j * (around + 1) + i), below = at + uint32_t(around) + 1;
            if (j > 0) c.insert(c.end(), {at, below, at + 1});
            if (j + 1 < rings) c.insert(c.end(), {at + 1, below, below + 1});
        }
    }
    return of_surface(std::move(v), std::move(c), std::move(surface));
}

// In the plane y = 0, from (x0, z0) to (x1, z1), facing up; u along x, v along z.
inline std::shared_ptr<const model::Drawable> sheet(float x0, float z0, float x1, float z1, model::Surface surface,
                                                    std::vector<model::Image> images = {}) {
    std::vector<model::Vertex> v(4);
    for (size_t i = 0; i < 4; ++i) {
        v[i].position = {i & 1 ? x1 : x0, 0, i & 2 ? z1 : z0};
        v[i].uv[0] = {i & 1 ? 1.0f : 0.0f, i & 2 ? 1.0f : 0.0f};
    }
    return of_surface(std::move(v), {0, 2, 1, 1, 2, 3}, std::move(surface), std::move(images));
}

inline MeshInstance at(std::shared_ptr<const model::Drawable> drawable, vec3 position = {}, quat rotation = {}) {
    const Transform place{.position = position, .rotation = rotation};
    return {std::move(drawable), place, place};
}

}  // namespace kiln::render::meshes

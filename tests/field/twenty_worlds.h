// SPDX-License-Identifier: MIT
// The twenty scenes of gates G1 and G6: the small worlds of the field's tests and, between them, every shape, warp and operation,
// grounds without end, needles, sheets, faces on the borders of bricks, and a world far from the origin.
#pragma once

#include "worlds.h"

#include "sdf/mesh_grid.h"
#include "sdf/tables.h"

namespace kiln::field::worlds {

inline sdf::HeightGrid hills() {
    sdf::HeightGrid grid{6, 6, {}};
    for (int i = 0; i < 36; ++i) grid.values.push_back(0.5f + 0.5f * float((i * 7) % 11 - 5) / 5);
    return grid;
}

inline Edit warped(Edit e, std::vector<Warp> domain) {
    e.node.domain = std::move(domain);
    return e;
}

inline Edit turned(Edit e, vec3 axis, float angle) {
    e.node.transform.rotation = axis_angle(normalize(axis), angle);
    return e;
}

inline Edit scaled(Edit e, vec3 scale) {
    e.node.transform.scale = scale;
    return e;
}

inline FieldOptions around(vec3 half, float h = 0.04f, vec3 center = {}) {
    return {.voxel_size = h, .bounds = {center - half, center + half}};
}

// Every primitive with its default numbers, side by side, each turned its own way.
inline World every_shape() {
    World w{"every shape", {}, around({1.4f, 0.35f, 1.4f}), {hills()}, {sdf::ball_grid()}};
    const int count = sdf::primitive_count();
    for (int kind = 0; kind < count; ++kind) {
        Shape shape;
        shape.kind = uint16_t(kind);
        const sdf::KindRow& row = sdf::shape_rows()[size_t(kind)];
        if (row.name == "plane") continue;  // has worlds of its own
        for (const sdf::FieldRow& f : row.fields()) {
            for (int i = 0; i < f.arity; ++i) shape.params[size_t(f.offset + i)] = f.defaults[size_t(i)];
        }
        if (row.how == sdf::KindRow::Sampled) shape.data = "0";
        if (row.how == sdf::KindRow::Formula) shape.data = "length(p) - 0.5 - 0.05*sin(9*x)";
        Edit e = edit(shape, {-1.1f + 0.55f * float(kind % 5), 0, -1.1f + 0.55f * float(kind / 5)});
        const float s = row.name == "heightfield" ? 0.04f : 0.4f;
        w.edits.push_back(
            of_material(scaled(turned(e, {1, 2, 0.5f}, 0.3f * float(kind)), {s, s, s}), uint32_t(kind) % 7));
    }
    return w;
}

inline World every_warp() {
    World w{"every warp", {}, around({1.6f, 0.6f, 1.2f})};
    const Edit bar = edit(RoundedBox{.half_extents = {0.35f, 0.08f, 0.1f}, .rounding = 0.03f});
    const std::vector<std::vector<Warp>> stacks = {
        {Twist{.rate = 8}},
        {Bend{.curvature = 4}},
        {Bend{.curvature = -9}},
        {Elongate{.half_extents = {0.1f, 0.05f, 0.12f}}},
        {Mirror{.axis = 2}},
        {Taper{.rate = 3}},
        {Round{.radius = 0.06f}},
        {Shell{.thickness = 0.05f}},
        {Displace{.amplitude = 0.03f, .frequency = 6}},
        {Repeat{.spacing = {0, 0.3f, 0.35f}, .count = {1, 3, 2}}},
        {Displace{.amplitude = 0.02f, .frequency = 5}, Bend{.curvature = 2}, Twist{.rate = 1}},
        {Taper{.rate = -2}, Repeat{.spacing = {0, 0, 0.3f}, .count = {1, 1, 3}}, Bend{.curvature = 1.5f}},
    };
    for (size_t i = 0; i < stacks.size(); ++i) {
        Edit e = scaled(warped(bar, stacks[i]), i % 3 == 2 ? vec3{0.7f, 0.9f, 0.6f} : vec3{0.7f, 0.7f, 0.7f});
        e.node.transform.position = {-1.2f + 0.8f * float(i % 4), 0.1f * float(i % 2), -0.75f + 0.75f * float(i / 4)};
        w.edits.push_back(e);
    }
    return w;
}

inline World composites() {
    World w{"composites", {}, around({1.1f, 0.7f, 1.1f})};
    w.edits.push_back(edit(Planet{.radius = 0.35f, .seed = 3, .relief = 0.06f}, {-0.6f, 0, -0.5f}));
    w.edits.push_back(turned(edit(Spaceship{.length = 1.0f}, {0.4f, 0.1f, -0.5f}), {1, 0, 1}, 0.8f));
    w.edits.push_back(turned(edit(Bullet{.length = 0.9f}, {-0.5f, 0, 0.5f}), {0, 0, 1}, 1.2f));
    w.edits.push_back(edit(Ghost{.length = 0.9f}, {0.5f, 0, 0.5f}, Op::Union, 0.05f));
    return w;
}

// A bar bent once around, its ends meeting, cut by a ball where they meet; another one bent on past them.
inline World rings() {
    World w{"rings", {}, around({1.0f, 1.0f, 0.6f})};
    w.edits.push_back(
        warped(edit(Box{.half_extents = {2.5132742f, 0.1f, 0.08f}}, {0, -0.8f, 0}), {Bend{.curvature = 1.25f}}));
    w.edits.push_back(edit(Sphere{.radius = 0.15f}, {0, 0.8f, 0.05f}, Op::Subtract, 0.05f));
    w.edits.push_back(warped(edit(Capsule{.half_height = 0.2f, .radius = 0.07f}, {0, -0.3f, 0}),
                             {Elongate{.half_extents = {1.6f, 0, 0}}, Bend{.curvature = 2.5f}}));
    return w;
}

inline World lattice() {
    World w{"lattice", {}, around({1.1f, 1.1f, 1.1f})};
    w.edits.push_back(
        warped(edit(Octahedron{.radius = 0.2f}), {Repeat{.spacing = {0.5f, 0.45f, 0.6f}, .count = {4, 4, 3}}}));
    w.edits.push_back(warped(edit(Box{.half_extents = {0.03f, 0.9f, 0.03f}}, {}, Op::Union, 0.05f),
                             {Repeat{.spacing = {0.5f, 0, 0.6f}, .count = {4, 1, 3}}}));
    return w;
}

inline World shells() {
    World w{"shells", {}, around({0.9f, 0.9f, 0.9f})};
    w.edits.push_back(warped(edit(Sphere{.radius = 0.5f}), {Shell{.thickness = 0.2f}, Shell{.thickness = 0.06f}}));
    w.edits.push_back(
        warped(scaled(edit(Icosahedron{.radius = 0.4f}, {0.1f, 0, 0}), {1, 1.6f, 0.8f}), {Shell{.thickness = 0.04f}}));
    w.edits.push_back(
        turned(edit(Box{.half_extents = {0.6f, 0.6f, 0.3f}}, {0.2f, 0.3f, 0.5f}, Op::Subtract), {1, 1, 0}, 0.5f));
    return w;
}

// Grounds that leave the grid on all sides.
inline World grounds() {
    World w{"grounds", {}, around({1.3f, 0.8f, 1.3f})};
    w.edits.push_back(warped(edit(Plane{}, {0, -0.3f, 0}), {Displace{.amplitude = 0.12f, .frequency = 2.5f}}));
    w.edits.push_back(turned(edit(Plane{}, {0, -0.35f, 0}, Op::Union, 0.2f), {1, 0, 0.3f}, 0.35f));
    w.edits.push_back(edit(Sphere{.radius = 0.4f}, {0.3f, -0.2f, 0.2f}, Op::Subtract, 0.1f));
    w.edits.push_back(edit(Capsule{.half_height = 0.5f, .radius = 0.1f}, {-0.5f, 0, 0}));
    return w;
}

inline World ground_of_numbers() {
    World w{"ground of numbers", {}, around({1.1f, 0.6f, 1.1f}), {hills()}};
    Shape shape = Heightfield{.size = {2, 2}, .height = 0.4f};
    shape.data = "0";
    w.edits.push_back(turned(edit(shape, {0.02f, 0, -0.03f}), {0, 1, 0}, 0.4f));
    w.edits.push_back(edit(Sphere{.radius = 0.3f}, {0.3f, 0.1f, 0}, Op::Union, 0.15f));
    return w;
}

inline World cliff() {
    World w{"cliff", {}, around({1.2f, 1.2f, 0.8f})};
    w.edits.push_back(edit(Box{.half_extents = {1, 1, 0.5f}}));
    Random r(21);
    for (int i = 0; i < 60; ++i) {
        w.edits.push_back(of_material(
            edit(Sphere{.radius = r.in(0.05f, 0.3f)}, r.point(1), Op::Subtract, r.in(0, 0.1f)), uint32_t(i % 5)));
    }
    return w;
}

// From a tenth of a voxel to two of them across, many voxels long.
inline World needles() {
    World w{"needles", {}, around({1, 1, 1})};
    Random r(22);
    for (int i = 0; i < 24; ++i) {
        const float thin = 0.04f * std::ldexp(1.0f, -(i % 5)) * 1.1f;
        const Edit e = i % 2 == 0 ? edit(Capsule{.half_height = 0.5f, .radius = thin}, r.point(0.5f))
                                  : edit(Cylinder{.half_height = thin, .radius = 0.3f}, r.point(0.6f));
        w.edits.push_back(turned(e, r.direction(), r.in(-3, 3)));
    }
    w.edits.push_back(scaled(edit(Sphere{.radius = 0.5f}, {0, 0.2f, 0}), {0.06f, 1.4f, 0.5f}));
    return w;
}

inline World far_away() {
    const vec3 center{310.7f, -205.1f, 150.3f};
    World w{"far away", {}, around({0.9f, 0.9f, 0.9f}, 0.05f, center)};
    w.edits.push_back(edit(Sphere{.radius = 0.5f}, center));
    w.edits.push_back(
        turned(edit(Box{.half_extents = {0.3f, 0.5f, 0.2f}}, center + vec3{0.3f, 0.2f, 0.1f}, Op::Union, 0.1f),
               {1, 2, 3}, 0.7f));
    w.edits.push_back(edit(Torus{.major_radius = 0.4f, .minor_radius = 0.1f}, center + vec3{0, 0.4f, 0}, Op::Subtract));
    return w;
}

// Intersections, paint, a cut of nothing before all.
inline World shared_parts() {
    World w{"shared parts", {}, around({1, 1, 1})};
    w.edits.push_back(edit(Sphere{.radius = 0.4f}, {}, Op::Subtract));
    w.edits.push_back(edit(Box{.half_extents = {0.8f, 0.6f, 0.8f}}));
    w.edits.push_back(edit(Cylinder{.half_height = 1, .radius = 0.75f}, {}, Op::Intersect, 0.08f));
    w.edits.push_back(of_material(edit(Sphere{.radius = 0.6f}, {0.5f, 0.3f, 0}, Op::Paint, 0.1f), 3));
    w.edits.push_back(
        turned(edit(Cylinder{.half_height = 1, .radius = 0.3f}, {}, Op::Subtract), {1, 0, 0}, 1.5707964f));
    w.edits.push_back(of_material(edit(Icosahedron{.radius = 0.3f}, {0.013f, 0.611f, 0.2f}), 2));
    return w;
}

// Faces on the borders of bricks (7 voxels), on texels and halfway between them; two boxes that share a face, two that share an edge.
inline World on_borders() {
    const float h = 0.05f;
    World w{"on borders", {}, around({1.2f, 1.2f, 1.2f}, h)};
    w.edits.push_back(edit(Box{.half_extents = vec3{7, 7, 7} * h}, vec3{-7, -7, -7} * h));
    w.edits.push_back(edit(Box{.half_extents = vec3{3.5f, 3.5f, 3.5f} * h}, vec3{3.5f, -10.5f, -7} * h));
    w.edits.push_back(edit(Box{.half_extents = vec3{3, 3, 3} * h}, vec3{3, 3, 3} * h));
    w.edits.push_back(edit(Box{.half_extents = vec3{2.25f, 7, 2.25f} * h}, vec3{-7, 7, 7} * h));
    w.edits.push_back(edit(Box{.half_extents = vec3{7, 0.75f, 7} * h}, vec3{7, 14.5f, 7} * h));
    return w;
}

inline World drops() {
    World w{"drops", {}, around({1.2f, 1.2f, 1.2f})};
    Random r(23);
    for (int i = 0; i < 30; ++i)
        w.edits.push_back(
            of_material(edit(Sphere{.radius = r.in(0.1f, 0.25f)}, r.point(0.75f), Op::Union, 0.3f), uint32_t(i % 4)));
    return w;
}

inline std::vector<World> twenty() {
    std::vector<World> out = all();
    for (World& w :
         std::vector<World>{every_shape(), every_warp(), composites(), rings(), lattice(), shells(), grounds(),
                            ground_of_numbers(), cliff(), needles(), far_away(), shared_parts(), on_borders(), drops()})
        out.push_back(std::move(w));
    return out;
}

}  // namespace kiln::field::worlds

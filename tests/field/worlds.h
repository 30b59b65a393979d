// SPDX-License-Identifier: MIT
// Small worlds for the field's tests, and what every test does with one.
#pragma once

#include "field/field.h"
#include "field/host_bricks.h"
#include "sdf/judge.h"
#include "sdf/program.h"

#include <kiln/shapes.h>

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace kiln::field::worlds {

inline std::shared_ptr<const sdf::Program> compiled(const sdf::Source& source) {
    auto program = sdf::compile(source);
    EXPECT_TRUE(program) << (program ? "" : program.error().message);
    return std::make_shared<const sdf::Program>(program ? std::move(*program) : sdf::Program{});
}
inline std::shared_ptr<const sdf::Program> compiled(const std::vector<Edit>& edits) {
    return compiled(sdf::Source{edits, {}, {}});
}

inline Edit edit(Shape shape, vec3 position = {}, Op op = Op::Union, float blend = 0) {
    Edit e;
    e.node.shape = std::move(shape);
    e.node.transform.position = position;
    e.op = op;
    e.blend_radius = blend;
    return e;
}

inline Edit of_material(Edit e, uint32_t index) {
    e.node.material = MaterialId{index, 0};
    return e;
}

struct World {
    std::string name;
    std::vector<Edit> edits;
    FieldOptions options;
    std::vector<sdf::HeightGrid> grids{};
    std::vector<sdf::MeshGrid> meshes{};

    sdf::Source source() const { return {.edits = edits, .objects = {}, .grids = grids, .meshes = meshes}; }
    std::shared_ptr<const Field> field() const {
        auto made = Field::build(compiled(source()), options);
        EXPECT_TRUE(made) << (made ? "" : made.error().message);
        return made ? *made : nullptr;
    }
};

/// A program that follows a list of edits by rows, as a world does.
class Live {
public:
    explicit Live(const std::vector<Edit>& edits) : edits_(edits) {
        program_ = *compiled(edits);
        for (uint32_t i = 0; i < edits.size(); ++i) rows_.push_back(i);
    }
    std::shared_ptr<const sdf::Program> program() const { return std::make_shared<const sdf::Program>(program_); }
    /// What must change to make it the program of `edits`: rows between the common beginning and the common end.
    std::vector<RowChange> become(const std::vector<Edit>& edits) {
        const size_t most = std::min(edits.size(), edits_.size());
        size_t first = 0, last = 0;
        while (first < most && edits[first] == edits_[first]) ++first;
        while (last < most - first && edits[edits.size() - 1 - last] == edits_[edits_.size() - 1 - last]) ++last;
        std::vector<RowChange> changes;
        for (size_t i = first; i < edits_.size() - last; ++i) {
            program_.remove(rows_[i]);
            changes.push_back({rows_[i], kNoRow});
        }
        rows_.erase(rows_.begin() + ptrdiff_t(first), rows_.end() - ptrdiff_t(last));
        for (size_t i = first; i < edits.size() - last; ++i) {
            const auto order_of = [&](size_t at) { return program_.edits[rows_[at]].order; };
            const auto order = [&] {
                return sdf::order_between(i > 0 ? order_of(i - 1) : 0, i < rows_.size() ? order_of(i) : UINT64_MAX);
            };
            if (order() == 0) program_.number_anew(rows_);
            auto row = sdf::insert(program_, edits[i], {}, {}, order(), uint32_t(i));
            EXPECT_TRUE(row) << (row ? "" : row.error().message);
            rows_.insert(rows_.begin() + ptrdiff_t(i), *row);
            changes.push_back({kNoRow, *row});
        }
        edits_ = edits;
        return changes;
    }

private:
    std::vector<Edit> edits_;
    std::vector<uint32_t> rows_;
    sdf::Program program_;
};

class Random {
public:
    explicit Random(uint32_t seed) : engine_(seed) {}
    float in(float lo, float hi) { return std::uniform_real_distribution<float>(lo, hi)(engine_); }
    int below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(engine_); }
    vec3 point(float size) { return {in(-size, size), in(-size, size), in(-size, size)}; }
    vec3 direction() {
        while (true) {
            const vec3 v = point(1);
            const float size = length(v);
            if (size > 0.1f && size < 1) return v / size;
        }
    }
    uint32_t bits() { return uint32_t(engine_()); }

    Edit edit(float spread) {
        Edit e;
        switch (below(5)) {
        case 0:
            e.node.shape = Sphere{.radius = in(0.1f, 0.4f)};
            break;
        case 1:
            e.node.shape = Box{.half_extents = {in(0.05f, 0.4f), in(0.05f, 0.4f), in(0.05f, 0.4f)}};
            break;
        case 2:
            e.node.shape = Torus{.major_radius = in(0.2f, 0.4f), .minor_radius = in(0.04f, 0.12f)};
            break;
        case 3:
            e.node.shape = RoundedBox{.half_extents = {0.3f, 0.2f, 0.25f}, .rounding = in(0.01f, 0.15f)};
            break;
        default:
            e.node.shape = Capsule{.half_height = in(0, 0.4f), .radius = in(0.05f, 0.2f)};
            break;
        }
        e.node.transform.position = point(spread);
        e.node.transform.rotation = axis_angle(direction(), in(-3, 3));
        if (below(3) == 0) e.node.transform.scale = {in(0.5f, 2), in(0.5f, 2), in(0.5f, 2)};
        if (below(4) == 0) e.node.domain.push_back(Twist{.rate = in(-3, 3)});
        if (below(4) == 0) e.node.domain.push_back(Round{.radius = in(0, 0.05f)});
        e.op = below(10) < 6 ? Op::Union : (below(4) != 0 ? Op::Subtract : Op::Paint);
        if (below(2) == 0) e.blend_radius = in(0.01f, 0.2f);
        e.node.material = MaterialId{uint32_t(below(6)), 0};
        return e;
    }

private:
    std::mt19937 engine_;
};

inline World sphere_of(float radius_voxels, vec3 center_voxels = {0.3f, -0.2f, 0.4f}, float h = 0.05f) {
    const float size = (radius_voxels + 8) * h;
    return {"sphere",
            {edit(Sphere{.radius = radius_voxels * h}, center_voxels * h)},
            {.voxel_size = h, .bounds = {{-size, -size, -size}, {size, size, size}}}};
}

/// About 40 edits in 2 m: unions, cuts, blends, warps, scales, paints.
inline World jumble(uint32_t seed = 7, int count = 40) {
    World w{"jumble", {}, {.voxel_size = 0.04f, .bounds = {{-1.6f, -1.5f, -1.7f}, {1.5f, 1.6f, 1.5f}}}};
    Random r(seed);
    for (int i = 0; i < count; ++i) w.edits.push_back(r.edit(1.0f));
    return w;
}

/// Sheets half a voxel thick, at an offset from the lattice.
inline World thin_walls() {
    World w{"thin walls", {}, {.voxel_size = 0.04f, .bounds = {{-0.9f, -0.9f, -0.9f}, {0.9f, 0.9f, 0.9f}}}};
    w.edits.push_back(edit(Box{.half_extents = {0.01f, 0.6f, 0.6f}}, {0.02f, 0, 0}));
    w.edits.push_back(edit(Box{.half_extents = {0.6f, 0.01f, 0.6f}}, {0, -0.013f, 0}));
    Edit tilted = edit(Box{.half_extents = {0.5f, 0.5f, 0.008f}}, {0.1f, 0.05f, 0.3f});
    tilted.node.transform.rotation = axis_angle(normalize(vec3{1, 2, 0.3f}), 0.4f);
    w.edits.push_back(tilted);
    return w;
}

/// Formulas: alone, in a cut, blended, scaled, and one with branches enough to prune.
inline World formulas() {
    World w{"formulas", {}, {.voxel_size = 0.05f, .bounds = {{-1.6f, -1.5f, -1.7f}, {1.5f, 1.6f, 1.5f}}}};
    w.edits.push_back(edit(Expression{.expression = "length(p) - 0.8 - 0.1*sin(8*x)*cos(5*y)"}));
    w.edits.push_back(
        edit(Expression{.expression = "s = 7; max(abs(dot(sin(s*p), cos(s*p.yzx))/s) - 0.04, length(p) - 0.5)",
                        .half_extents = {0.6f, 0.6f, 0.6f}},
             {0.6f, 0.5f, 0}, Op::Union, 0.05f));
    w.edits.back().node.material = MaterialId{2, 0};
    std::string drops = "1";
    for (int i = 0; i < 24; ++i)
        drops = "min(" + drops + ", length(p - vec3(" + std::to_string(0.06 * i - 0.7) + ", " +
                std::to_string(0.5 * ((i * 7) % 5) - 1) + "*0.5, 0)) - 0.06)";
    Edit cut = edit(Expression{.expression = drops}, {0, 0, 0.7f}, Op::Subtract, 0.03f);
    cut.node.transform.scale = {1, 0.8f, 1.2f};
    w.edits.push_back(cut);
    return w;
}

inline World boxes() {
    World w{"boxes", {}, {.voxel_size = 0.05f, .bounds = {{-1.5f, -1.5f, -1.5f}, {1.5f, 1.5f, 1.5f}}}};
    w.edits.push_back(
        edit(Box{.half_extents = {0.7f, 0.35f, 0.5f}}));  // faces on texels and on cell faces (0.35 = 7 voxels)
    w.edits.push_back(edit(Box{.half_extents = {0.2f, 0.9f, 0.2f}}, {0.1f, 0, 0}, Op::Subtract));
    Edit turned = edit(Box{.half_extents = {0.4f, 0.4f, 0.4f}}, {-0.6f, 0.5f, 0.2f});
    turned.node.transform.rotation = axis_angle(normalize(vec3{1, 1, 0}), 0.7f);
    w.edits.push_back(turned);
    return w;
}

inline World blends() {
    World w{"blends", {}, {.voxel_size = 0.04f, .bounds = {{-1.4f, -1.4f, -1.4f}, {1.4f, 1.4f, 1.4f}}}};
    w.edits.push_back(of_material(edit(Sphere{.radius = 0.5f}, {-0.3f, 0, 0}), 1));
    w.edits.push_back(of_material(edit(Sphere{.radius = 0.4f}, {0.4f, 0.1f, 0}, Op::Union, 0.3f), 2));
    w.edits.push_back(
        of_material(edit(Torus{.major_radius = 0.6f, .minor_radius = 0.12f}, {0, 0.2f, 0.1f}, Op::Union, 0.1f), 3));
    w.edits.push_back(of_material(edit(Sphere{.radius = 0.35f}, {0, 0.5f, 0.3f}, Op::Subtract, 0.15f), 4));
    return w;
}

inline std::vector<World> all() {
    return {sphere_of(10), boxes(), blends(), thin_walls(), jumble(7), jumble(11, 60), formulas()};
}

}  // namespace kiln::field::worlds

// SPDX-License-Identifier: MIT
// Random changes of a world, of every kind, for the tests of history and journal. The same seed makes the same changes.
#pragma once

#include "base/hash.h"

#include <kiln/world.h>

#include <random>
#include <string>
#include <vector>

namespace kiln::scene {

class RandomChanges {
public:
    explicit RandomChanges(uint32_t seed) : random_(seed) {}

    int below(int n) { return int(random_() % uint32_t(n)); }
    float number(float low, float high) { return low + (high - low) * float(random_() >> 8) / float(1 << 24); }
    vec3 point(float size) { return {number(-size, size), number(-size, size), number(-size, size)}; }

    Edit edit(const World& world, int materials) {
        Edit e;
        switch (below(4)) {
        case 0:
            e.node.shape = Sphere{.radius = number(0.05f, 0.4f)};
            break;
        case 1:
            e.node.shape = Box{.half_extents = {number(0.05f, 0.3f), number(0.05f, 0.3f), number(0.05f, 0.3f)}};
            break;
        case 2:
            e.node.shape = Torus{.major_radius = number(0.2f, 0.4f), .minor_radius = number(0.02f, 0.1f)};
            break;
        default:
            e.node.shape = Capsule{.half_height = number(0, 0.3f), .radius = number(0.05f, 0.2f)};
            e.node.domain.push_back(Round{.radius = number(0, 0.05f)});
        }
        if (objects_ > 0 && below(8) == 0) {
            e.node.kind = Node::Kind::Object;
            e.node.object = {uint32_t(below(objects_)), 0};
            e.node.domain.clear();
        }
        e.node.transform.position = point(1);
        if (below(3) == 0) e.node.transform.rotation = axis_angle(normalize(point(1) + vec3{0, 2, 0}), number(-3, 3));
        if (below(4) == 0) e.node.transform.scale = {number(0.5f, 2), number(0.5f, 2), number(0.5f, 2)};
        e.op = Op(below(3));
        if (e.op == Op::Intersect) e.op = Op::Union;  // would leave next to nothing
        e.blend_radius = below(2) ? number(0, 0.2f) : 0;
        if (materials > 0 && below(2)) e.node.material = {uint32_t(below(materials)), 0};
        if (below(6) == 0) e.group = "group \"" + std::to_string(below(3)) + "\"";
        if (below(8) == 0) e.outline = Outline{.color = {1, number(0, 1), 0}, .width_px = number(1, 5)};
        e.hidden = below(10) == 0;
        if (below(4) == 0) e.name = "n-" + std::to_string(random_() % 1000000u);
        if (!e.name.empty() && world.find_edit(e.name)) e.name.clear();
        return e;
    }

    /// Makes one; false when the world refused it.
    bool one(World& world) {
        const std::vector<EditId> ids = world.edits();
        const auto any = [&] { return ids[size_t(below(int(ids.size())))]; };
        const int what = ids.empty() ? 0 : below(23);
        if (what < 8)
            return bool(below(3) ? world.add(edit(world, materials_))
                                 : world.insert(edit(world, materials_), ids.empty() ? EditId{} : any()));
        if (what < 14) return bool(world.change(any(), edit(world, materials_)));
        if (what < 17) return bool(world.remove(any()));
        if (what < 19) return bool(world.reorder(any(), below(3) ? any() : EditId{}));
        if (what < 21) {
            const MaterialId id =
                world.add_material("m" + std::to_string(below(6)), {.base_color = {number(0, 1), 0.5f, 0.5f}});
            materials_ = 0;
            while (world.material({uint32_t(materials_), 0}) != nullptr) ++materials_;
            return bool(id);
        }
        if (what == 21) {
            Object object;
            object.name = "o" + std::to_string(random_() % 1000000u);
            object.nodes.resize(3);
            object.nodes[0].kind = Node::Kind::Fold;
            object.nodes[0].op = Op::Subtract;
            object.nodes[0].children = {1, 2};
            object.nodes[1].shape = Sphere{.radius = number(0.2f, 0.4f)};
            object.nodes[2].shape = Sphere{.radius = 0.15f};
            const auto id = world.add_object(object);
            if (id) objects_ = int(id->index) + 1;
            return bool(id);
        }
        switch (below(4)) {  // one section: one step
        case 0:
            world.lights.resize(size_t(below(3)));
            for (Light& light : world.lights) light.illuminance = number(0, 5);
            break;
        case 1:
            world.cameras = {{"main", Camera{.position = point(4) + vec3{0, 0, 9}}}};
            break;
        case 2:
            world.field_settings.voxel_size = number(0.02f, 0.03f);
            break;
        default:
            world.environment = below(2) ? std::optional(Environment{.intensity = number(0, 2)}) : std::nullopt;
        }
        return bool(world.history().record());
    }
    /// Numbers of materials and objects that edits may name; after an undo there may be fewer.
    void look(const World& world) {
        materials_ = objects_ = 0;
        while (world.material({uint32_t(materials_), 0}) != nullptr) ++materials_;
    }

private:
    std::mt19937 random_;
    int materials_ = 0, objects_ = 0;
};

}  // namespace kiln::scene

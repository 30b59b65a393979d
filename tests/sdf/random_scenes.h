// SPDX-License-Identifier: MIT
// Random worlds of edits and object trees, and clouds of points to ask them at.
#pragma once

#include "sdf/eval.h"
#include "sdf/program.h"

#include <kiln/shapes.h>

#include <random>
#include <string>
#include <vector>

namespace kiln::sdf {

struct Scene {
    std::vector<Edit> edits;
    std::vector<Object> objects;
    Source source() const { return {edits, objects, {}}; }
};

class Random {
public:
    explicit Random(uint32_t seed) : engine_(seed) {}
    float in(float lo, float hi) { return std::uniform_real_distribution<float>(lo, hi)(engine_); }
    int below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(engine_); }
    vec3 point(float size) { return {in(-size, size), in(-size, size), in(-size, size)}; }
    Transform transform(float spread) {
        Transform t;
        t.position = point(spread);
        t.rotation = axis_angle(normalize(point(1) + vec3{0, 0, 0.01f}), in(-3, 3));
        if (below(3) == 0) t.scale = {in(0.5f, 2), in(0.5f, 2), in(0.5f, 2)};
        return t;
    }
    Shape shape() {
        switch (below(3)) {
        case 0:
            return Sphere{.radius = in(0.1f, 0.5f)};
        case 1:
            return Box{.half_extents = {in(0.1f, 0.5f), in(0.1f, 0.5f), in(0.1f, 0.5f)}};
        default:
            return Torus{.major_radius = in(0.2f, 0.5f), .minor_radius = in(0.05f, 0.15f)};
        }
    }
    std::vector<Warp> domain() {
        std::vector<Warp> out;
        for (int n = below(3); n > 0; --n) {
            if (below(2) == 0) {
                out.push_back(Twist{.rate = in(-2, 2)});
            } else {
                out.push_back(Round{.radius = in(0, 0.1f)});
            }
        }
        if (below(3) == 0) out.push_back(Repeat{.spacing = {in(3, 9), 0, in(3, 9)}, .count = {float(below(4)), 0, 2}});
        return out;
    }
    Node leaf() {
        Node n;
        n.shape = shape();
        n.transform = transform(1);
        n.domain = domain();
        if (below(2) == 0) n.material = MaterialId{uint32_t(below(5)), 0};
        return n;
    }

private:
    std::mt19937 engine_;
};

inline Scene random_scene(uint32_t seed, int edits) {
    Random r(seed);
    Scene s;
    for (int o = 0; o < 3; ++o) {
        Object object;
        object.name = "o" + std::to_string(o);
        // A random tree, children after parents.
        object.nodes.emplace_back();
        for (size_t n = 0; n < object.nodes.size(); ++n) {
            const bool fold = n == 0 || (r.below(3) == 0 && object.nodes.size() < 20);
            Node node = r.leaf();
            if (fold) {
                node.kind = Node::Kind::Fold;
                node.op = Op(r.below(4));
                node.blend_radius = r.below(2) == 0 ? 0.0f : r.in(0.01f, 0.3f);
                node.domain.clear();
                for (int c = r.below(4) + 1; c > 0; --c) {
                    node.children.push_back(uint32_t(object.nodes.size()));
                    object.nodes.emplace_back();
                }
            } else if (o > 0 && r.below(4) == 0) {
                node.kind = Node::Kind::Object;
                node.object = ObjectId{uint32_t(r.below(o)), 0};
                node.domain.clear();
            }
            object.nodes[n] = node;
        }
        s.objects.push_back(object);
    }
    for (int e = 0; e < edits; ++e) {
        Edit edit;
        edit.node = r.leaf();
        if (r.below(4) == 0) {
            edit.node.kind = Node::Kind::Object;
            edit.node.object = ObjectId{uint32_t(r.below(3)), 0};
            edit.node.domain.clear();
        }
        edit.node.transform.position = r.point(3);
        edit.op = e == 0 ? Op::Union : Op(r.below(8) < 5 ? 0 : r.below(2) == 0 ? 1 : r.below(4) == 0 ? 2 : 3);
        edit.blend_radius = r.below(2) == 0 ? 0.0f : r.in(0.01f, 0.4f);
        s.edits.push_back(edit);
    }
    return s;
}

struct Cloud {
    std::vector<float> x, y, z;
    Points points() const { return {x.data(), y.data(), z.data(), int(x.size())}; }
    void add(vec3 p) {
        x.push_back(p.x);
        y.push_back(p.y);
        z.push_back(p.z);
    }
};

}  // namespace kiln::sdf

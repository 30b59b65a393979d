// SPDX-License-Identifier: MIT

#include "scene/part_tree.h"

#include "scene/region.h"

#include <kiln/shapes.h>

#include <utility>
#include <vector>

namespace kiln::scene {

namespace {

// The edits as one tree: a fold for each run of edits that act alike. Leading cuts of nothing are left out.
std::vector<Node> folded(std::span<const Edit* const> edits) {
    std::vector<Node> out;  // children first
    uint32_t top = 0;
    for (const Edit* e : edits) {
        if (e->hidden || (out.empty() && e->op != Op::Union)) continue;
        out.push_back(e->node);
        const auto leaf = uint32_t(out.size() - 1);
        if (leaf == 0) continue;
        Node& before = out[top];
        if (before.kind == Node::Kind::Fold && before.op == e->op && before.blend_radius == e->blend_radius &&
            before.material_blend_radius == e->material_blend_radius) {
            before.children.push_back(leaf);
            continue;
        }
        Node fold;
        fold.kind = Node::Kind::Fold;
        fold.op = e->op;
        fold.blend_radius = e->blend_radius;
        fold.material_blend_radius = e->material_blend_radius;
        fold.children = {top, leaf};
        out.push_back(std::move(fold));
        top = uint32_t(out.size() - 1);
    }
    return out;
}

// The tree's top: the last fold, or the only leaf.
uint32_t top_of(const std::vector<Node>& nodes) {
    uint32_t top = 0;
    for (uint32_t i = 0; i < nodes.size(); ++i)
        if (nodes[i].kind == Node::Kind::Fold) top = i;
    return top;
}

// With the root first and children behind their parents, numbered by levels: a fold that grew has children behind it.
Object rooted(std::string name, std::vector<Node> nodes, uint32_t root) {
    Object out{std::move(name), {}};
    std::vector<uint32_t> order{root};
    for (size_t i = 0; i < order.size(); ++i) {
        Node node = std::move(nodes[order[i]]);
        for (uint32_t& child : node.children) {
            order.push_back(child);
            child = uint32_t(order.size() - 1);
        }
        out.nodes.push_back(std::move(node));
    }
    return out;
}

}  // namespace

Node region_node(const field::RegionMask& mask) {
    Node out;
    out.shape = SampledMesh{};
    out.shape.data = region_text(mask);
    return out;
}

Box3 box_of(const field::RegionMask& mask) {
    const auto place = [&](field::ivec3 p) { return vec3{float(p.x), float(p.y), float(p.z)} * mask.voxel_size; };
    return {place(mask.first), place(mask.first + mask.size)};
}

Object object_of(std::string name, std::span<const Edit* const> edits) {
    std::vector<Node> nodes = folded(edits);
    const uint32_t top = top_of(nodes);
    return rooted(std::move(name), std::move(nodes), top);
}

Object object_of_part(std::string name, std::span<const Edit* const> edits, const field::RegionMask& region,
                      vec3 origin) {
    std::vector<Node> nodes = folded(edits);
    Node root;
    root.kind = Node::Kind::Fold;
    root.op = Op::Intersect;
    root.transform.position = -origin;
    root.children = {top_of(nodes), uint32_t(nodes.size())};
    nodes.push_back(region_node(region));
    nodes.push_back(std::move(root));
    const auto last = uint32_t(nodes.size() - 1);
    return rooted(std::move(name), std::move(nodes), last);
}

}  // namespace kiln::scene

// SPDX-License-Identifier: MIT
// Tree: writes an object's nodes from the root down, so that children come after their parents.
#pragma once

#include <kiln/edit.h>
#include <kiln/shapes.h>

#include <string>
#include <utility>
#include <vector>

namespace kiln::sdf {

using param = float;  // the word that records of shapes are written with

inline Transform at(vec3 position, quat rotation = {}, vec3 scale = {1, 1, 1}) { return {position, rotation, scale}; }

class Tree {
public:
    /// The root folds its children with `op`; everything in it is made larger by `size`.
    Tree(std::string name, Op op, float blend_radius, float size = 1) {
        object_.name = std::move(name);
        Node root;
        root.kind = Node::Kind::Fold;
        root.op = op;
        root.blend_radius = root.material_blend_radius = blend_radius;
        root.transform.scale = {size, size, size};
        object_.nodes.push_back(std::move(root));
    }

    /// A node with children of its own; answers its number.
    uint32_t fold(uint32_t parent, Op op, float blend_radius, Transform transform = {}, std::vector<Warp> domain = {}) {
        Node node;
        node.kind = Node::Kind::Fold;
        node.op = op;
        node.blend_radius = node.material_blend_radius = blend_radius;
        return add(parent, std::move(node), transform, std::move(domain));
    }

    uint32_t leaf(uint32_t parent, const Shape& shape, Transform transform = {}, std::vector<Warp> domain = {}) {
        Node node;
        node.shape = shape;
        return add(parent, std::move(node), transform, std::move(domain));
    }

    /// A leaf and its reflection in x = 0; `transform` places the one at +X.
    void pair(uint32_t parent, const Shape& shape, Transform transform, std::vector<Warp> domain = {}) {
        leaf(fold(parent, Op::Union, 0, {}, {Mirror{.axis = 0}}), shape, transform, std::move(domain));
    }

    Object take() { return std::move(object_); }

private:
    uint32_t add(uint32_t parent, Node node, Transform transform, std::vector<Warp> domain) {
        node.transform = transform;
        node.domain = std::move(domain);
        const auto index = uint32_t(object_.nodes.size());
        object_.nodes.push_back(std::move(node));
        object_.nodes[parent].children.push_back(index);
        return index;
    }

    Object object_;
};

}  // namespace kiln::sdf

// SPDX-License-Identifier: MIT
// The meshes of one frame, on the host: which parts there are, where each is now and was before, and the tree of their boxes. The renderer
// and its judge both draw from it. A part is one primitive of one node of one mesh.
#pragma once

#include "model/drawable.h"
#include "render/passes/mesh.gpu.h"

#include <kiln/renderer.h>

#include <memory>
#include <vector>

namespace kiln::render {

struct MeshSet {
    struct Part {
        uint32_t model = 0;               // of `models`
        uint32_t primitive = 0;           // of that model
        uint32_t mesh = 0;                // of Frame::meshes
        uint32_t number = 0;              // in the frame's own order, which nothing that moves changes
        model::Matrix place{}, before{};  // world from local
        Box3 bounds;                      // world, grown by rounding
        // Of a skinned part: its vertices are `moved` from here on, in world metres, and its boxes `nodes`.
        uint32_t first_moved = UINT32_MAX, first_node = 0;
    };
    std::vector<std::shared_ptr<const model::Drawable>> models;  // each once
    std::vector<Part> parts;                                     // in the order of the leaves of `tree`
    std::vector<model::BvhNode> tree;                            // over the parts
    std::vector<model::Vertex> moved;
    std::vector<model::BvhNode> moved_nodes;

    bool empty() const { return parts.empty(); }
    const model::Drawable& drawable(const Part& part) const { return *models[part.model]; }
    const model::Primitive& primitive(const Part& part) const { return drawable(part).primitives[part.primitive]; }
    const model::Vertex* vertices(const Part& part) const;  // what the corners of its triangles count from
    const model::BvhNode* nodes(const Part& part) const;
};

MeshSet make_mesh_set(const Frame& frame);

}  // namespace kiln::render

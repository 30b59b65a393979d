// SPDX-License-Identifier: MIT
// Meshes on the device. What models hold (vertices, triangles, trees of boxes, surfaces, textures) is brought once and stays while the same
// models are drawn; where parts are is brought anew every frame. Owner's thread.
#pragma once

#include "render/graph_runner.h"
#include "render/lib/camera.gpu.h"
#include "render/mesh_set.h"
#include "render/passes/mesh_cull.gpu.h"

#include <array>
#include <string>
#include <vector>

namespace kiln::render {

// An outlined mesh.
struct MeshOutline {
    Outline outline;
    vec3 middle;  // of its box, metres from the eye
    uint32_t first_cluster = 0, clusters = 0;
};

// A part that shadows: all of them, in the order of MeshHandles::parts.
struct MeshCaster {
    model::Matrix place{};  // world from local
    Box3 bounds;            // world
    uint32_t triangles = 0;
    bool holes = false;
};

// A frame's meshes as resources of a graph.
struct MeshHandles {
    Buffer clusters;  // MeshClusterRef: one-sided parts first, then double-sided ones, then those with holes
    Buffer parts;     // MeshPart
    Buffer corners, vertices, surfaces;
    Buffer nodes;  // MeshNode: the parts' tree, then each part's
    std::array<Image, 2 * kMeshPages> pages;
    uint32_t one_sided = 0, double_sided = 0, masked = 0;  // clusters
    std::vector<MeshOutline> outlined;                     // their clusters follow those
    Buffer boxes;                                          // MeshBox: of each cluster
    Buffer seen;  // a word for each cluster of all parts: whether the last picture showed it; stays
    uint32_t listed() const { return one_sided + double_sided + masked; }
};

class GpuMeshes {
public:
    explicit GpuMeshes(Runner& runner) : runner_(&runner) {}
    ~GpuMeshes();
    GpuMeshes(const GpuMeshes&) = delete;
    GpuMeshes& operator=(const GpuMeshes&) = delete;

    // Fails where the device has no room; a set that is larger than buffers may be is one error of kind Input. Parts that the camera cannot see
    // are not drawn, though they shadow.
    Result<void> update(const Frame& frame, const shade::CameraParams& camera);
    MeshHandles import(Graph& g) const;
    bool empty() const { return parts_.empty(); }
    bool holes() const { return holes_; }  // in some part, in sight or not
    // Of parts that blend, metres from the eye.
    const std::vector<Box3>& blends() const { return blends_; }
    const std::vector<MeshOutline>& outlined() const { return outlined_; }
    const std::vector<MeshCaster>& casters() const { return casters_; }
    uint64_t triangles() const { return triangles_; }
    // Of parts in sight: what is drawn where nothing hidden is left out.
    uint64_t triangles_in_sight() const { return triangles_in_sight_; }
    uint32_t clusters_in_sight() const { return one_sided_ + double_sided_ + masked_; }

private:
    struct Model {
        uint32_t first_vertex = 0, first_corner = 0, first_node = 0, first_surface = 0;
        std::vector<uint32_t> first_boxes = {};  // by primitive
    };
    Result<void> bring(const MeshSet& set);
    Result<void> bring_textures(const MeshSet& set, std::vector<MeshSurface>& surfaces);
    Result<void> bring_page(size_t page, rhi::Extent size, const std::vector<std::vector<uint8_t>>& layers);
    Result<void> count_clusters(const MeshSet& set);
    void let_go();

    Runner* runner_;
    std::vector<std::shared_ptr<const model::Drawable>> models_;
    std::vector<Model> places_;  // by model
    uint32_t top_nodes_ = 0;     // room for the parts' tree
    uint32_t moved_vertices_ = 0, moved_nodes_ = 0, first_moved_vertex_ = 0, first_moved_node_ = 0;
    uint32_t moved_boxes_ = 0, first_moved_box_ = 0;
    std::vector<uint32_t> first_clusters_;  // by part
    uint32_t clusters_of_all_ = 0;
    rhi::BufferHandle corners_, vertices_, surfaces_, nodes_, boxes_, seen_;
    std::array<rhi::TextureHandle, 2 * kMeshPages> pages_;
    std::vector<MeshPart> parts_;
    std::vector<MeshClusterRef> clusters_;
    uint32_t one_sided_ = 0, double_sided_ = 0, masked_ = 0;
    bool holes_ = false;
    std::vector<Box3> blends_;
    std::vector<MeshOutline> outlined_;
    std::vector<MeshCaster> casters_;
    uint64_t triangles_ = 0, triangles_in_sight_ = 0;
};

}  // namespace kiln::render

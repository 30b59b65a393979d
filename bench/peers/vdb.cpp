// SPDX-License-Identifier: MIT
// The peers OpenVDB and NanoVDB, as a plug-in of `kiln bench` (measure/peer_table.h): kiln_peers.so beside the program.
// Each does what its own documentation recommends for the job: spheres by the analytic creator, boxes as meshes, unions of many grids in
// one pass of the merge operator, a subtraction as a destructive CSG of two grids, samples and rays through accessors.

#include "measure/peer_table.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Composite.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <openvdb/tools/Merge.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/Prune.h>
#include <openvdb/tools/RayIntersector.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <openvdb/tree/NodeManager.h>

#include <nanovdb/util/HDDA.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <nanovdb/util/Ray.h>
#include <nanovdb/util/SampleFromVoxels.h>

#include <tbb/global_control.h>

#include <memory>
#include <vector>

namespace {

using openvdb::FloatGrid;
using openvdb::FloatTree;

constexpr float kBand = 3;  // voxels

struct Grid {
    FloatGrid::Ptr tree;
    nanovdb::GridHandle<nanovdb::HostBuffer> flat;  // made when it is asked for

    const nanovdb::FloatGrid* flattened() {
        if (!flat) flat = nanovdb::openToNanoVDB(*tree);
        return flat.grid<float>();
    }
};

class Threads {
public:
    explicit Threads(int count) : limit_(tbb::global_control::max_allowed_parallelism, size_t(count)) {}

private:
    tbb::global_control limit_;
};

FloatGrid::Ptr box_grid(const KilnPeerEdit& edit, double voxel) {
    std::vector<openvdb::Vec3s> points;
    for (int i = 0; i < 8; ++i) {
        points.emplace_back(edit.center[0] + ((i & 1) != 0 ? 1 : -1) * edit.size[0],
                            edit.center[1] + ((i & 2) != 0 ? 1 : -1) * edit.size[1],
                            edit.center[2] + ((i & 4) != 0 ? 1 : -1) * edit.size[2]);
    }
    const std::vector<openvdb::Vec4I> quads{{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                            {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
    return openvdb::tools::meshToLevelSet<FloatGrid>(*transform, points, quads, kBand);
}

FloatGrid::Ptr grid_of(const KilnPeerEdit& edit, double voxel) {
    if (edit.box != 0) return box_grid(edit, voxel);
    return openvdb::tools::createLevelSetSphere<FloatGrid>(
        edit.size[0], openvdb::Vec3f(edit.center[0], edit.center[1], edit.center[2]), float(voxel), kBand);
}

void* build(const KilnPeerEdit* edits, uint32_t count, double voxel, int threads) {
    const Threads limit(threads);
    auto out = std::make_unique<Grid>();
    std::vector<FloatGrid::Ptr> grids;
    grids.reserve(count);
    bool unions = true;
    for (uint32_t i = 0; i < count; ++i) {
        grids.push_back(grid_of(edits[i], voxel));
        unions = unions && edits[i].subtract == 0;
    }
    out->tree = openvdb::createLevelSet<FloatGrid>(voxel, kBand);
    if (unions && count > 0) {
        std::vector<openvdb::tools::TreeToMerge<FloatTree>> trees;
        trees.reserve(count);
        for (const FloatGrid::Ptr& grid : grids) trees.emplace_back(grid->tree(), openvdb::Steal());
        openvdb::tools::CsgUnionOp<FloatTree> merge(trees);
        openvdb::tree::DynamicNodeManager<FloatTree> nodes(out->tree->tree());
        nodes.foreachTopDown(merge);
        openvdb::tools::pruneLevelSet(out->tree->tree());
    } else {
        for (uint32_t i = 0; i < count; ++i) {
            if (edits[i].subtract != 0) {
                openvdb::tools::csgDifference(*out->tree, *grids[i]);
            } else {
                openvdb::tools::csgUnion(*out->tree, *grids[i]);
            }
        }
    }
    return out.release();
}

void* copy(const void* grid) {
    auto out = std::make_unique<Grid>();
    out->tree = static_cast<const Grid*>(grid)->tree->deepCopy();
    return out.release();
}

void release(void* grid) { delete static_cast<Grid*>(grid); }

void measure(const void* grid, uint64_t* voxels, uint64_t* bytes) {
    const auto* g = static_cast<const Grid*>(grid);
    *voxels = g->tree->activeVoxelCount();
    *bytes = g->tree->tree().memUsage();
}

void bite(void* grid, const float* center, float radius, int threads) {
    const Threads limit(threads);
    auto* g = static_cast<Grid*>(grid);
    const double voxel = g->tree->voxelSize()[0];
    const auto sphere = openvdb::tools::createLevelSetSphere<FloatGrid>(
        radius, openvdb::Vec3f(center[0], center[1], center[2]), float(voxel), kBand);
    openvdb::tools::csgDifference(*g->tree, *sphere);
    g->flat = {};
}

void sample_tree(const void* grid, const float* points, uint64_t count, float* out) {
    const auto* g = static_cast<const Grid*>(grid);
    const double inverse = 1 / g->tree->voxelSize()[0];
    const auto accessor = g->tree->getConstAccessor();
    for (uint64_t i = 0; i < count; ++i) {
        const openvdb::Vec3d p(points[3 * i] * inverse, points[3 * i + 1] * inverse, points[3 * i + 2] * inverse);
        out[i] = openvdb::tools::BoxSampler::sample(accessor, p);
    }
}

void sample_flat(const void* grid, const float* points, uint64_t count, float* out) {
    auto* g = const_cast<Grid*>(static_cast<const Grid*>(grid));
    const float inverse = float(1 / g->tree->voxelSize()[0]);
    const auto accessor = g->flattened()->getAccessor();
    const auto sampler = nanovdb::createSampler<1>(accessor);
    for (uint64_t i = 0; i < count; ++i) {
        out[i] =
            sampler(nanovdb::Vec3f(points[3 * i] * inverse, points[3 * i + 1] * inverse, points[3 * i + 2] * inverse));
    }
}

uint64_t cast_tree(const void* grid, const float* rays, uint64_t count, float* t) {
    const auto* g = static_cast<const Grid*>(grid);
    openvdb::tools::LevelSetRayIntersector<FloatGrid> intersector(*g->tree);
    uint64_t hits = 0;
    for (uint64_t i = 0; i < count; ++i) {
        const float* r = rays + 6 * i;
        openvdb::Vec3d world, normal;
        double at = 0;
        const openvdb::math::Ray<double> ray(openvdb::Vec3d(r[0], r[1], r[2]), openvdb::Vec3d(r[3], r[4], r[5]));
        const bool hit = intersector.intersectsWS(ray, world, normal, at);
        t[i] = hit ? float(at) : -1;
        hits += hit ? 1 : 0;
    }
    return hits;
}

uint64_t cast_flat(const void* grid, const float* rays, uint64_t count, float* t) {
    auto* g = const_cast<Grid*>(static_cast<const Grid*>(grid));
    const nanovdb::FloatGrid* flat = g->flattened();
    auto accessor = flat->getAccessor();
    const float voxel = float(g->tree->voxelSize()[0]);
    uint64_t hits = 0;
    for (uint64_t i = 0; i < count; ++i) {
        const float* r = rays + 6 * i;
        nanovdb::Ray<float> ray(nanovdb::Vec3f(r[0] / voxel, r[1] / voxel, r[2] / voxel),
                                nanovdb::Vec3f(r[3], r[4], r[5]));
        nanovdb::Coord voxel_at;
        float value = 0, at = 0;
        const bool hit = nanovdb::ZeroCrossing(ray, accessor, voxel_at, value, at);
        t[i] = hit ? at * voxel : -1;
        hits += hit ? 1 : 0;
    }
    return hits;
}

uint64_t mesh(const void* grid, int threads) {
    const Threads limit(threads);
    openvdb::tools::VolumeToMesh mesher(0);
    mesher(*static_cast<const Grid*>(grid)->tree);
    uint64_t triangles = 0;
    for (size_t i = 0; i < mesher.polygonPoolListSize(); ++i)
        triangles += 2 * mesher.polygonPoolList()[i].numQuads() + mesher.polygonPoolList()[i].numTriangles();
    return triangles;
}

}  // namespace

extern "C" __attribute__((visibility("default"))) const KilnPeerTable* kiln_peers() {
    // No openvdb::initialize(): that registers types for files, which nothing here reads.
    static const KilnPeerTable table{kKilnPeerVersion, "OpenVDB",   "NanoVDB", build,     copy, release, measure, bite,
                                     sample_tree,      sample_flat, cast_tree, cast_flat, mesh};
    return &table;
}

// SPDX-License-Identifier: MIT
// What a plug-in of peers answers: other libraries doing the benchmarks' work in the same process. Plain C, so that the plug-in and
// the engine share nothing but this text; the engine opens the plug-in while it measures and links none of those libraries.
// Lengths are metres, grids have cubic voxels and a band of 3 voxels on each side; every call uses at most `threads` threads.
#pragma once

#include <cstdint>

extern "C" {

/// Raised whenever a line below changes.
inline constexpr uint32_t kKilnPeerVersion = 1;

struct KilnPeerEdit {
    float center[3];
    float size[3];      ///< a box: half extents; a sphere: its radius, three times
    uint32_t box;       ///< 1: box, 0: sphere
    uint32_t subtract;  ///< 1: cuts what is before it, 0: joins it
};

struct KilnPeerTable {
    uint32_t version;
    const char* tree_name;  ///< of the library that build(), bite(), sample_tree() and cast_tree() ask
    const char* flat_name;  ///< of the one that sample_flat() and cast_flat() ask
    /// A level set of all edits, in order. Null: out of memory.
    void* (*build)(const KilnPeerEdit* edits, uint32_t count, double voxel, int threads);
    void* (*copy)(const void* grid);
    void (*release)(void* grid);
    /// Voxels of the band and bytes of the tree.
    void (*measure)(const void* grid, uint64_t* voxels, uint64_t* bytes);
    /// Cuts one sphere out, for ever.
    void (*bite)(void* grid, const float* center, float radius, int threads);
    /// Trilinear values at points x y z x y z ..., metres.
    void (*sample_tree)(const void* grid, const float* points, uint64_t count, float* out);
    void (*sample_flat)(const void* grid, const float* points, uint64_t count, float* out);
    /// Rays origin direction origin direction ...; t is metres along the ray, negative for a miss. Answers the number of hits.
    uint64_t (*cast_tree)(const void* grid, const float* rays, uint64_t count, float* t);
    uint64_t (*cast_flat)(const void* grid, const float* rays, uint64_t count, float* t);
    /// Meshes the surface with quads only; answers triangles, two a quad.
    uint64_t (*mesh)(const void* grid, int threads);
};

/// The one symbol of a plug-in.
using KilnPeersFunction = const KilnPeerTable* (*)();
}

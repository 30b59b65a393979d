// SPDX-License-Identifier: MIT
// What shadow rays read of bricks and empty cells, for soft_shadow.gpu.h. The including kernel declares first: FrameParams frame,
// texture3D distances with a sampler distance_sampler.

const int kShadowSteps = 384;
const float kSaturatedVoxels = 3.95;  // stored distances from here on only say "far"
const float kFarAway = 1e4;
const float kPastFace = 1e-3;  // voxels: a step that ends on a cell's face would be rounded to either side
const float kClearOfEmptyCell = 0.13;  // texels of an empty cell are a voxel or more from the surface, its points 1 - sqrt(3)/2

// Trilinear distance, voxels, at a point of a brick counted from its texel (0, 0, 0).
float sampled_distance(int slot, vec3 local) {
    int bricks_x = int(frame.grid.atlas_bricks_x_y & 0xffffu);
    int bricks_y = int(frame.grid.atlas_bricks_x_y >> 16u);
    vec3 corner = vec3(ivec3(slot % bricks_x, (slot / bricks_x) % bricks_y, slot / (bricks_x * bricks_y)) * kBrickTexels);
    vec3 at = (corner + clamp(local, vec3(0.0), vec3(float(kBrickVoxels))) + 0.5) / vec3(textureSize(sampler3D(distances, distance_sampler), 0));
    return textureLod(sampler3D(distances, distance_sampler), at, 0.0).r * frame.distance_scale;
}

// What shadow_field() answers in an empty cell, at `in_cell` voxels from its corner: what lies around it is a cube of cells like it.
vec3 empty_cell(bool solid, int jump, vec3 in_cell, vec3 direction) {
    float around = float(max(jump - 1, 0) * kBrickVoxels);
    vec3 to_face = min(in_cell, float(kBrickVoxels) - in_cell);
    float least = max(min(min(to_face.x, to_face.y), to_face.z) + around, 0.0) + kClearOfEmptyCell;
    if (solid) return vec3(-least, least, 0.0);
    // The ray itself: to where it leaves that cube.
    vec3 ahead = mix(in_cell, float(kBrickVoxels) - in_cell, greaterThan(direction, vec3(0.0))) + around;
    vec3 leaves = ahead / max(abs(direction), vec3(1e-6));
    return vec3(kFarAway, least, min(min(leaves.x, leaves.y), leaves.z) + kPastFace);
}

#include "render/passes/shadow_offset.glsl"

// SPDX-License-Identifier: MIT
// Where a ray has passed the triangle that the rasteriser found, by as much as refining may move a hit: what is behind is not seen. Voxels.
// The including kernel declares first: FrameParams frame, texture2D mesh_depth (not read without kFrameRayEnds).
float ray_end(ivec2 pixel, vec3 direction) {
    if ((frame.flags & kFrameRayEnds) == 0u) return kFarVoxels;
    float depth = texelFetch(mesh_depth, pixel, 0).x;
    if (depth <= 0.0) return kFarVoxels;
    float t = kMeshNear / (depth * dot(direction, frame.camera.forward.xyz) * frame.grid.voxel_size);
    return min(t * 1.002 + frame.refine_reach, kFarVoxels);
}

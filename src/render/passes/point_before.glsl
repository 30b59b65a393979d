// SPDX-License-Identifier: MIT
// Where what a pixel sees was in the frame before. The including kernel declares first: FrameParams frame, InstanceRecord instances[],
// MeshPart mesh_parts[]. A new kind of surface that moves has its case here.

vec3 placed_by(vec4 x, vec4 y, vec4 z, vec3 p) { return vec3(dot(x.xyz, p) + x.w, dot(y.xyz, p) + y.w, dot(z.xyz, p) + z.w); }

// `words`: the pixel's visibility. Metres from the eye as it is now, both.
vec3 point_before(uint state, uvec4 words, vec3 p) {
    if (state == kSeenMesh) {
        MeshPart part = mesh_parts[words.z];
        return placed_by(part.before_x, part.before_y, part.before_z, placed_by(part.local_x, part.local_y, part.local_z, p));
    }
    if (state == kSeenInstance) {
        InstanceRecord instance = instances[words.y & 0x0fffffffu];
        float h = frame.grid.voxel_size;
        return placed_by(instance.before_x, instance.before_y, instance.before_z, p / h) * h;
    }
    return p;  // bricks and exact code stand still
}

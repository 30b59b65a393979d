// SPDX-License-Identifier: MIT
// Bricks in the atlas, by slot. The including kernel declares first: FrameParams frame, texture3D distances (the atlas), uint tables[]
// (palettes and solid masks);
// for KILN_FIELD_SURFACE also utexture3D materials (two texels a word, along x).

#ifndef KILN_ATLAS_GLSL
#define KILN_ATLAS_GLSL

// Texel (0, 0, 0) of a slot in the atlas.
ivec3 atlas_corner(int slot) {
    int bricks_x = int(frame.grid.atlas_bricks_x_y & 0xffffu);
    int bricks_y = int(frame.grid.atlas_bricks_x_y >> 16u);
    return ivec3(slot % bricks_x, (slot / bricks_x) % bricks_y, slot / (bricks_x * bricks_y)) * kBrickTexels;
}

float brick_texel(int slot, ivec3 texel) { return texelFetch(distances, atlas_corner(slot) + texel, 0).r * frame.distance_scale; }

Corners brick_corners(int slot, ivec3 voxel) {
    ivec3 at = atlas_corner(slot) + voxel;
    float scale = frame.distance_scale;
    Corners c;
    c.v000 = texelFetch(distances, at, 0).r * scale;
    c.v100 = texelFetch(distances, at + ivec3(1, 0, 0), 0).r * scale;
    c.v010 = texelFetch(distances, at + ivec3(0, 1, 0), 0).r * scale;
    c.v110 = texelFetch(distances, at + ivec3(1, 1, 0), 0).r * scale;
    c.v001 = texelFetch(distances, at + ivec3(0, 0, 1), 0).r * scale;
    c.v101 = texelFetch(distances, at + ivec3(1, 0, 1), 0).r * scale;
    c.v011 = texelFetch(distances, at + ivec3(0, 1, 1), 0).r * scale;
    c.v111 = texelFetch(distances, at + ivec3(1, 1, 1), 0).r * scale;
    return c;
}

bool brick_voxel_solid(int slot, ivec3 voxel) {
    uint word = tables[slot * kBrickTableWords + solid_mask_word(voxel.y, voxel.z)];
    return (frame.flags & kFrameAccelerate) == 0u || ((word >> solid_mask_bit(voxel.x, voxel.y)) & 1u) != 0u;
}

#ifdef KILN_FIELD_SURFACE
uint brick_material(int slot, ivec3 texel) {
    ivec3 at = atlas_corner(slot) + texel;
    uint two = texelFetch(materials, ivec3(at.x >> 1, at.y, at.z), 0).r;
    return (at.x & 1) == 0 ? two & 0xffffu : two >> 16u;
}
#endif

#endif

// SPDX-License-Identifier: MIT
// The world's field along rays that start off a surface, for shadows and for light from all around: bricks, and with KILN_EXACT exact programs
// where they apply. The including kernel declares first what map.glsl and shadow_bricks.glsl ask for, const bool kAlongCode; with KILN_EXACT what
// tape_buffers.glsl and code_of.glsl ask for; with KILN_LEVELS LevelsParams levels.

// Positions of shadow rays count from here: the voxel their point is in.
ivec3 shadow_whole;

// The last cell looked at, and its word: near a surface many steps stay in one.
ivec3 shadow_cell = ivec3(-1);
uint shadow_word = 0u;

uint shadow_cell_word(ivec3 cell) {
    if (cell != shadow_cell) {
        shadow_cell = cell;
        shadow_word = field_cell(cell);
    }
    return shadow_word;
}

// Distance of a point from the grid's box, 0 inside; `local` counts from the grid's first texel.
float grid_gap(vec3 local) {
    vec3 size = vec3(frame.grid.size_x, frame.grid.size_y, frame.grid.size_z) * float(kBrickVoxels);
    return length(max(max(-local, local - size), vec3(0.0)));
}

#ifdef KILN_LEVELS
// What the finest level that has the place knows of it.
vec3 level_shadow(ivec3 whole, vec3 part, vec3 direction) {
    vec3 away = abs(vec3(whole - ivec3(levels.focus_x, levels.focus_y, levels.focus_z)) +
                    (part - vec3(levels.part_x, levels.part_y, levels.part_z)));
    float largest = max(max(away.x, away.y), away.z);
    float reach = level_reach(levels.cells);
    // The level first, its brick after the loop: rays in step sample together.
    int found = -1;
    float size = 1.0;
    uint word = 0u;
    vec3 in_cell = vec3(0.0);
    for (int level = levels.first; level < levels.count && found < 0; ++level) {
        size = float(1 << level);
        if (largest >= reach * size) continue;
        ivec3 texel = whole >> level;
        ivec3 cell = ivec3(cell_of_texel(texel.x), cell_of_texel(texel.y), cell_of_texel(texel.z));
        word = level_word(level, cell);
        in_cell = vec3(texel - cell * kBrickVoxels) + (vec3(whole & ((1 << level) - 1)) + part) / size;
        if (word != kCellMissing) found = level;
    }
    if (found < 0) return vec3(kFarAway, 1.0, 0.0);
    if ((word & kCellOccupied) != 0u) {
        float d = sampled_distance(int(word & kCellSlotMask), in_cell);
        return vec3(d >= kSaturatedVoxels ? kFarAway : d * size, max(abs(d) - kTrilinearErrorVoxels, 0.01) * size, 0.0);
    }
    vec3 seen = empty_cell((word & kCellInside) != 0u, int(word & 7u), in_cell, direction);
    return vec3(seen.x >= kFarAway ? kFarAway : seen.x * size, seen.y * size, seen.z * size);
}
#endif

// For soft_shadow.gpu.h, in voxels.
vec3 shadow_field(vec3 p, vec3 direction) {
    ivec3 whole = shadow_whole - grid_first_cell() * kBrickVoxels;
    vec3 local = vec3(whole) + p;
    ivec3 cell = ivec3(floor(local / float(kBrickVoxels)));
    bool inside_grid = in_grid(cell);
#ifdef KILN_LEVELS
    uint word = 0u;
#else
    uint word = inside_grid ? shadow_cell_word(cell) : 0u;
#endif
    bool occupied = (word & kCellOccupied) != 0u;
    int slot = int(word & kCellSlotMask);
#ifdef KILN_EXACT
    if (kAlongCode) {
    bool unpruned = (frame.flags & kFrameUnpruned) != 0u;
    uint state = unpruned ? kSeenProgram : (inside_grid ? kSeenPruned : kSeenOutside);
    bool march_outside = frame.outside_count != 0u && (frame.flags & kFrameOutsideConcave) == 0u;
    bool by_code = unpruned || (inside_grid ? occupied && (frame.flags & kFrameAnalytic) != 0u : march_outside);
    if (by_code) {
        uvec2 here_code = code_of(state, slot);
        float d = tape_distance(here_code.x, here_code.y, (vec3(shadow_whole) + p) * frame.grid.voxel_size) / frame.grid.voxel_size;
        // Outside the grid the code says nothing of what is inside.
        float step = state == kSeenOutside ? min(abs(d), grid_gap(local) + 0.25) : abs(d);
        return vec3(d, max(step, 1e-3), 0.0);
    }
    }
#endif
    if (!inside_grid) return vec3(kFarAway, grid_gap(local) + 0.25, 0.0);
#ifdef KILN_LEVELS
    vec3 below = floor(p);
    return level_shadow(shadow_whole + ivec3(below), p - below, direction);
#else
    vec3 in_cell = local - vec3(cell * kBrickVoxels);
    if (occupied) {
        float d = sampled_distance(slot, in_cell);
        return vec3(d >= kSaturatedVoxels ? kFarAway : d, max(abs(d) - kTrilinearErrorVoxels, 0.01), 0.0);
    }
    return empty_cell((word & kCellInside) != 0u, int(word & 7u), in_cell, direction);
#endif
}

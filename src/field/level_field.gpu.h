// SPDX-License-Identifier: MIT
// The field of one level as march.gpu.h and surface.gpu.h ask for it, mixed with the next coarser one where levels.gpu.h says.
// The includer provides, before this text (C++: as members of the struct that includes it):
//     LevelsParams levels
//     ivec3 level_first_cell(int level)               of the window
//     uint level_word(int level, ivec3 cell)          word of a world cell in the window
//     float brick_texel(int slot, ivec3 texel)        stored value, in voxels of the brick's level, of texel 0 … 7
//     Corners brick_corners(int slot, ivec3 voxel)    the same at the corners of voxel 0 … 6
//     bool brick_voxel_solid(int slot, ivec3 voxel)   may any of these be solid? (true, if one does not know)

// The level at hand, and its brick at hand: first texel, whether corners may be mixed, and which of the cell's 8 corners touch a
// missing cell (bit x + 2 y + 4 z).
int here_level;
ivec3 here_texel;
bool here_mixed;
uint here_missing;

KILN_FN GridParams level_grid(int level) {
    ivec3 first = level_first_cell(level);
    GridParams grid;
    grid.cell_x = first.x;
    grid.cell_y = first.y;
    grid.cell_z = first.z;
    grid.voxel_size = levels.voxel_size * float(1 << level);
    grid.size_x = levels.cells;
    grid.size_y = levels.cells;
    grid.size_z = levels.cells;
    grid.atlas_bricks_x_y = levels.atlas_bricks_x_y;
    return grid;
}

KILN_FN bool level_holds(int level, ivec3 cell) {
    ivec3 first = level_first_cell(level);
    ivec3 in_window = ivec3(cell.x - first.x, cell.y - first.y, cell.z - first.z);
    return min(min(in_window.x, in_window.y), in_window.z) >= 0 &&
           max(max(in_window.x, in_window.y), in_window.z) < levels.cells;
}

// From the focus to a texel of a level, voxels, the largest component.
KILN_FN float level_distance(int level, ivec3 texel) {
    ivec3 whole = ivec3(levels.focus_x >> level, levels.focus_y >> level, levels.focus_z >> level);
    int mask = (1 << level) - 1;
    float scale = 1.0f / float(1 << level);
    float x = float(texel.x - whole.x) - (float(levels.focus_x & mask) + levels.part_x) * scale;
    float y = float(texel.y - whole.y) - (float(levels.focus_y & mask) + levels.part_y) * scale;
    float z = float(texel.z - whole.z) - (float(levels.focus_z & mask) + levels.part_z) * scale;
    return max(max(abs(x), abs(y)), abs(z));
}

KILN_FN int level_slot(int level, ivec3 cell) {
    if (!level_holds(level, cell)) return -1;
    uint word = level_word(level, cell);
    return (word & kCellOccupied) != 0u && word != kCellMissing ? int(word & kCellSlotMask) : -1;
}

// Stored value of a texel of a level, from any brick that has it: they all have the same. Else the band, with the cell's sign.
KILN_FN float level_texel(int level, ivec3 texel) {
    ivec3 cell = ivec3(cell_of_texel(texel.x), cell_of_texel(texel.y), cell_of_texel(texel.z));
    ivec3 local =
        ivec3(texel.x - cell.x * kBrickVoxels, texel.y - cell.y * kBrickVoxels, texel.z - cell.z * kBrickVoxels);
    float sign = 1.0f;
    for (int i = 0; i < 8; i++) {
        ivec3 back = ivec3(i & 1, (i >> 1) & 1, i >> 2);
        if ((back.x == 1 && local.x != 0) || (back.y == 1 && local.y != 0) || (back.z == 1 && local.z != 0)) continue;
        ivec3 owner = ivec3(cell.x - back.x, cell.y - back.y, cell.z - back.z);
        if (!level_holds(level, owner)) continue;
        uint word = level_word(level, owner);
        if (word == kCellMissing) continue;
        if ((word & kCellOccupied) != 0u)
            return brick_texel(int(word & kCellSlotMask),
                               ivec3(local.x + back.x * kBrickVoxels, local.y + back.y * kBrickVoxels,
                                     local.z + back.z * kBrickVoxels));
        if ((word & kCellInside) != 0u) sign = -1.0f;
    }
    return sign * kBandVoxels;
}

// Values at the corners of a voxel of a level, which lies in one cell.
KILN_FN Corners level_corners(int level, ivec3 voxel) {
    ivec3 cell = ivec3(cell_of_texel(voxel.x), cell_of_texel(voxel.y), cell_of_texel(voxel.z));
    int slot = level_slot(level, cell);
    if (slot >= 0)
        return brick_corners(slot, ivec3(voxel.x - cell.x * kBrickVoxels, voxel.y - cell.y * kBrickVoxels,
                                         voxel.z - cell.z * kBrickVoxels));
    Corners c;
    c.v000 = level_texel(level, voxel);
    c.v100 = level_texel(level, ivec3(voxel.x + 1, voxel.y, voxel.z));
    c.v010 = level_texel(level, ivec3(voxel.x, voxel.y + 1, voxel.z));
    c.v110 = level_texel(level, ivec3(voxel.x + 1, voxel.y + 1, voxel.z));
    c.v001 = level_texel(level, ivec3(voxel.x, voxel.y, voxel.z + 1));
    c.v101 = level_texel(level, ivec3(voxel.x + 1, voxel.y, voxel.z + 1));
    c.v011 = level_texel(level, ivec3(voxel.x, voxel.y + 1, voxel.z + 1));
    c.v111 = level_texel(level, ivec3(voxel.x + 1, voxel.y + 1, voxel.z + 1));
    return c;
}

KILN_FN void enter_brick(int level, uint word, ivec3 texel) {
    here_level = level;
    here_texel = texel;
    here_missing = 0u;
    here_mixed = false;
    if (level + 1 >= levels.count) return;
    // The farthest corner is within half a brick of the distance of its middle.
    ivec3 middle = ivec3(texel.x + 3, texel.y + 3, texel.z + 3);
    here_mixed = level + 1 < levels.drawn && level_distance(level, middle) + 4.0f > level_fade_first(levels.cells);
    if ((word & kCellFades) == 0u) return;
    ivec3 cell = ivec3(texel.x / kBrickVoxels, texel.y / kBrickVoxels, texel.z / kBrickVoxels);
    // A level of the net need not lie under the last.
    if (level + 1 >= levels.drawn) {
        ivec3 under = ivec3(cell.x >> 1, cell.y >> 1, cell.z >> 1);
        if (!level_holds(level + 1, under) || level_word(level + 1, under) == kCellMissing) return;
    }
    here_mixed = true;
    for (int i = 0; i < 27; i++) {
        ivec3 step = ivec3(i % 3 - 1, (i / 3) % 3 - 1, i / 9 - 1);
        ivec3 other = ivec3(cell.x + step.x, cell.y + step.y, cell.z + step.z);
        if (!level_holds(level, other) || level_word(level, other) != kCellMissing) continue;
        for (int c = 0; c < 8; c++) {
            bool touches = (step.x == 0 || (step.x > 0) == ((c & 1) != 0)) &&
                           (step.y == 0 || (step.y > 0) == ((c & 2) != 0)) &&
                           (step.z == 0 || (step.z > 0) == ((c & 4) != 0));
            if (touches) here_missing = here_missing | (1u << c);
        }
    }
}

// Weight of the coarser level at texel 0 … 7 of the brick at hand.
KILN_FN float here_weight(ivec3 texel) {
    float away =
        level_distance(here_level, ivec3(here_texel.x + texel.x, here_texel.y + texel.y, here_texel.z + texel.z));
    float w = 0.0f;
    if (here_level + 1 < levels.drawn)
        w = (away - level_fade_first(levels.cells)) * (1.0f / level_fade_width(levels.cells));
    if (here_missing != 0u) {
        // Trilinear from the cell's corners: neighbours see the same on a shared face, and it is 1 all over a missing cell's.
        vec3 p = vec3(float(texel.x) * (1.0f / 7.0f), float(texel.y) * (1.0f / 7.0f), float(texel.z) * (1.0f / 7.0f));
        if (texel.x == kBrickVoxels) p.x = 1.0f;
        if (texel.y == kBrickVoxels) p.y = 1.0f;
        if (texel.z == kBrickVoxels) p.z = 1.0f;
        Corners m;
        m.v000 = float(here_missing & 1u);
        m.v100 = float((here_missing >> 1) & 1u);
        m.v010 = float((here_missing >> 2) & 1u);
        m.v110 = float((here_missing >> 3) & 1u);
        m.v001 = float((here_missing >> 4) & 1u);
        m.v101 = float((here_missing >> 5) & 1u);
        m.v011 = float((here_missing >> 6) & 1u);
        m.v111 = float((here_missing >> 7) & 1u);
        w = max(w, trilinear_value(m, p));
    }
    return min(max(w, 0.0f), 1.0f);
}

KILN_FN Corners field_corners(int slot, ivec3 voxel) {
    Corners fine = brick_corners(slot, voxel);
    if (!here_mixed) return fine;
    float w000 = here_weight(voxel);
    float w100 = here_weight(ivec3(voxel.x + 1, voxel.y, voxel.z));
    float w010 = here_weight(ivec3(voxel.x, voxel.y + 1, voxel.z));
    float w110 = here_weight(ivec3(voxel.x + 1, voxel.y + 1, voxel.z));
    float w001 = here_weight(ivec3(voxel.x, voxel.y, voxel.z + 1));
    float w101 = here_weight(ivec3(voxel.x + 1, voxel.y, voxel.z + 1));
    float w011 = here_weight(ivec3(voxel.x, voxel.y + 1, voxel.z + 1));
    float w111 = here_weight(ivec3(voxel.x + 1, voxel.y + 1, voxel.z + 1));
    if (w000 + w100 + w010 + w110 + w001 + w101 + w011 + w111 == 0.0f) return fine;
    ivec3 texel = ivec3(here_texel.x + voxel.x, here_texel.y + voxel.y, here_texel.z + voxel.z);
    Corners coarse = level_corners(here_level + 1, ivec3(texel.x >> 1, texel.y >> 1, texel.z >> 1));
    // The fine voxel is one of the coarse one's eight parts.
    vec3 a = vec3(0.5f * float(texel.x & 1), 0.5f * float(texel.y & 1), 0.5f * float(texel.z & 1));
    vec3 b = vec3(a.x + 0.5f, a.y + 0.5f, a.z + 0.5f);
    Corners c;
    c.v000 = lerp_exact(fine.v000, 2.0f * trilinear_value(coarse, a), w000);
    c.v100 = lerp_exact(fine.v100, 2.0f * trilinear_value(coarse, vec3(b.x, a.y, a.z)), w100);
    c.v010 = lerp_exact(fine.v010, 2.0f * trilinear_value(coarse, vec3(a.x, b.y, a.z)), w010);
    c.v110 = lerp_exact(fine.v110, 2.0f * trilinear_value(coarse, vec3(b.x, b.y, a.z)), w110);
    c.v001 = lerp_exact(fine.v001, 2.0f * trilinear_value(coarse, vec3(a.x, a.y, b.z)), w001);
    c.v101 = lerp_exact(fine.v101, 2.0f * trilinear_value(coarse, vec3(b.x, a.y, b.z)), w101);
    c.v011 = lerp_exact(fine.v011, 2.0f * trilinear_value(coarse, vec3(a.x, b.y, b.z)), w011);
    c.v111 = lerp_exact(fine.v111, 2.0f * trilinear_value(coarse, b), w111);
    return c;
}

// A mixed corner may be solid where the stored one is not.
KILN_FN bool field_voxel_solid(int slot, ivec3 voxel) { return here_mixed || brick_voxel_solid(slot, voxel); }

// Cells of the level at hand, counted from its window's first.
KILN_FN uint field_cell(ivec3 cell) {
    ivec3 first = level_first_cell(here_level);
    return level_word(here_level, ivec3(cell.x + first.x, cell.y + first.y, cell.z + first.z));
}
KILN_FN void field_enter(uint word, ivec3 texel) { enter_brick(here_level, word, texel); }

// Gradient of the mixed field blended over the dual voxel (surface.gpu.h), per voxel of the level, at p in a cell, [0, 7]³. Leaves another
// brick at hand.
KILN_FN vec3 level_gradient(int level, ivec3 cell, vec3 p) {
    ivec3 first = ivec3(dual_first(p.x), dual_first(p.y), dual_first(p.z));
    vec3 s = vec3(p.x - float(first.x), p.y - float(first.y), p.z - float(first.z));
    vec3 sum = vec3(0.0f, 0.0f, 0.0f);
    float total = 0.0f;
    ivec3 entered = ivec3(2, 2, 2);
    int slot = -1;
    for (int i = 0; i < 8; i++) {
        ivec3 step = ivec3(i & 1, (i >> 1) & 1, i >> 2);
        ivec3 voxel = ivec3(first.x + step.x, first.y + step.y, first.z + step.z);
        ivec3 away = ivec3(voxel.x < 0 ? -1 : (voxel.x >= kBrickVoxels ? 1 : 0),
                           voxel.y < 0 ? -1 : (voxel.y >= kBrickVoxels ? 1 : 0),
                           voxel.z < 0 ? -1 : (voxel.z >= kBrickVoxels ? 1 : 0));
        if (away != entered) {
            ivec3 owner = ivec3(cell.x + away.x, cell.y + away.y, cell.z + away.z);
            entered = away;
            slot = level_slot(level, owner);
            if (slot >= 0)
                enter_brick(level, level_word(level, owner),
                            ivec3(owner.x * kBrickVoxels, owner.y * kBrickVoxels, owner.z * kBrickVoxels));
        }
        if (slot < 0) continue;
        ivec3 local =
            ivec3(voxel.x - away.x * kBrickVoxels, voxel.y - away.y * kBrickVoxels, voxel.z - away.z * kBrickVoxels);
        vec3 at = vec3(p.x - float(voxel.x), p.y - float(voxel.y), p.z - float(voxel.z));
        float weight = (step.x == 1 ? s.x - 0.5f : 1.5f - s.x) * (step.y == 1 ? s.y - 0.5f : 1.5f - s.y) *
                       (step.z == 1 ? s.z - 0.5f : 1.5f - s.z);
        sum = sum + trilinear_gradient(field_corners(slot, local), at) * weight;
        total += weight;
    }
    return sum * (1.0f / total);
}

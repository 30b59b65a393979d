// SPDX-License-Identifier: MIT
// What a surface point of a brick looks like: its gradient, three ways, and its materials. Done once per pixel, not per step.
// The includer provides the field, before this text (C++: as members of the struct that includes it):
//     int field_slot(ivec3 cell)                     brick of a world cell, -1 where there is none
//     float field_texel(int slot, ivec3 texel)       stored value, in voxels, of texel 0 … 7 of a brick
//     Corners field_corners(int slot, ivec3 voxel)   the same at the corners of voxel 0 … 6
//     uint field_material(int slot, ivec3 texel)     material word
// p is a position in the brick of `slot` and world cell `cell`, [0, 7]³. Needs brick, codes and trilinear.gpu.h.

// Where voxel v (-1 … 7) along an axis lies: in the cell before (-1), this one (0) or the next (1).
KILN_FN int cell_step(int v) { return v < 0 ? -1 : (v >= kBrickVoxels ? 1 : 0); }

// Gradient blended over the dual voxel, per voxel length. Voxels without a brick are left out and the others weigh more.
KILN_FN vec3 dual_gradient(int slot, ivec3 cell, vec3 p) {
    ivec3 first = ivec3(dual_first(p.x), dual_first(p.y), dual_first(p.z));
    vec3 s = vec3(p.x - float(first.x), p.y - float(first.y), p.z - float(first.z));
    vec3 sum = vec3(0.0f, 0.0f, 0.0f);
    if (min(min(first.x, first.y), first.z) >= 0 && max(max(first.x, first.y), first.z) <= kBrickVoxels - 2) {
        vec3 value_x = dual_value(s.x);
        vec3 slope_x = dual_slope(s.x);
        vec3 value_y = dual_value(s.y);
        vec3 slope_y = dual_slope(s.y);
        vec3 value_z = dual_value(s.z);
        vec3 slope_z = dual_slope(s.z);
        for (int k = 0; k < 3; k++) {
            float vz = k == 0 ? value_z.x : (k == 1 ? value_z.y : value_z.z);
            float dz = k == 0 ? slope_z.x : (k == 1 ? slope_z.y : slope_z.z);
            for (int j = 0; j < 3; j++) {
                float vy = j == 0 ? value_y.x : (j == 1 ? value_y.y : value_y.z);
                float dy = j == 0 ? slope_y.x : (j == 1 ? slope_y.y : slope_y.z);
                float a = field_texel(slot, ivec3(first.x, first.y + j, first.z + k));
                float b = field_texel(slot, ivec3(first.x + 1, first.y + j, first.z + k));
                float c = field_texel(slot, ivec3(first.x + 2, first.y + j, first.z + k));
                float value = value_x.x * a + value_x.y * b + value_x.z * c;
                float slope = slope_x.x * a + slope_x.y * b + slope_x.z * c;
                sum = sum + vec3(slope * vy * vz, value * dy * vz, value * vy * dz);
            }
        }
        return sum;
    }
    float total = 0.0f;
    for (int i = 0; i < 8; i++) {
        ivec3 step = ivec3(i & 1, (i >> 1) & 1, i >> 2);
        ivec3 voxel = ivec3(first.x + step.x, first.y + step.y, first.z + step.z);
        ivec3 away = ivec3(cell_step(voxel.x), cell_step(voxel.y), cell_step(voxel.z));
        int owner = slot;
        if (away.x != 0 || away.y != 0 || away.z != 0) {
            owner = field_slot(ivec3(cell.x + away.x, cell.y + away.y, cell.z + away.z));
            if (owner < 0) continue;
        }
        ivec3 local =
            ivec3(voxel.x - away.x * kBrickVoxels, voxel.y - away.y * kBrickVoxels, voxel.z - away.z * kBrickVoxels);
        vec3 at = vec3(p.x - float(voxel.x), p.y - float(voxel.y), p.z - float(voxel.z));
        float weight = (step.x == 1 ? s.x - 0.5f : 1.5f - s.x) * (step.y == 1 ? s.y - 0.5f : 1.5f - s.y) *
                       (step.z == 1 ? s.z - 0.5f : 1.5f - s.z);
        sum = sum + trilinear_gradient(field_corners(owner, local), at) * weight;
        total += weight;
    }
    // The voxel that holds p has a brick and a weight of 1/8 at least.
    return sum * (1.0f / total);
}

// Trilinear value at p in [-1, 8]³; where the neighbour has no brick, the nearest voxel's polynomial goes on.
KILN_FN float field_value_near(int slot, ivec3 cell, vec3 p) {
    ivec3 voxel = ivec3(int(floor(p.x)), int(floor(p.y)), int(floor(p.z)));
    ivec3 away = ivec3(cell_step(voxel.x), cell_step(voxel.y), cell_step(voxel.z));
    int owner = slot;
    if (away.x != 0 || away.y != 0 || away.z != 0) {
        owner = field_slot(ivec3(cell.x + away.x, cell.y + away.y, cell.z + away.z));
        if (owner < 0) {
            owner = slot;
            away = ivec3(0, 0, 0);
            voxel = ivec3(min(max(voxel.x, 0), kBrickVoxels - 1), min(max(voxel.y, 0), kBrickVoxels - 1),
                          min(max(voxel.z, 0), kBrickVoxels - 1));
        }
    }
    ivec3 local =
        ivec3(voxel.x - away.x * kBrickVoxels, voxel.y - away.y * kBrickVoxels, voxel.z - away.z * kBrickVoxels);
    return trilinear_value(field_corners(owner, local),
                           vec3(p.x - float(voxel.x), p.y - float(voxel.y), p.z - float(voxel.z)));
}

// Central differences, half a voxel each way: second order.
KILN_FN vec3 central_gradient(int slot, ivec3 cell, vec3 p) {
    float x = field_value_near(slot, cell, vec3(p.x + 0.5f, p.y, p.z)) -
              field_value_near(slot, cell, vec3(p.x - 0.5f, p.y, p.z));
    float y = field_value_near(slot, cell, vec3(p.x, p.y + 0.5f, p.z)) -
              field_value_near(slot, cell, vec3(p.x, p.y - 0.5f, p.z));
    float z = field_value_near(slot, cell, vec3(p.x, p.y, p.z + 0.5f)) -
              field_value_near(slot, cell, vec3(p.x, p.y, p.z - 0.5f));
    return vec3(x, y, z);
}

// Four taps on a tetrahedron with edges of a voxel: first order only.
KILN_FN vec3 tetrahedral_gradient(int slot, ivec3 cell, vec3 p) {
    float a = field_value_near(slot, cell, vec3(p.x + 0.5f, p.y - 0.5f, p.z - 0.5f));
    float b = field_value_near(slot, cell, vec3(p.x - 0.5f, p.y - 0.5f, p.z + 0.5f));
    float c = field_value_near(slot, cell, vec3(p.x - 0.5f, p.y + 0.5f, p.z - 0.5f));
    float d = field_value_near(slot, cell, vec3(p.x + 0.5f, p.y + 0.5f, p.z + 0.5f));
    return vec3(a - b - c + d, c + d - a - b, b + d - a - c) * 0.5f;
}

// The two heaviest palette slots at a point and the second's share of both; slot1 = slot0 when there is one.
struct SurfaceMaterial {
    uint slot0, slot1;
    float share;  // [0, 1/2]
};

// From the 8 texels of the point's voxel, weights summed by palette slot. A palette is in ascending order of material
// number, so ties go to the lower number.
KILN_FN SurfaceMaterial surface_material(int slot, ivec3 voxel, vec3 p) {
    float weight[16];
    for (int i = 0; i < 16; i++) weight[i] = 0.0f;
    for (int i = 0; i < 8; i++) {
        ivec3 step = ivec3(i & 1, (i >> 1) & 1, i >> 2);
        float w =
            (step.x == 1 ? p.x : 1.0f - p.x) * (step.y == 1 ? p.y : 1.0f - p.y) * (step.z == 1 ? p.z : 1.0f - p.z);
        uint word = field_material(slot, ivec3(voxel.x + step.x, voxel.y + step.y, voxel.z + step.z));
        float share = material_share(word);
        weight[material_slot0(word)] += w * (1.0f - share);
        weight[material_slot1(word)] += w * share;
    }
    SurfaceMaterial best;
    best.slot0 = 0u;
    best.slot1 = 0u;
    float first = -1.0f;
    float second = 0.0f;
    for (int i = 0; i < 16; i++) {
        if (weight[i] > first) {
            second = first;
            best.slot1 = best.slot0;
            first = weight[i];
            best.slot0 = uint(i);
        } else if (weight[i] > second) {
            second = weight[i];
            best.slot1 = uint(i);
        }
    }
    if (!(second > 0.0f)) {
        second = 0.0f;
        best.slot1 = best.slot0;
    }
    best.share = second / (first + second);
    return best;
}

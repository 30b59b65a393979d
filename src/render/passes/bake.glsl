// SPDX-License-Identifier: MIT
// Bakes bricks: one workgroup a job. Each thread evaluates the brick's pruned code at one row of eight texels, stores the
// distance codes and the material words, and the workgroup builds the brick's palette: the same bytes as field/host_bricks on the CPU
// up to the last bits of the distances.
// The including kernel says how distances are stored: `void store_row(uvec3 atlas_texel, uint job, uint row, float d_voxels[8])`.

layout(local_size_x = kBakeThreads) in;

layout(set = 0, binding = 0, std430) readonly buffer Jobs { uint job_slots[]; };
layout(set = 0, binding = 1, std430) readonly buffer Records { BrickRecord records[]; };
layout(set = 0, binding = 2, std430) readonly buffer Code { uvec2 code[]; };
layout(set = 0, binding = 3, std430) readonly buffer Numbers { float numbers[]; };
layout(set = 0, binding = 4, std430) writeonly buffer Tables { uint tables[]; };
layout(set = 0, binding = 5, std430) buffer Dropped { uint dropped_materials; };
layout(set = 0, binding = 6, r32ui) writeonly uniform uimage3D materials;  // two texels a word, along x
layout(push_constant) uniform Push { BakePush push; };

uvec2 sdf_code(uint at) { return code[at]; }
float sdf_param(uint at) { return numbers[push.params_first + at]; }
float sdf_sample(uint at) { return numbers[at]; }
#define KILN_TAPE_MATERIALS
#include "render/passes/tape_use.glsl"
#include "sdf/tape.glsl"

void store_row(uvec3 atlas_texel, uint job, uint row, float d_voxels[8]);

const uint kNone = 0xffffffffu;
shared uint solid_rows[kBakeThreads];
shared uint found_id;
shared uint found_weight;
shared uint palette[kPaletteSize];
shared uint palette_weight[kPaletteSize];

void main() {
    uint job = gl_WorkGroupID.x;
    uint slot = job_slots[job];
    BrickRecord record = records[slot];
    uint row = gl_LocalInvocationIndex;
    ivec3 texel = ivec3(record.texel_x, record.texel_y + int(row & 7u), record.texel_z + int(row >> 3u));

    float d_voxels[8];
    uint solid = 0u;
    uint ids[8];      // the two material numbers, 16 bits each; kNoMaterial: none (outside the band both)
    uint weights[8];  // of the second, 0 … 255 of 510
    for (int x = 0; x < 8; ++x) {
        Mix mixed;
        vec3 p_world = vec3(texel + ivec3(x, 0, 0)) * push.voxel_size;
        float d = tape_materials(record.code_first, record.code_count, p_world, true, mixed);
        d_voxels[x] = d * push.voxels_per_metre;
        if (d_voxels[x] <= 0.0) solid |= 1u << x;
        bool in_band = abs(d_voxels[x]) < kBandVoxels;
        uint id0 = mixed.id0 == float(kNoMaterial) ? 0u : uint(mixed.id0);
        uint id1 = mixed.share > 0.0 ? uint(mixed.id1) : kNoMaterial;
        ids[x] = in_band ? id0 | (id1 << 16u) : kNone;
        weights[x] = in_band ? material_word(0u, 0u, mixed.share) >> 8u : 0u;
    }
    uint bricks_x = push.atlas_bricks_x_y & 0xffffu;
    uint bricks_y = push.atlas_bricks_x_y >> 16u;
    uvec3 corner = uvec3(slot % bricks_x, (slot / bricks_x) % bricks_y, slot / (bricks_x * bricks_y)) * 8u + uvec3(0u, row & 7u, row >> 3u);
    store_row(corner, job, row, d_voxels);
    solid_rows[row] = solid;
    barrier();
    if (row < uint(kSolidMaskWords)) {
        uint first = (row >> 1u) * 8u + (row & 1u) * 4u;
        uint word = 0u;
        for (uint y = 0u; y < 4u - (row & 1u); ++y) {
            uint at = first + y;
            uint any = solid_rows[at] | solid_rows[at + 1u] | solid_rows[at + 8u] | solid_rows[at + 9u];
            word |= ((any | (any >> 1u)) & 127u) << (8u * y);
        }
        tables[slot * uint(kBrickTableWords) + uint(kPaletteSize) + row] = word;
    }

    // The palette: distinct numbers in ascending order; beyond 16 the lightest goes (of equals the higher number).
    uint count = 0u;
    uint last = 0u;
    bool any_last = false;
    uint dropped = 0u;
    for (;;) {
        if (row == 0u) {
            found_id = kNone;
            found_weight = 0u;
        }
        barrier();
        uint mine = kNone;
        for (int x = 0; x < 8; ++x) {
            uint id0 = ids[x] & 0xffffu;
            uint id1 = ids[x] >> 16u;
            if (id0 != kNoMaterial && (!any_last || id0 > last)) mine = min(mine, id0);
            if (weights[x] != 0u && (!any_last || id1 > last)) mine = min(mine, id1);
        }
        if (mine != kNone) atomicMin(found_id, mine);
        barrier();
        uint id = found_id;
        if (id == kNone) break;
        uint weight = 0u;
        for (int x = 0; x < 8; ++x) {
            if ((ids[x] & 0xffffu) == id) weight += 510u - weights[x];
            if (weights[x] != 0u && (ids[x] >> 16u) == id) weight += weights[x];
        }
        if (weight != 0u) atomicAdd(found_weight, weight);
        barrier();
        if (row == 0u) {
            if (count < uint(kPaletteSize)) {
                palette[count] = id;
                palette_weight[count] = found_weight;
            } else {
                uint lightest = 0u;
                for (uint i = 1u; i < uint(kPaletteSize); ++i) {
                    if (palette_weight[i] <= palette_weight[lightest]) lightest = i;
                }
                if (found_weight > palette_weight[lightest]) {
                    for (uint i = lightest; i + 1u < uint(kPaletteSize); ++i) {
                        palette[i] = palette[i + 1u];
                        palette_weight[i] = palette_weight[i + 1u];
                    }
                    palette[kPaletteSize - 1] = id;
                    palette_weight[kPaletteSize - 1] = found_weight;
                }
            }
        }
        dropped += count >= uint(kPaletteSize) ? 1u : 0u;
        count = min(count + 1u, uint(kPaletteSize));
        last = id;
        any_last = true;
        barrier();
    }
    if (row < uint(kPaletteSize)) tables[slot * uint(kBrickTableWords) + row] = row < count ? palette[row] : kNoMaterial;
    if (row == 0u && dropped != 0u) atomicAdd(dropped_materials, dropped);

    uint heaviest = 0u;
    for (uint i = 1u; i < count; ++i) {
        if (palette_weight[i] > palette_weight[heaviest]) heaviest = i;
    }
    uint words[8];
    for (int x = 0; x < 8; ++x) {
        uint id0 = ids[x] & 0xffffu;
        uint id1 = ids[x] >> 16u;
        int slot0 = -1;
        int slot1 = -1;
        for (int i = 0; i < int(count); ++i) {
            if (palette[i] == id0) slot0 = i;
            if (palette[i] == id1) slot1 = i;
        }
        // A dropped material leaves its weight to the other one; both dropped: the brick's heaviest.
        uint weight = slot0 >= 0 && slot1 >= 0 ? weights[x] : 0u;
        if (slot0 < 0) slot0 = slot1 >= 0 ? slot1 : int(heaviest);
        if (weight == 0u) slot1 = slot0;
        words[x] = id0 == kNoMaterial ? 0u : uint(slot0) | (uint(slot1) << 4u) | (weight << 8u);
    }
    ivec3 word_at = ivec3(corner.x / 2u, corner.y, corner.z);
    for (int x = 0; x < 4; ++x) {
        imageStore(materials, word_at + ivec3(x, 0, 0), uvec4(words[2 * x] | (words[2 * x + 1] << 16u)));
    }
}

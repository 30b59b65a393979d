// SPDX-License-Identifier: MIT
// The triangles that a workgroup's points and a light may have between them. The threads open the trees of boxes together; what the hull of
// points and light surely misses is left out. Leaves come in chunks, their triangles in shared memory, counted from the eye.
// The including kernel declares first: FrameParams frame, MeshNode nodes[], MeshPart mesh_parts[], and includes mesh.glsl and lights.gpu.h.

// Bounds of a bundle of rays: the place at a parameter from 0 to last has components between low + slowest t and high + fastest t.
struct Reach {
    vec3 low, high;
    vec3 by_slowest, by_fastest;  // 1 / slope; a slope of 0 counts as a very small one
    float last;
};

vec3 inverse_slope(vec3 slope) { return 1.0 / mix(slope, vec3(1e-30), lessThan(abs(slope), vec3(1e-30))); }

// All rays from a point to a disc: along + x across + y upwards, x² + y² <= 1; the parameter counts metres along its middle.
Reach cone_reach(vec3 from, vec3 along, vec3 across, vec3 upwards, float last) {
    vec3 spread = sqrt(across * across + upwards * upwards);
    return Reach(from, from, inverse_slope(along - spread), inverse_slope(along + spread), last);
}

// Whether some ray of the bundle may meet the box: bounds on the parameter, from slowest t <= high - r.low and fastest t >= low - r.high.
bool may_meet(Reach r, vec3 low, vec3 high) {
    vec3 above = (high - r.low) * r.by_slowest;
    vec3 below = (low - r.high) * r.by_fastest;
    bvec3 rising = greaterThan(r.by_slowest, vec3(0.0));
    bvec3 falling = lessThan(r.by_fastest, vec3(0.0));
    vec3 last = min(mix(vec3(1e30), above, rising), mix(vec3(1e30), below, falling));
    vec3 first = max(mix(above, vec3(0.0), rising), mix(below, vec3(0.0), falling));
    // A thousandth of a percent wider than rounding makes it.
    return max(max(max(first.x, first.y), first.z), 0.0) <= min(min(min(last.x, last.y), last.z), r.last) * 1.00001;
}

// A subtree by its first node: of a part, or of the parts' tree.
struct Branch {
    uint part, node;
};
const uint kTopTree = 0xffffffffu;
const uint kMostBranches = 256u;
const uint kMostLeaves = 64u;
const uint kEnoughLeaves = 40u;  // of a chunk
const uint kInLeaf = 4u;         // model::kMostInLeaf
const uint kInNode = 4u;         // grandchildren; no fewer than kInLeaf

shared Branch branches[kMostBranches];  // still to be opened
shared uint branch_count;
shared uvec2 leaves[kMostLeaves];  // part; first triangle << 3 | count
shared uint leaf_count;
shared uint leaves_with_holes[2];  // a bit each
shared uint leaves_that_hide[2];   // likewise: leaf_triangles is not 0
shared uint leaf_triangles[kMostLeaves];  // a bit for each of a leaf's triangles that may hide something of a point of the workgroup
shared float leaf_boxes[6u * kMostLeaves];                // low, high, counted from the eye
shared float leaf_places[9u * kInLeaf * kMostLeaves];     // corners of their triangles
shared uint tile_low[3], tile_high[3];                    // ordered_bits(): of the points' box
shared uint tile_wants;                                   // a bit a light of this batch: some point sees some of it
shared uint tile_open;                                    // some point may still see some of the light

Reach tile_beam;

#include "render/passes/ordered_bits.glsl"

// The points of the workgroup, and which lights they want.
void bound_tile(bool lit, vec3 from, uvec4 fractions) {
    uint thread = gl_LocalInvocationIndex;
    if (thread < 3u) {
        tile_low[thread] = ~0u;
        tile_high[thread] = 0u;
    }
    if (thread == 0u) tile_wants = 0u;
    barrier();
    if (lit) {
        for (int axis = 0; axis < 3; ++axis) {
            atomicMin(tile_low[axis], ordered_bits(from[axis]));
            atomicMax(tile_high[axis], ordered_bits(from[axis]));
        }
        uint wants = 0u;
        for (uint channel = 0u; channel < kLightsAtOnce; ++channel)
            if (((fractions[channel >> 2u] >> (8u * (channel & 3u))) & 255u) != 0u) wants |= 1u << channel;
        atomicOr(tile_wants, wants);
    }
    barrier();
    tile_beam.low = vec3(float_of_ordered(tile_low[0]), float_of_ordered(tile_low[1]), float_of_ordered(tile_low[2]));
    tile_beam.high = vec3(float_of_ordered(tile_high[0]), float_of_ordered(tile_high[1]), float_of_ordered(tile_high[2]));
}

// The hull of the points and the light. The parameter runs from 0 at the points to 1 at the light, so that both ends are as narrow as they are.
void aim_beam(LightRecord light) {
    tile_beam.last = 1.0;
    vec3 slowest;
    vec3 fastest;
    if (light.kind == kLightDirectional) {
        vec3 spread = vec3(light.position.w);  // of the disc's radius whichever way it faces
        slowest = (-light.direction.xyz - spread) * kFarMetres;
        fastest = (-light.direction.xyz + spread) * kFarMetres;
    } else {
        vec3 eye = (vec3(frame.eye_x, frame.eye_y, frame.eye_z) + vec3(frame.eye_part_x, frame.eye_part_y, frame.eye_part_z)) * frame.grid.voxel_size;
        vec3 at = light.position.xyz - eye;
        // Far out, floats of the world's places say where the light is to no more than this.
        vec3 slack = vec3(light.position.w * 1.0001) + 1e-6 * (abs(light.position.xyz) + abs(eye) + abs(at));
        slowest = at - slack - tile_beam.low;
        fastest = at + slack - tile_beam.high;
    }
    tile_beam.by_slowest = inverse_slope(slowest);
    tile_beam.by_fastest = inverse_slope(fastest);
}

// The box of a branch's node, counted from the eye.
void node_box(Branch b, out vec3 low, out vec3 high) {
    if (b.part == kTopTree) {
        MeshNode node = nodes[b.node];
        low = vec3(node.min_x, node.min_y, node.min_z);
        high = vec3(node.max_x, node.max_y, node.max_z);
        return;
    }
    MeshPart part = mesh_parts[b.part];
    MeshNode node = nodes[part.first_node + b.node];
    vec3 low_local = vec3(node.min_x, node.min_y, node.min_z);
    vec3 high_local = vec3(node.max_x, node.max_y, node.max_z);
    vec3 middle = mesh_point(part, 0.5 * (low_local + high_local));
    vec3 size = 0.5 * (high_local - low_local);
    vec3 half_size = vec3(dot(abs(part.eye_x.xyz), size), dot(abs(part.eye_y.xyz), size), dot(abs(part.eye_z.xyz), size));
    half_size += 2e-6 * (abs(middle) + half_size + abs(vec3(part.eye_x.w, part.eye_y.w, part.eye_z.w)));
    low = middle - half_size;
    high = middle + half_size;
}

// A leaf of a part goes to the chunk. Without kFrameAccelerate every branch is kept: the slow twin.
void keep_branch(Branch b) {
    vec3 low;
    vec3 high;
    node_box(b, low, high);
    if ((frame.flags & kFrameAccelerate) != 0u && !may_meet(tile_beam, low, high)) return;
    uint leaf = b.part == kTopTree ? 0u : nodes[mesh_parts[b.part].first_node + b.node].leaf;
    if (leaf == 0u) {
        branches[atomicAdd(branch_count, 1u)] = b;
        return;
    }
    uint i = atomicAdd(leaf_count, 1u);
    leaves[i] = uvec2(b.part, leaf);
    leaf_triangles[i] = 0u;
    if ((mesh_parts[b.part].flags & kMeshMask) != 0u) atomicOr(leaves_with_holes[i >> 5u], 1u << (i & 31u));
    for (uint axis = 0u; axis < 3u; ++axis) {
        leaf_boxes[6u * i + axis] = low[axis];
        leaf_boxes[6u * i + 3u + axis] = high[axis];
    }
}

// One of the four threads that open a branch, which is no leaf of a part: each has a part of a leaf of the parts' tree, or one of the node's
// grandchildren; a child that is a leaf has none and stands for them. Trees are binary (model/bvh.h).
void open_branch(Branch b, uint thread) {
    uint first_node = b.part == kTopTree ? 0u : mesh_parts[b.part].first_node;
    uint leaf = nodes[first_node + b.node].leaf;
    uint child = thread < 2u ? b.node + 1u : nodes[first_node + b.node + 1u].skip;
    bool second = (thread & 1u) != 0u;
    bool ends = leaf == 0u && nodes[first_node + child].leaf != 0u;
    uint grandchild = ends || leaf != 0u ? child : second ? nodes[first_node + child + 1u].skip : child + 1u;
    if (leaf != 0u ? thread >= (leaf & 7u) : ends && second) return;
    keep_branch(leaf != 0u ? Branch((leaf >> 3u) + thread, 0u) : Branch(b.part, grandchild));
}

// All threads of the workgroup come here, and to next_leaves().
void begin_light(LightRecord light) {
    barrier();  // nobody reads what the light before left
    aim_beam(light);
    if (gl_LocalInvocationIndex == 0u) {
        branch_count = 0u;
        keep_branch(Branch(kTopTree, 0u));
    }
    barrier();
}

// Whether a triangle may hide something of the light from some point of the workgroup: its box, and of closed surfaces the side that it turns to
// them (may_shade() of mesh_shadow.comp). Wider than rounding may make either.
bool may_hide(uint flags, vec3 a, vec3 b, vec3 c) {
    vec3 low = min(min(a, b), c);
    vec3 high = max(max(a, b), c);
    vec3 wider = 2e-6 * (abs(low) + abs(high));
    if (!may_meet(tile_beam, low - wider, high + wider)) return false;
    if ((flags & kMeshClosed) == 0u) return true;
    vec3 n = cross(b - a, c - a);
    // dot(n, a - q) over the points' box.
    vec3 from_high = n * (a - tile_beam.low);
    vec3 from_low = n * (a - tile_beam.high);
    vec3 least = min(from_high, from_low);
    vec3 most = max(from_high, from_low);
    float slack = 1e-5 * dot(abs(n), abs(a) + abs(tile_beam.low) + abs(tile_beam.high) + high - low);
    bool all_behind = (flags & kMeshMirrored) != 0u ? most.x + most.y + most.z < -slack : least.x + least.y + least.z > slack;
    return !all_behind;
}

// The next chunk: leaf_count is 0 where there is none.
void next_leaves() {
    uint thread = gl_LocalInvocationIndex;
    if (thread == 0u) {
        leaf_count = 0u;
        leaves_with_holes[0] = 0u;
        leaves_with_holes[1] = 0u;
        leaves_that_hide[0] = 0u;
        leaves_that_hide[1] = 0u;
        tile_open = 0u;
    }
    barrier();
    do {
        uint count = branch_count;
        // Each makes up to four leaves or branches. A list near its end is opened one by one from there, which lengthens it by no more than the
        // depth of the trees.
        uint opened = min(min(count, (kMostLeaves - leaf_count) / kInNode), count < 125u ? (128u - count) / 3u : 1u);
        uint which = thread / kInNode;
        Branch b = which < opened ? branches[count - opened + which] : Branch(0u, 0u);
        barrier();
        if (thread == 0u) branch_count = count - opened;
        barrier();
        if (which < opened) open_branch(b, thread % kInNode);
        barrier();
    } while (branch_count > 0u && leaf_count < kEnoughLeaves);
    uint round = 0u;
    do {
        uint i = round + thread;
        uvec2 leaf = i < kInLeaf * leaf_count ? leaves[i / kInLeaf] : uvec2(0u);
        round += uint(kTileGroup * kTileGroup);
        if (i % kInLeaf >= (leaf.y & 7u)) continue;
        MeshPart part = mesh_parts[leaf.x];
        vec3 p[3];
        for (uint corner = 0u; corner < 3u; ++corner) {
            p[corner] = mesh_point(part, vertex_position(mesh_corner(part, (leaf.y >> 3u) + i % kInLeaf, corner)));
            for (uint axis = 0u; axis < 3u; ++axis) leaf_places[9u * i + 3u * corner + axis] = p[corner][axis];
        }
        if ((frame.flags & kFrameAccelerate) == 0u || may_hide(part.flags, p[0], p[1], p[2])) {
            uint which = i / kInLeaf;
            atomicOr(leaf_triangles[which], 1u << (i % kInLeaf));
            atomicOr(leaves_that_hide[which >> 5u], 1u << (which & 31u));
        }
    } while (round < kInLeaf * leaf_count);
    barrier();
}

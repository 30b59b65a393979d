// SPDX-License-Identifier: MIT
// The instances that rays of a workgroup may meet, the nearest first: found once for all its rays by going down the tree together, so that no ray
// walks the tree by itself. The including kernel has instances.glsl, with
// KILN_INSTANCE_WALK, and local_size 8 x 8; at least one thread of a workgroup has a ray.
//
// Rays of a workgroup lie close together: at t they are in the box between from_low + t dir_low and from_high + t dir_high, an interval an axis (after
// Boulos, Wald and Shirley, "Geometric and Arithmetic Culling Methods for Entire Ray Packets", 2006). Where that box meets a node's is a range of t,
// since each side gives one linear inequality; its beginning is nearer than where any of the rays enters the node. A list that has no room for all is
// not used: then each ray walks the tree.

#include "render/passes/ordered_bits.glsl"

const uint kListThreads = 64u;
const uint kMostListed = 128u;
const uint kMostOpened = 511u;  // nodes that wait to be looked at; odd, as they come in pairs after the root

shared uint list_from_low[3], list_from_high[3], list_dir_low[3], list_dir_high[3];  // ordered_bits()
shared uint list_opened[kMostOpened];
shared uint list_end;                                   // of what is opened; more than kMostOpened: there was no room
shared uint list_count;                                 // likewise
shared uint list_found[kMostListed], list_nodes[kMostListed];  // leaves, as found and in order
shared float list_found_near[kMostListed], list_near[kMostListed];

struct RayBeam {
    vec3 from_low, from_high, dir_low, dir_high;
};

// Of the sides: where t d >= a, as a range of t.
void list_cut(vec3 a, vec3 d, inout float t_in, inout float t_out) {
    vec3 t = a / mix(d, vec3(1.0), equal(d, vec3(0.0)));
    vec3 first = mix(vec3(0.0), t, greaterThan(d, vec3(0.0)));
    vec3 none = mix(vec3(kFarVoxels), vec3(-1.0), greaterThan(a, vec3(0.0)));
    vec3 last = mix(mix(vec3(kFarVoxels), none, equal(d, vec3(0.0))), t, lessThan(d, vec3(0.0)));
    t_in = max(t_in, max(max(first.x, first.y), first.z));
    t_out = min(t_out, min(min(last.x, last.y), last.z));
}

// No ray of the beam enters the box before; kFarVoxels where none does. A ray's own test rounds otherwise, by less than what is left here.
float list_enters(InstanceNode n, RayBeam beam) {
    float t_in = 0.0;
    float t_out = kFarVoxels;
    list_cut(vec3(n.low_x, n.low_y, n.low_z) - beam.from_high, beam.dir_high, t_in, t_out);
    list_cut(beam.from_low - vec3(n.high_x, n.high_y, n.high_z), -beam.dir_low, t_in, t_out);
    t_in *= 1.0 - 1e-5;
    return t_in <= t_out * (1.0 + 1e-5) ? t_in : kFarVoxels;
}

// All threads come here, those without a ray say so; `from_eye`: all start there. Afterwards list_count says how many there are: more than
// kMostListed, and there is no list.
void make_list(bool has_ray, vec3 from, vec3 direction, bool from_eye) {
    uint thread = gl_LocalInvocationIndex;
    if (thread < 3u) {
        list_from_low[thread] = ~0u;
        list_from_high[thread] = 0u;
        list_dir_low[thread] = ~0u;
        list_dir_high[thread] = 0u;
    }
    if (thread == 0u) {
        list_opened[0] = 0u;
        list_end = 1u;
        list_count = 0u;
    }
    barrier();
    if (has_ray) {
        for (int axis = 0; axis < 3; ++axis) {
            atomicMin(list_dir_low[axis], ordered_bits(direction[axis]));
            atomicMax(list_dir_high[axis], ordered_bits(direction[axis]));
        }
        if (!from_eye) {
            for (int axis = 0; axis < 3; ++axis) {
                uint f = ordered_bits(from[axis]);
                atomicMin(list_from_low[axis], f);
                atomicMax(list_from_high[axis], f);
            }
        }
    }
    barrier();
    RayBeam beam = RayBeam(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
    for (int axis = 0; axis < 3; ++axis) {
        beam.dir_low[axis] = float_of_ordered(list_dir_low[axis]);
        beam.dir_high[axis] = float_of_ordered(list_dir_high[axis]);
        if (!from_eye) {
            beam.from_low[axis] = float_of_ordered(list_from_low[axis]);
            beam.from_high[axis] = float_of_ordered(list_from_high[axis]);
        }
    }
    uint begin = 0u;
    uint end = 1u;
    if (push.by_tree != 0u) {
        end = 0u;
        if (thread == 0u) list_count = kMostListed + 1u;
        barrier();
    }
    while (begin < end) {
        for (uint i = begin + thread; i < end; i += kListThreads) {
            uint at = list_opened[i];
            InstanceNode node = node_at(at);
            float near = list_enters(node, beam);
            if (near >= kFarVoxels) continue;
            if (node.instance != kNoInstance) {
                uint n = atomicAdd(list_count, 1u);
                if (n < kMostListed) {
                    list_found[n] = at;
                    list_found_near[n] = near;
                }
            } else {
                uint n = atomicAdd(list_end, 2u);
                if (n < kMostOpened) {
                    list_opened[n] = at + 1u;
                    list_opened[n + 1u] = node_at(at + 1u).skip;
                }
            }
        }
        barrier();
        begin = end;
        end = list_end;
        if (end > kMostOpened || list_count > kMostListed) {
            end = begin;
            if (thread == 0u) list_count = kMostListed + 1u;
        }
        barrier();
    }
    // Each finds its place among the others.
    uint count = list_count;
    if (count <= kMostListed) {
        for (uint i = thread; i < count; i += kListThreads) {
            float near = list_found_near[i];
            uint at = list_found[i];
            uint place = 0u;
            for (uint k = 0u; k < count; ++k) {
                float other = list_found_near[k];
                if (other < near || (other == near && list_found[k] < at)) place++;
            }
            list_nodes[place] = at;
            list_near[place] = near;
        }
    }
    barrier();
}

// The next leaf whose box the ray enters up to t_end, and where; kNoInstance: none is left. `at` counts in the list, or in the tree where there is
// none.
uint next_leaf(inout uint at, vec3 from, vec3 inverse, float t_end, inout float enters, inout int looks) {
    InstanceNode leaf;
    if (list_count > kMostListed) return next_in_tree(at, from, vec3(0.0), inverse, 0.0, t_end, leaf, enters, looks);
    while (at < list_count && list_near[at] <= t_end) {
        leaf = node_at(list_nodes[at]);
        looks++;
        at++;
        enters = walk_enters(leaf, from, inverse, t_end);
        if (enters < kFarVoxels) return leaf.instance;
    }
    return kNoInstance;
}

// SPDX-License-Identifier: MIT
// Triangles of meshes along rays, through the parts' trees of boxes. The including kernel has mesh.glsl and mesh_textures.glsl and declares first
// what they want, and MeshSurface mesh_surfaces[], MeshNode nodes[]; and behind this file next_mesh_ray().

const uint kNoTriangle = 0xffffffffu;

struct MeshWalkHit {
    float t;  // of what was found; else as far as was asked
    uint part, triangle;
};

// What a walk looks for.
struct MeshWalk {
    bool through;  // parts that blend; else the solid ones
    bool any;      // the first that is met will do, whichever side of it; else the nearest whose front it is, or that has two
    uint own_part, own_triangle;  // not met; kNoTriangle: all are
};

bool meets(MeshNode box, vec3 from, vec3 inverse, float t_last) {
    vec3 a = (vec3(box.min_x, box.min_y, box.min_z) - from) * inverse;
    vec3 b = (vec3(box.max_x, box.max_y, box.max_z) - from) * inverse;
    vec3 low = min(a, b);
    vec3 high = max(a, b);
    float first = max(max(low.x, low.y), max(low.z, 0.0));
    float last = min(min(high.x, high.y), min(high.z, t_last));
    return first <= last * 1.00001;
}

vec3 inverse_of(vec3 d) { return mix(1.0 / d, mix(vec3(-1e20), vec3(1e20), greaterThanEqual(d, vec3(0.0))), lessThan(abs(d), vec3(1e-20))); }

float opacity_at(MeshPart part, uint triangle, vec3 w) {
    MeshSurface s = mesh_surfaces[part.surface];
    uint a = mesh_corner(part, triangle, 0u);
    uint b = mesh_corner(part, triangle, 1u);
    uint c = mesh_corner(part, triangle, 2u);
    float alpha = s.alpha * (w.x * vertex_color(a).a + w.y * vertex_color(b).a + w.z * vertex_color(c).a);
    if ((s.base.where & kTextureIs) != 0u) {
        bool second = (s.base.where & kTextureSet1) != 0u;
        alpha *= mesh_texture(s.base, w.x * vertex_uv(a, second) + w.y * vertex_uv(b, second) + w.z * vertex_uv(c, second), vec2(0.0), vec2(0.0)).a;
    }
    return alpha;
}

// Called at a ray's end with what it met. False: that was the last; else the direction of the next one, from the same place.
bool next_mesh_ray(MeshWalkHit met, inout vec3 d);

// Metres from the eye; up to t_last. Of equals the first. kNoTriangle: nothing. What the last ray met is returned.
MeshWalkHit walk_meshes(vec3 from, vec3 d, float t_last, MeshWalk wanted) {
    MeshWalkHit hit = MeshWalkHit(t_last, 0u, kNoTriangle);
    vec3 inverse = inverse_of(d);
    uint top = nodes[0].skip;
    uint i = 0u;
    uint next_part = 0u;  // of a leaf of the parts' tree
    uint end_part = 0u;
    bool more = true;
    // Loops are nested as in march.gpu.h: all go on to a part that they meet; in it to a triangle that they meet; then all look for its holes. Rays
    // that follow one another are one loop, so that those in step wait for each other once and not at every ray's end.
    while (more) {
        uint which = 0u;
        bool found = false;
        do {
            if (next_part < end_part) {
                which = next_part++;
                found = ((mesh_parts[which].flags & kMeshBlend) != 0u) == wanted.through;
            } else if (i < top) {
                MeshNode box = nodes[i];
                bool meets_it = meets(box, from, inverse, hit.t);
                next_part = box.leaf >> 3u;
                end_part = next_part + (meets_it ? box.leaf & 7u : 0u);
                i = meets_it ? i + 1u : box.skip;
            } else {
                more = next_mesh_ray(hit, d);
                if (more) {
                    inverse = inverse_of(d);
                    hit = MeshWalkHit(t_last, 0u, kNoTriangle);
                    i = 0u;
                }
            }
        } while (more && !found);
        MeshPart part = mesh_parts[which];
        vec3 o = local_point(part, from);
        vec3 v = local_vector(part, d);
        vec3 local_inverse = inverse_of(v);
        uint j = found ? 0u : part.node_count;
        uint triangle = 0u;
        uint end_triangle = 0u;
        bool in_part = found;
        while (in_part) {
            bool candidate = false;
            float t = 0.0;
            vec3 w = vec3(0.0);
            do {
                while (triangle == end_triangle && j < part.node_count) {
                    MeshNode node = nodes[part.first_node + j];
                    bool meets_it = meets(node, o, local_inverse, hit.t);
                    triangle = node.leaf >> 3u;
                    end_triangle = triangle + (meets_it ? node.leaf & 7u : 0u);
                    j = meets_it ? j + 1u : node.skip;
                }
                in_part = triangle < end_triangle;
                if (in_part) {
                    vec3 a = vertex_position(mesh_corner(part, triangle, 0u)) - o;
                    vec3 b = vertex_position(mesh_corner(part, triangle, 1u)) - o;
                    vec3 c = vertex_position(mesh_corner(part, triangle, 2u)) - o;
                    w = vec3(dot(v, cross(b, c)), dot(v, cross(c, a)), dot(v, cross(a, b)));
                    float volume = w.x + w.y + w.z;
                    candidate = !(min(min(w.x, w.y), w.z) < 0.0 && max(max(w.x, w.y), w.z) > 0.0) && volume != 0.0;
                    w /= volume;
                    t = dot(w.x * a + w.y * b + w.z * c, v) / dot(v, v);
                    candidate = candidate && t > 0.0 && t < hit.t && !(which == wanted.own_part && triangle == wanted.own_triangle);
                    // Corners turn to the left as seen from the front, whether the part is mirrored or not.
                    vec3 face = cross(mesh_vector(part, b - a), mesh_vector(part, c - a));
                    candidate = candidate && (wanted.any || (part.flags & kMeshDoubleSided) != 0u || !(dot(face, d) > 0.0));
                    ++triangle;
                }
            } while (in_part && !candidate);
            bool holes = (part.flags & (kMeshBlend | kMeshMask)) == kMeshMask;
            if (candidate && !(holes && opacity_at(part, triangle - 1u, w) < mesh_surfaces[part.surface].alpha_cutoff)) {
                hit = MeshWalkHit(t, which, triangle - 1u);
                if (wanted.any) {  // to the ray's end
                    in_part = false;
                    next_part = end_part;
                    i = top;
                }
            }
        }
    }
    return hit;
}

// SPDX-License-Identifier: MIT
// Where light is looked for from what a pixel sees, when meshes may hide it. The including kernel includes mesh.glsl and rays.glsl and declares first what
// they want.

struct ShadowStart {
    vec3 from;      // metres from the eye, off the surface by what floats of it may be wrong
    vec3 outwards;  // the surface's own side: of a triangle its plane's
    uint part, triangle;  // that it is on; kNoPart: none
};
const uint kNoPart = 0xffffffffu;

ShadowStart shadow_start(uvec4 seen, TexelRay ray, vec3 normal) {
    float h = frame.grid.voxel_size;
    float t = uintBitsToFloat(seen.x) * h;
    vec3 origin = ray_origin(ray);
    ShadowStart s = ShadowStart(origin + ray.direction * t, normal, kNoPart, 0u);
    // As far off the surface as floats of its place, and of bricks, may be wrong.
    float off = 4e-6 * max(t, 0.1);
    if ((seen.y >> 28u) == kSeenMesh) {
        MeshPart part = mesh_parts[seen.z];
        s.part = seen.z;
        s.triangle = seen.y & 0x0fffffffu;
        vec3 p[3];
        vec3 n[3];
        for (uint i = 0u; i < 3u; ++i) {
            uint v = mesh_corner(part, s.triangle, i);
            p[i] = mesh_point(part, vertex_position(v));
            n[i] = normalize(mesh_normal(part, unpack_unit(mesh_vertices[v].normal)));
        }
        vec3 w = mesh_weights_inside(p[0] - origin, p[1] - origin, p[2] - origin, ray.direction);
        s.from = w.x * p[0] + w.y * p[1] + w.z * p[2];
        s.outwards = cross(p[1] - p[0], p[2] - p[0]);
        float size = length(s.outwards);
        s.outwards = size > 0.0 ? s.outwards / size : normal;
        float side = dot(s.outwards, ray.direction) > 0.0 ? -1.0 : 1.0;
        s.outwards *= side;
        // Onto the round surface that the normals tell of, so that facets do not shadow it (Hanika, "Hacking the Shadow Terminator", 2021).
        vec3 moved = vec3(0.0);
        for (int i = 0; i < 3; ++i) moved -= w[i] * min(dot(s.from - p[i], side * n[i]), 0.0) * (side * n[i]);
        s.from += moved;
    } else {
        off = max(off, 2e-3 * h);
    }
    s.from += s.outwards * off;
    return s;
}

// SPDX-License-Identifier: MIT
// Triangles of meshes. The including kernel includes mesh.gpu.h and declares first: MeshVertex mesh_vertices[], uint mesh_corners[], MeshPart mesh_parts[].

vec3 mesh_point(MeshPart part, vec3 p) {
    return vec3(dot(part.eye_x.xyz, p) + part.eye_x.w, dot(part.eye_y.xyz, p) + part.eye_y.w, dot(part.eye_z.xyz, p) + part.eye_z.w);
}

vec3 mesh_vector(MeshPart part, vec3 v) {
    return vec3(dot(part.eye_x.xyz, v), dot(part.eye_y.xyz, v), dot(part.eye_z.xyz, v));
}

// Normals turn by the inverse's transpose.
vec3 mesh_normal(MeshPart part, vec3 n) { return n.x * part.local_x.xyz + n.y * part.local_y.xyz + n.z * part.local_z.xyz; }

vec3 local_point(MeshPart part, vec3 p) {
    return vec3(dot(part.local_x.xyz, p) + part.local_x.w, dot(part.local_y.xyz, p) + part.local_y.w, dot(part.local_z.xyz, p) + part.local_z.w);
}

vec3 local_vector(MeshPart part, vec3 v) {
    return vec3(dot(part.local_x.xyz, v), dot(part.local_y.xyz, v), dot(part.local_z.xyz, v));
}

// What a linear function of the eye's frame, dot(c, p), is in the part's.
vec3 mesh_covector(MeshPart part, vec3 c) { return c.x * part.eye_x.xyz + c.y * part.eye_y.xyz + c.z * part.eye_z.xyz; }

// `triangle` counts from the part's first.
uint mesh_corner(MeshPart part, uint triangle, uint corner) {
    return part.first_vertex + mesh_corners[3u * (part.first_triangle + triangle) + corner];
}

vec3 vertex_position(uint v) { return vec3(mesh_vertices[v].x, mesh_vertices[v].y, mesh_vertices[v].z); }

// Weights of the corners where the ray from the origin along d meets the triangle's plane: volumes of the tetrahedra of the ray and two
// corners each, so that neighbours agree on the edge they share.
vec3 mesh_weights(vec3 a, vec3 b, vec3 c, vec3 d) {
    vec3 e = vec3(dot(d, cross(b, c)), dot(d, cross(c, a)), dot(d, cross(a, b)));
    float sum = e.x + e.y + e.z;
    return sum != 0.0 ? e / sum : vec3(1.0, 0.0, 0.0);
}

// The same inside the triangle: what is drawn covers the pixel's middle but for rounding.
vec3 mesh_weights_inside(vec3 a, vec3 b, vec3 c, vec3 d) {
    vec3 w = max(mesh_weights(a, b, c, d), vec3(0.0));
    return w / max(w.x + w.y + w.z, 1e-30);
}

vec2 vertex_uv(uint v, bool second) {
    return second ? vec2(mesh_vertices[v].u1, mesh_vertices[v].v1) : vec2(mesh_vertices[v].u0, mesh_vertices[v].v0);
}

vec4 vertex_color(uint v) {
    return vec4(unpackUnorm2x16(mesh_vertices[v].color_rg), unpackUnorm2x16(mesh_vertices[v].color_ba));
}

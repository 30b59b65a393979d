// SPDX-License-Identifier: MIT
// Where a vertex of a caster is in light space. The including kernel includes cascades.gpu.h and declares first: CascadePart cascade_parts[].

// Rounded to the grid of floats below 1: what a map subtracts from it is a multiple of that, so the same triangle falls on the same texels
// wherever the map's middle was snapped to.
float on_grid(float x) { return floor(x * 16777216.0 + 0.5) / 16777216.0; }

// u and v of the widest square, height.
vec3 cascade_place(uint part, vec3 p) {
    CascadePart c = cascade_parts[part];
    precise float u = dot(c.u.xyz, p) + c.u.w;
    precise float v = dot(c.v.xyz, p) + c.v.w;
    precise float w = dot(c.w.xyz, p) + c.w.w;
    return vec3(on_grid(u), on_grid(v), w);
}

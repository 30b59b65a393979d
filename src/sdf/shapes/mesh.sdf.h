// SPDX-License-Identifier: MIT
// Mesh: the solid of a triangle mesh, in the file's own axes and unit; holes are closed where the winding number passes one half.
// Read from a grid of two levels (sdf::MeshGrid) that baking has made 1-Lipschitz: bricks of 8x8x8 samples near the surface, one sample
// every 7 cells elsewhere, trilinear in both, equal where they meet.
// Outside the grid's box, with q the nearest point of the box: for every s in it |p - s|² >= |p - q|² + |q - s|², so the length of
// (|p - q|, g(q)) is a lower bound; it is 1-Lipschitz because moves along and across |p - q| are perpendicular. g > 0 on the box. The
// distance to a tighter box, which the solid does not leave either, is another bound; where it is positive so is g.

struct SampledMesh {
    param resolution;  // = 128 1, integer [8, 512]: cells along the longest side of the mesh's box
    param closed;      // = 0 1, flag: says that the mesh has no holes, which is checked and reported
    param first;       // = 0 1, internal: where the grid begins among the program's samples, in blocks of 512
    param3 lo;         // = (0, 0, 0) m, internal: corner of the grid's box
    param3 hi;         // = (1, 1, 1) m, internal: opposite corner
    param cell;        // = 1 m, internal: side of a fine cell
    param columns;     // = 1 1, internal: bricks along x
    param rows;        // = 1 1, internal: bricks along y
};

KILN_SDF real sd_mesh(real3 p, SampledMesh s, Samples samples) {
    real3 q = clamp(p, s.lo, s.hi);
    real3 u = (q - s.lo) / s.cell;
    real3 brick = floor(u / 7.0f);
    real3 inside = clamp(u - brick * 7.0f, real3(0.0f, 0.0f, 0.0f), real3(7.0f, 7.0f, 7.0f));
    // The coarse lattice: pairs of a sample and the block of the brick above it, or -1.
    whole base = whole_of(real(s.first)) << 9;
    whole down = whole_of(real(s.columns + 1.0f)) << 1;
    whole back = down * whole_of(real(s.rows + 1.0f));
    whole coarse = base + (whole_of(brick.x) << 1) + whole_of(brick.y) * down + whole_of(brick.z) * back;
    real block = sample_at(samples, coarse + whole(1u));
    mask fine = ge(block, real(0.0f));
    real3 voxel = min(floor(inside), real3(6.0f, 6.0f, 6.0f));
    whole texel =
        base + (whole_of(block) << 9) + whole_of(voxel.x) + (whole_of(voxel.y) << 3) + (whole_of(voxel.z) << 6);
    real3 t = select(fine, inside - voxel, inside / 7.0f);
    whole at = select(fine, texel, coarse);
    whole right = select(fine, whole(1u), whole(2u));
    whole up = select(fine, whole(8u), down);
    whole far = at + select(fine, whole(64u), back);
    real a = sample_at(samples, at);
    real b = sample_at(samples, at + up);
    real c = sample_at(samples, far);
    real d = sample_at(samples, far + up);
    a = a + (sample_at(samples, at + right) - a) * t.x;
    b = b + (sample_at(samples, at + right + up) - b) * t.x;
    c = c + (sample_at(samples, far + right) - c) * t.x;
    d = d + (sample_at(samples, far + right + up) - d) * t.x;
    a = a + (b - a) * t.y;
    c = c + (d - c) * t.y;
    real g = a + (c - a) * t.z;
    real3 e = p - q;
    real away = dot(e, e);
    real outer = select(gt(away, real(0.0f)), sqrt(away + g * g), g);
    param air = 8.0f * s.cell;
    real3 beyond = max(s.lo + param3(air, air, air) - p, p - (s.hi - param3(air, air, air)));
    real from_solid = length(max(beyond, real3(0.0f, 0.0f, 0.0f)));
    return select(gt(from_solid, real(0.0f)), max(outer, from_solid), g);
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_mesh(SampledMesh s) { return inflated(Bounds{s.lo, s.hi}, -8.0f * s.cell); }
#endif

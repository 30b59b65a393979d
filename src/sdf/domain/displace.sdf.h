// SPDX-License-Identifier: MIT
// Displace: moves the surface out and in by gradient noise on an integer lattice (after Perlin, "Improving Noise", 2002).
//
// Lattice point (i, j, k), 32-bit integers that wrap: hash = mix(i + mix(j + mix(k + seed))), where mix(x) is
//   x ^= x >> 16; x *= 0x7feb352d; x ^= x >> 15; x *= 0x846ca68b; x ^= x >> 16.
// Its gradient is (±1, ±1, ±1), negative where bit 31, 30, 29 of the hash is set (x, y, z). The noise at a point is the sum over the
// eight corners of its cell of weight * gradient · (point - corner) * 2/3, the weight a product over the axes of fade(t) or
// 1 - fade(t), fade(t) = t³ (t (6 t - 15) + 10), t the coordinate within the cell.
//
// |noise| <= 1: |gradient · (point - corner)| is at most the sum over the axes of the distance to the corner, and per axis the weighted
// sum (1 - fade(t)) t + fade(t) (1 - t) = 1/2 - (1 - 2 t)(1 - 2 fade(t)) / 2 <= 1/2, because both brackets have one sign.
// |gradient of the noise| <= 3.5: at a fixed point it is largest over the signs of the eight gradients, and over all points that is
// 37/12, in the middle of a cell; the test NoiseIsNeverSteeper proves 3.5 by branch and bound with mean value forms.

struct Displace {
    param amplitude;  // = 0.05 m, any: how far the surface moves at most
    param frequency;  // = 4 1/m, > 0: cells of the lattice per metre
    param seed;       // = 0 1, integer [0, 16777215]: another seed, another noise
};

KILN_SDF whole noise_mix(whole x) {
    whole a = (x ^ (x >> 16)) * whole(0x7feb352du);
    whole b = (a ^ (a >> 15)) * whole(0x846ca68bu);
    return b ^ (b >> 16);
}

// gradient · (x, y, z) of a corner; `row` is mix(j + mix(k + seed)).
KILN_SDF real noise_corner(whole row, whole i, real x, real y, real z) {
    whole hash = noise_mix(row + i);
    real sx = 1.0f - 2.0f * real_of(hash >> 31);
    real sy = 1.0f - 2.0f * real_of((hash >> 30) & whole(1u));
    real sz = 1.0f - 2.0f * real_of((hash >> 29) & whole(1u));
    return sx * x + sy * y + sz * z;
}

KILN_SDF real noise_fade(real t) { return t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f); }

// Along x between two corners of one row, u = fade(x).
KILN_SDF real noise_row(whole row, whole i, real x, real y, real z, real u) {
    real near = noise_corner(row, i, x, y, z);
    real far = noise_corner(row, i + whole(1u), x - 1.0f, y, z);
    return near + (far - near) * u;
}

KILN_SDF real gradient_noise(real3 p, param seed) {
    real3 cell = floor(p);
    real3 t = p - cell;
    // Beyond 1e9 cells no float has a fraction; the clamp keeps the integers in range.
    real3 at =
        clamp(cell, real3(KILN_C(-1e9), KILN_C(-1e9), KILN_C(-1e9)), real3(KILN_C(1e9), KILN_C(1e9), KILN_C(1e9)));
    whole i = whole_of(at.x);
    whole j = whole_of(at.y);
    whole k = whole_of(at.z) + whole_of(real(seed));
    whole k0 = noise_mix(k);
    whole k1 = noise_mix(k + whole(1u));
    real u = noise_fade(t.x);
    real v = noise_fade(t.y);
    real w = noise_fade(t.z);
    real a = noise_row(noise_mix(k0 + j), i, t.x, t.y, t.z, u);
    real b = noise_row(noise_mix(k0 + j + whole(1u)), i, t.x, t.y - 1.0f, t.z, u);
    real c = noise_row(noise_mix(k1 + j), i, t.x, t.y, t.z - 1.0f, u);
    real d = noise_row(noise_mix(k1 + j + whole(1u)), i, t.x, t.y - 1.0f, t.z - 1.0f, u);
    real near = a + (b - a) * v;
    real far = c + (d - c) * v;
    return (near + (far - near) * w) * KILN_C(0.6666666666666666);
}

KILN_SDF real value_displace(real d, real3 p, Displace s) {
    return d - s.amplitude * gradient_noise(p * s.frequency, s.seed);
}

#ifdef KILN_HOST
constexpr param kDisplaceSteepest = KILN_C(3.5);
KILN_SDF Bounds bounds_displace(Displace s, Bounds child) { return inflated(child, abs(s.amplitude)); }
KILN_SDF param lipschitz_displace(Displace s, Bounds) {
    return 1.0f + abs(s.amplitude) * s.frequency * kDisplaceSteepest;
}
#endif

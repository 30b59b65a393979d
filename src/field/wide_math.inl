// SPDX-License-Identifier: MIT
// What wide loops over points and over rays share, for one instruction set: F and I are kLanes floats and integers, M a mask of lanes.
// Included inside a namespace, after what the instruction set has to say of them. Every line here and in wide_points.inl and
// wide_rays.inl that makes a stored number does it as cubic.gpu.h, march.gpu.h and trilinear.gpu.h do, in their order.

struct F3 {
    F x, y, z;
};
struct I3 {
    I x, y, z;
};

static inline F abs(F v) { return floats_of(bits_of(v) & 0x7fffffff); }
static inline I min(I a, I b) { return select(lt(b, a), b, a); }
static inline I max(I a, I b) { return select(lt(a, b), b, a); }
static inline M ge0(I v) { return without(all(), lt(v, splat(0))); }

static inline F3 select(M m, F3 a, F3 b) { return {select(m, a.x, b.x), select(m, a.y, b.y), select(m, a.z, b.z)}; }
static inline I3 select(M m, I3 a, I3 b) { return {select(m, a.x, b.x), select(m, a.y, b.y), select(m, a.z, b.z)}; }

static inline F load(const float* from) {
    F v;
    std::memcpy(&v, from, sizeof v);
    return v;
}
static inline I load(const int32_t* from) {
    I v;
    std::memcpy(&v, from, sizeof v);
    return v;
}

// ---- texels

// Values at x and x + 1 of a row, voxels.
struct Pair {
    F a, b;
};
struct WideCorners {
    Pair v00, v10, v01, v11;  // by y and z
};

// Of the codes of both, as they lie in memory: in 32 bits, or in the lower 16.
template <bool Half>
static inline Pair values_of(I codes) {
    if constexpr (Half) {
        // A half's bits as those of a float are 2^112 times too small: normal halves and zero only, so exactly. The shifts
        // copy the sign into the exponent, the mask takes it out again.
        constexpr int32_t kKept = int32_t(0x8fffe000);
        return {floats_of(((codes << 16) >> 3) & kKept) * 0x1p112f, floats_of((codes >> 3) & kKept) * 0x1p112f};
    } else {
        const I a = max((codes << 24) >> 24, splat(-127)), b = max((codes << 16) >> 24, splat(-127));
        return {to_float(a) * kSnorm8StepVoxels, to_float(b) * kSnorm8StepVoxels};
    }
}

static inline F lerp(F a, F b, F t) { return a * (1.0f - t) + b * t; }
static inline F trilinear(const WideCorners& c, F3 p) {
    const F low = lerp(lerp(c.v00.a, c.v00.b, p.x), lerp(c.v10.a, c.v10.b, p.x), p.y);
    const F high = lerp(lerp(c.v01.a, c.v01.b, p.x), lerp(c.v11.a, c.v11.b, p.x), p.y);
    return lerp(low, high, p.z);
}

static inline I texel_of(I3 voxel) { return (voxel.z * 8 + voxel.y) * 8 + voxel.x; }
static inline M has(I flags, int flag) { return eq(flags & flag, splat(flag)); }

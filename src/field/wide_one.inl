// SPDX-License-Identifier: MIT
// Distance at one point: three axes in step instead of many points, and no branch on what is there: which points have a brick is not to be
// foreseen, and a branch gone wrong would throw away the reads of the points after this one. Included inside a namespace; shares no code
// with the packets (but the table of places), so that each is the other's check.

typedef float F4 __attribute__((vector_size(16)));
typedef int32_t I4 __attribute__((vector_size(16)));

static inline F4 four(const std::array<float, 4>& v) { return std::bit_cast<F4>(v); }

// The floats of four pairs of codes, x and x + 1, in their order; and of eight such floats, weighed, the four sums of pairs.
struct F8 {
    F4 low, high;
};
static inline F4 sums(F4 a, F4 b) {
#ifdef __SSE4_1__
    return (F4)_mm_hadd_ps((__m128)a, (__m128)b);
#else
    return __builtin_shuffle(a, b, I4{0, 2, 4, 6}) + __builtin_shuffle(a, b, I4{1, 3, 5, 7});
#endif
}
static inline F8 half_pairs(I4 w) {
#ifdef __AVX512VL__
    const __m256 v = _mm256_maskz_cvtph_ps(0xff, (__m128i)w);
    return {(F4)_mm256_castps256_ps128(v), (F4)_mm256_extractf128_ps(v, 1)};
#else
    constexpr int32_t kKept = int32_t(0x8fffe000);  // see wide_math.inl
    const F4 a = (F4)(((w << 16) >> 3) & kKept) * 0x1p112f, b = (F4)((w >> 3) & kKept) * 0x1p112f;
    return {__builtin_shuffle(a, b, I4{0, 4, 1, 5}), __builtin_shuffle(a, b, I4{2, 6, 3, 7})};
#endif
}

float distance(const WideView& view, const vec3& p) {
    // x, y, z and one unused lane; whole numbers in floats, right for grids of fewer than 2^22 texels an axis.
    const F4 q = (F4)_mm_setr_ps(p.x, p.y, p.z, 0) * view.inverse_voxel;
    const F4 low = four(view.low);
    const __m128 inside = _mm_and_ps(_mm_cmpge_ps((__m128)q, (__m128)low), _mm_cmplt_ps((__m128)q, (__m128)four(view.high)));
    if (_mm_movemask_ps(inside) != 15) return 0;
#ifdef __SSE4_1__
    const F4 down = (F4)_mm_floor_ps((__m128)q);
#else
    const F4 toward_zero = __builtin_convertvector(__builtin_convertvector(q, I4), F4);
    const F4 down = toward_zero > q ? toward_zero - 1.0f : toward_zero;
#endif
    const F4 part = q - down, texel = down - low;
    const I4 at = __builtin_convertvector(texel, I4);
    const auto part_of_place = [&](size_t axis) { return view.places[axis][uint32_t(at[axis])]; };
    const uint64_t place = part_of_place(0) + part_of_place(1) + part_of_place(2);
    constexpr size_t kWords = std::tuple_size_v<WidePage>;
    const size_t index = size_t(place >> 32), row = uint32_t(place);
    const WideEntry entry = (*view.pages[index / kWords])[index % kWords];

    const std::byte* const brick = reinterpret_cast<const std::byte*>(uintptr_t(entry & kWideAddress));
    F8 v;  // values at x and x + 1, by y, then z
    if (view.texel_bytes == 2) {
        const auto pair = [brick, row](size_t offset) {
            int32_t w;
            std::memcpy(&w, brick + 2 * (row + offset), 4);
            return w;
        };
        v = half_pairs((I4)_mm_setr_epi32(pair(0), pair(8), pair(64), pair(72)));
    } else {
        const auto value = [brick, row](size_t offset) {
            return float(std::max(int(int8_t(brick[row + offset])), -127)) * kSnorm8StepVoxels;
        };
        v = F8{F4{value(0), value(1), value(8), value(9)}, F4{value(64), value(65), value(72), value(73)}};
    }
    const F4 rest = 1.0f - part;
    const F4 along_xy = __builtin_shuffle(rest, part, I4{0, 4, 1, 5}), along_z = __builtin_shuffle(rest, part, I4{2, 6, 3, 7});
    const F4 along_x = __builtin_shuffle(along_xy, I4{0, 1, 0, 1}), along_y = __builtin_shuffle(along_xy, I4{2, 3, 2, 3});
    const F4 x = sums(v.low * along_x, v.high * along_x);
    const F4 y = sums(x * along_y, x * along_y);
    const F4 z = y * along_z;
    const F4 stored = z + __builtin_shuffle(z, I4{1, 1, 1, 1});

    // Every cell nearer than the jump is empty too. Nothing is known with a jump of 0.
    static constexpr float kFree[8] = {-1e9f, 0, 7, 14, 21, 28, 35, 42};
    const I4 cell = __builtin_convertvector((texel + 0.5f) * (1.0f / 7.0f), I4);
    const F4 in_cell = texel - __builtin_convertvector(cell, F4) * 7.0f + part;
    const F4 other = 7.0f - in_cell;
    const F4 to_face = in_cell < other ? in_cell : other;
    const float nearest = std::min(std::min(to_face[0], to_face[1]), to_face[2]);
    const float free = kFree[entry >> kWideJumpShift & 7] + nearest, size = free > 0.0f ? free : 0.0f;
    const I4 flags{int32_t(entry >> 32)};  // this lane alone counts
    const I4 sign = (flags << 1) & int32_t(0x80000000);
    static_assert(kWideOccupied == 1ull << 63 && kWideInside == 1ull << 62);
    const F4 empty = (F4)((I4)F4{size} ^ sign);
    return (flags < 0 ? stored : empty)[0] * view.grid.voxel_size;
}

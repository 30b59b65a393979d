// SPDX-License-Identifier: MIT
// Distance at one point: three axes in step instead of many points, and no branch on what is there: which points have a brick is not to be
// foreseen, and a branch gone wrong would throw away the reads of the points after this one. Included inside a namespace; shares no code
// with the packets, so that each is the other's check.

typedef float F4 __attribute__((vector_size(16)));
typedef int32_t I4 __attribute__((vector_size(16)));

static inline F4 whole(I4 v) { return __builtin_convertvector(v, F4); }
static inline F4 four(const std::array<float, 4>& v) { return std::bit_cast<F4>(v); }

float distance(const WideView& view, vec3 p) {
    // x, y, z and one unused lane; whole numbers in floats, right for grids of fewer than 2^22 texels an axis.
    const F4 q = (F4)_mm_setr_ps(p.x, p.y, p.z, 0) * view.inverse_voxel;
    const F4 low = four(view.low);
    if (_mm_movemask_ps((__m128)((q >= low) & (q < four(view.high)))) != 15) return 0;
#ifdef __SSE4_1__
    const F4 down = (F4)_mm_floor_ps((__m128)q);
#else
    const F4 toward_zero = whole(__builtin_convertvector(q, I4));
    const F4 down = toward_zero > q ? toward_zero - 1.0f : toward_zero;
#endif
    const F4 part = q - down, texel = down - low;
    const I4 cell = __builtin_convertvector((texel + 0.5f) * (1.0f / 7.0f), I4);
    const F4 voxel = texel - whole(cell) * 7.0f;
    const I4 at = __builtin_convertvector(voxel, I4);
    const I4 page = cell >> 3, in_page = cell & 7;
    const WidePage* const entries = view.pages[(page[2] * view.pages_y + page[1]) * view.pages_x + page[0]];
    const WideEntry entry = (*entries)[size_t((in_page[2] * 8 + in_page[1]) * 8 + in_page[0])];

    const std::byte* const brick = reinterpret_cast<const std::byte*>(uintptr_t(entry & kWideAddress));
    const size_t row = size_t((at[2] * 8 + at[1]) * 8 + at[0]);
    F4 a, b;  // values at x and x + 1; lanes by y, then z
    if (view.texel_bytes == 2) {
        const auto pair = [brick, row](size_t offset) {
            int32_t w;
            std::memcpy(&w, brick + 2 * (row + offset), 4);
            return w;
        };
        const I4 w = (I4)_mm_setr_epi32(pair(0), pair(8), pair(64), pair(72));
        constexpr int32_t kKept = int32_t(0x8fffe000);  // see wide_math.inl
        a = (F4)(((w << 16) >> 3) & kKept) * 0x1p112f;
        b = (F4)((w >> 3) & kKept) * 0x1p112f;
    } else {
        const auto value = [brick, row](size_t offset) {
            return float(std::max(int(int8_t(brick[row + offset])), -127)) * kSnorm8StepVoxels;
        };
        a = F4{value(0), value(8), value(64), value(72)};
        b = F4{value(1), value(9), value(65), value(73)};
    }
    const F4 x = a * (1.0f - part[0]) + b * part[0];
    const F4 near = __builtin_shuffle(x, I4{0, 2, 0, 2}), far = __builtin_shuffle(x, I4{1, 3, 1, 3});
    const F4 y = near * (1.0f - part[1]) + far * part[1];
    const float stored = y[0] * (1.0f - part[2]) + y[1] * part[2];

    // Every cell nearer than the jump is empty too.
    const int jump = int(entry >> kWideJumpShift) & 7;
    const F4 in_cell = voxel + part;
    const F4 other = 7.0f - in_cell;
    const F4 to_face = in_cell < other ? in_cell : other;
    const float nearest = std::min(std::min(to_face[0], to_face[1]), to_face[2]);
    const uint32_t occupied = uint32_t(int64_t(entry) >> 63);
    const uint32_t known = uint32_t(-int32_t(jump != 0));
    const uint32_t inside = uint32_t(entry >> 32) << 1 & 0x80000000u;
    const uint32_t empty = (std::bit_cast<uint32_t>(float(jump - 1) * 7.0f + nearest) & known) ^ inside;
    const uint32_t chosen = (std::bit_cast<uint32_t>(stored) & occupied) | (empty & ~occupied);
    return std::bit_cast<float>(chosen) * view.grid.voxel_size;
}

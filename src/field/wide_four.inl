// SPDX-License-Identifier: MIT
// Four lanes without gather instructions. Included where F, I and their masks are known.

static inline F min(F a, F b) { return b < a ? b : a; }  // as std::min
static inline F max(F a, F b) { return a < b ? b : a; }
static inline F sqrt(F a) { return (F)_mm_sqrt_ps((__m128)a); }
static inline bool any(M m) { return _mm_movemask_ps((__m128)m) != 0; }
static inline I gather_scaled(const void* base, I index, ptrdiff_t scale) {
    I out;
    for (int lane = 0; lane < kLanes; ++lane) {
        int32_t one;
        std::memcpy(&one, static_cast<const char*>(base) + scale * ptrdiff_t(index[lane]), 4);
        out[lane] = one;
    }
    return out;
}
static inline I gather(const void* base, I index) { return gather_scaled(base, index, 4); }
static inline I gather_bytes(const void* base, I index) { return gather_scaled(base, index, 1); }

struct Pointers {
    const std::byte* at[kLanes];
};
static inline Pointers gather_pointers(const std::byte* const* table, I index) {
    return {{table[index[0]], table[index[1]], table[index[2]], table[index[3]]}};
}
static inline Pointers moved(const Pointers& p, I bytes) {
    return {{p.at[0] + bytes[0], p.at[1] + bytes[1], p.at[2] + bytes[2], p.at[3] + bytes[3]}};
}
template <int kBytes>
static inline I gather_from(const Pointers& p) {
    I out;
    for (int lane = 0; lane < kLanes; ++lane) {
        int32_t one;
        std::memcpy(&one, p.at[lane] + kBytes, 4);
        out[lane] = one;
    }
    return out;
}

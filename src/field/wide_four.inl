// SPDX-License-Identifier: MIT
// Four lanes without gather instructions. Included where F, I and their masks are known.

static inline F min(F a, F b) { return b < a ? b : a; }  // as std::min
static inline F max(F a, F b) { return a < b ? b : a; }
static inline F sqrt(F a) { return (F)_mm_sqrt_ps((__m128)a); }
static inline bool any(M m) { return _mm_movemask_ps((__m128)m) != 0; }
template <int kScale = 1>
static inline I gather_bytes(const void* base, I index) {
    I out;
    for (int lane = 0; lane < kLanes; ++lane) {
        int32_t one;
        std::memcpy(&one, static_cast<const char*>(base) + ptrdiff_t(index[lane]) * kScale, 4);
        out[lane] = one;
    }
    return out;
}
template <int kScale>
static inline I gather_bytes(M m, const void* base, I index, I others) {
    for (int lane = 0; lane < kLanes; ++lane) {
        if (m[lane] == 0) continue;
        int32_t one;
        std::memcpy(&one, static_cast<const char*>(base) + ptrdiff_t(index[lane]) * kScale, 4);
        others[lane] = one;
    }
    return others;
}
static inline uint32_t bits(M m) { return uint32_t(_mm_movemask_ps((__m128)m)); }
static inline I widened(const uint8_t (&of)[kLanes]) { return I{of[0], of[1], of[2], of[3]}; }
static inline int count(M m) { return int(0x4332322132212110u >> (4 * bits(m)) & 15); }

// See wide_avx2.cpp: of lane k.
static inline F rows_from(const float* const (&at)[kLanes], int k, int first) { return (F)_mm_load_ps(at[k] + first); }
static inline void rows_to(float* const (&at)[kLanes], int k, int first, F rows) { _mm_store_ps(at[k] + first, (__m128)rows); }
static inline F low_in_turns(F a, F b) { return (F)_mm_unpacklo_ps((__m128)a, (__m128)b); }
static inline F high_in_turns(F a, F b) { return (F)_mm_unpackhi_ps((__m128)a, (__m128)b); }
static inline F low_pairs(F a, F b) { return (F)_mm_shuffle_ps((__m128)a, (__m128)b, 0x44); }
static inline F high_pairs(F a, F b) { return (F)_mm_shuffle_ps((__m128)a, (__m128)b, 0xee); }

struct Pointers {
    const std::byte* at[kLanes];
};
static inline Pointers gather_pages(const WidePage* const* table, I index) {
    const auto page = [&](int lane) { return reinterpret_cast<const std::byte*>(table[index[lane]]); };
    return {{page(0), page(1), page(2), page(3)}};
}
static inline Pointers moved(const Pointers& p, I bytes) {
    return {{p.at[0] + bytes[0], p.at[1] + bytes[1], p.at[2] + bytes[2], p.at[3] + bytes[3]}};
}
static inline Pointers gather_entries(const Pointers& at, I& flags) {
    Pointers out;
    for (int lane = 0; lane < kLanes; ++lane) {
        WideEntry entry;
        std::memcpy(&entry, at.at[lane], sizeof entry);
        flags[lane] = int32_t(entry >> 32);
        out.at[lane] = reinterpret_cast<const std::byte*>(uintptr_t(entry & kWideAddress));
    }
    return out;
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

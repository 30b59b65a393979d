// SPDX-License-Identifier: MIT
// Masks as vectors of 0 and -1, for instruction sets without mask registers. Included where F and I are known.

using M = I;

static inline M lt(F a, F b) { return a < b; }
static inline M le(F a, F b) { return a <= b; }
static inline M eq(F a, F b) { return a == b; }
static inline M lt(I a, I b) { return a < b; }
static inline M eq(I a, I b) { return a == b; }
static inline M below(I a, int32_t b) {  // both as uint32_t
    typedef uint32_t U __attribute__((vector_size(sizeof(I))));
    return (U)a < uint32_t(b);
}
static inline F select(M m, F a, F b) { return m ? a : b; }
static inline I select(M m, I a, I b) { return m ? a : b; }
static inline M all() { return I{} == I{}; }
static inline M none() { return I{}; }
static inline M both(M a, M b) { return a & b; }
static inline M either(M a, M b) { return a | b; }
static inline M without(M a, M b) { return a & ~b; }

static inline M mask_of(uint32_t bits) {
    M lanes{};
    for (int lane = 0; lane < kLanes; ++lane) lanes[lane] = 1 << lane;
    return (lanes & int32_t(bits)) != 0;
}
// Lanes of m take one element after another.
template <typename V, typename T>
static inline V expand(M m, V others, const T* from) {
    for (int lane = 0; lane < kLanes; ++lane) {
        if (m[lane] != 0) others[lane] = *from++;
    }
    return others;
}

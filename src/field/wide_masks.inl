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

static inline uint32_t bits(M m);
static inline I widened(const uint8_t (&of)[kLanes]);

// Lanes of a mask moved to the front, in their order.
struct PackedLanes {
    uint8_t of[1 << kLanes][kLanes];
    constexpr PackedLanes() : of() {
        for (int mask = 0; mask < 1 << kLanes; ++mask) {
            for (int lane = 0, to = 0; lane < kLanes; ++lane) {
                if ((mask >> lane & 1) != 0) of[mask][to++] = uint8_t(lane);
            }
        }
    }
};
constexpr PackedLanes kPackedLanes;
struct Packing {
    I from;
    explicit Packing(M m) : from(widened(kPackedLanes.of[bits(m)])) {}
    I operator()(I v) const { return __builtin_shuffle(v, from); }
    F operator()(F v) const { return __builtin_shuffle(v, from); }
};

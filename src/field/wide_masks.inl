// SPDX-License-Identifier: MIT
// Masks as vectors of 0 and -1, for instruction sets without mask registers. Included where F and I are known.

using M = I;

static inline M lt(F a, F b) { return a < b; }
static inline M le(F a, F b) { return a <= b; }
static inline M eq(F a, F b) { return a == b; }
static inline M lt(I a, I b) { return a < b; }
static inline M eq(I a, I b) { return a == b; }
static inline F select(M m, F a, F b) { return m ? a : b; }
static inline I select(M m, I a, I b) { return m ? a : b; }
static inline M all() { return I{} == I{}; }
static inline M none() { return I{}; }
static inline M both(M a, M b) { return a & b; }
static inline M either(M a, M b) { return a | b; }
static inline M without(M a, M b) { return a & ~b; }

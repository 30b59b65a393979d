// SPDX-License-Identifier: MIT
// Vectors of the compiler's own kind. Included where F and I are such.

static inline F number(float v) { return v - F{}; }  // not F{} + v: that would lose the sign of -0
static inline I splat(int v) { return I{} + v; }
static inline F to_float(I v) { return __builtin_convertvector(v, F); }
static inline I to_int(F v) { return __builtin_convertvector(v, I); }
static inline F floats_of(I bits) { return (F)bits; }
static inline I bits_of(F v) { return (I)v; }

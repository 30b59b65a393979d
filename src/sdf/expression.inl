// SPDX-License-Identifier: MIT
// Formulas for one lane type: a function on a chunk of points, and the same on intervals. Included before eval_lanes.inl.
// Intervals are outward by rounding: they hold what float and what double arithmetic gives at any point of the operands' intervals
// (rounding is monotonic, so float results lie between the rounded ends; one more step outward covers double). An end that is not
// finite says that nothing is known, NaN included.

#ifndef KILN_FEW  // see eval_lanes.inl
#include "sdf/expression_fn.sdf.h"
#endif

struct Chunk {
    real v[KILN_VECTORS];
};

static inline void chunk_of(Chunk& out, real value) {
    for (int i = 0; i < KILN_VECTORS; ++i) out.v[i] = value;
}

// out may be a or b. fn needs no point and no memory.
static __attribute__((noinline)) void arithmetic(Chunk& out, const Chunk& a, const Chunk& b, Fn fn) {
    switch (fn) {
        case Fn::Negate:
            for (int i = 0; i < KILN_VECTORS; ++i) out.v[i] = -a.v[i];
            break;
        case Fn::Abs:
            for (int i = 0; i < KILN_VECTORS; ++i) out.v[i] = abs(a.v[i]);
            break;
        case Fn::Sqrt:
            for (int i = 0; i < KILN_VECTORS; ++i) out.v[i] = fn_sqrt(a.v[i]);
            break;
        case Fn::Square:
            for (int i = 0; i < KILN_VECTORS; ++i) out.v[i] = a.v[i] * a.v[i];
            break;
        case Fn::Floor:
            for (int i = 0; i < KILN_VECTORS; ++i) out.v[i] = floor(a.v[i]);
            break;
        case Fn::Sin:
            for (int i = 0; i < KILN_VECTORS; ++i) out.v[i] = fn_sin(a.v[i]);
            break;
        case Fn::Cos:
            for (int i = 0; i < KILN_VECTORS; ++i) out.v[i] = fn_cos(a.v[i]);
            break;
        case Fn::Exp:
            for (int i = 0; i < KILN_VECTORS; ++i) out.v[i] = exp_of(a.v[i]);
            break;
        case Fn::Log:
            for (int i = 0; i < KILN_VECTORS; ++i) out.v[i] = log_of(a.v[i]);
            break;
        case Fn::Add:
            for (int i = 0; i < KILN_VECTORS; ++i) out.v[i] = a.v[i] + b.v[i];
            break;
        case Fn::Sub:
            for (int i = 0; i < KILN_VECTORS; ++i) out.v[i] = a.v[i] - b.v[i];
            break;
        case Fn::Mul:
            for (int i = 0; i < KILN_VECTORS; ++i) out.v[i] = a.v[i] * b.v[i];
            break;
        case Fn::Div:
            for (int i = 0; i < KILN_VECTORS; ++i) out.v[i] = a.v[i] / b.v[i];
            break;
        case Fn::Min:
            for (int i = 0; i < KILN_VECTORS; ++i) out.v[i] = min(a.v[i], b.v[i]);
            break;
        case Fn::Max:
            for (int i = 0; i < KILN_VECTORS; ++i) out.v[i] = max(a.v[i], b.v[i]);
            break;
        case Fn::Atan2:
            for (int i = 0; i < KILN_VECTORS; ++i) out.v[i] = atan_of(a.v[i], b.v[i]);
            break;
        case Fn::Mod:
            for (int i = 0; i < KILN_VECTORS; ++i) out.v[i] = fn_mod(a.v[i], b.v[i]);
            break;
        case Fn::Copy:
            out = a;
            break;
        default: __builtin_unreachable();
    }
}

#ifndef KILN_FEW
struct Range {
    real lo, hi;
};

KILN_SDF real infinite() { return real(param(__builtin_inff())); }
KILN_SDF mask is_finite(Range r) {
    const real most = real(param(3e38f));
    return both(lt(abs(r.lo), most), lt(abs(r.hi), most));
}
// One rounding outward.
KILN_SDF Range outward(real lo, real hi) {
    const param step = 2.4e-7f;
    const param least = 1e-37f;
    return {lo - (abs(lo) * step + least), hi + (abs(hi) * step + least)};
}
KILN_SDF Range around(real lo, real hi, real by) { return {lo - by, hi + by}; }

// Sine over [a.lo, a.hi], its crests at crest + 2 pi n; of_lo and of_hi its values at the ends.
KILN_SDF Range wave(Range a, real of_lo, real of_hi, param crest) {
    const param one_turn = 0.15915494309189535f;
    const real one = real(param(1.0f));
    const real size = max(abs(a.lo), abs(a.hi));
    const real slack = size * param(1e-6f) + param(1e-5f);  // a crest this near the ends counts as inside
    const real from = (a.lo - slack - crest) * one_turn;
    const real to = (a.hi + slack - crest) * one_turn;
    const mask far = gt(size, real(param(1e4f)));
    const mask has_crest = either(far, gt(floor(to), floor(from)));
    const mask has_trough = either(far, gt(floor(to + param(0.5f)), floor(from + param(0.5f))));
    const real error = real(param(2e-6f));
    const real lo = select(has_trough, -one, max(min(of_lo, of_hi) - error, -one));
    const real hi = select(has_crest, one, min(max(of_lo, of_hi) + error, one));
    return {lo, hi};
}

// Which operand of a Min or Max is the result everywhere: 1 a, 2 b.
struct Winner2 {
    mask a, b;
};
KILN_SDF Winner2 winner_of(Range a, Range b, bool least) {
    const mask known = both(is_finite(a), is_finite(b));
    const mask a_below = both(known, lt(a.hi, b.lo));
    const mask b_below = both(known, lt(b.hi, a.lo));
    return least ? Winner2{a_below, b_below} : Winner2{b_below, a_below};
}

[[maybe_unused]] static Range range_of(Range a, Range b, Fn fn) {
    const real zero = real(param(0.0f));
    const real tiny = real(param(2e-6f));
    Range out{zero, zero};
    switch (fn) {
        case Fn::Negate: out = {-a.hi, -a.lo}; break;
        case Fn::Abs: {
            const real far = max(abs(a.lo), abs(a.hi));
            out = {max(max(a.lo, -a.hi), zero), far};
            break;
        }
        case Fn::Sqrt: out = outward(fn_sqrt(a.lo), fn_sqrt(a.hi)); break;
        case Fn::Square: {
            const real far = max(abs(a.lo), abs(a.hi));
            const real near = max(max(a.lo, -a.hi), zero);
            out = outward(near * near, far * far);
            break;
        }
        case Fn::Floor: out = {floor(a.lo), floor(a.hi)}; break;
        case Fn::Sin: out = wave(a, fn_sin(a.lo), fn_sin(a.hi), 1.5707963267948966f); break;
        case Fn::Cos: out = wave(a, fn_cos(a.lo), fn_cos(a.hi), 0.0f); break;
        case Fn::Exp: {
            const real lo = exp_of(a.lo), hi = exp_of(a.hi);
            out = {lo - lo * tiny, hi + hi * tiny};
            break;
        }
        case Fn::Log: {
            const real lo = log_of(a.lo), hi = log_of(a.hi);
            out = {lo - (abs(lo) * tiny + tiny), hi + (abs(hi) * tiny + tiny)};
            break;
        }
        case Fn::Add: out = outward(a.lo + b.lo, a.hi + b.hi); break;
        case Fn::Sub: out = outward(a.lo - b.hi, a.hi - b.lo); break;
        case Fn::Mul: {
            const real u = a.lo * b.lo, v = a.lo * b.hi, s = a.hi * b.lo, t = a.hi * b.hi;
            out = outward(min(min(u, v), min(s, t)), max(max(u, v), max(s, t)));
            break;
        }
        case Fn::Div: {
            const real u = a.lo / b.lo, v = a.lo / b.hi, s = a.hi / b.lo, t = a.hi / b.hi;
            const mask apart = either(gt(b.lo, zero), lt(b.hi, zero));
            out = outward(min(min(u, v), min(s, t)), max(max(u, v), max(s, t)));
            out = {select(apart, out.lo, -infinite()), select(apart, out.hi, infinite())};
            break;
        }
        case Fn::Min: out = {min(a.lo, b.lo), min(a.hi, b.hi)}; break;
        case Fn::Max: out = {max(a.lo, b.lo), max(a.hi, b.hi)}; break;
        case Fn::Atan2: {
            // The corners, where the branch cut is not met (a is y, b is x).
            const real u = atan_of(a.lo, b.lo), v = atan_of(a.lo, b.hi), s = atan_of(a.hi, b.lo), t = atan_of(a.hi, b.hi);
            const mask apart = either(gt(b.lo, zero), either(gt(a.lo, zero), lt(a.hi, zero)));
            const real half_turn = real(param(3.141593f));
            out = around(min(min(u, v), min(s, t)), max(max(u, v), max(s, t)), tiny);
            out = {select(apart, out.lo, -half_turn - tiny), select(apart, out.hi, half_turn + tiny)};
            break;
        }
        case Fn::Mod: {
            const real size = max(max(abs(a.lo), abs(a.hi)), max(abs(b.lo), abs(b.hi)));
            const mask apart = either(gt(b.lo, zero), lt(b.hi, zero));
            out = around(min(b.lo, zero), max(b.hi, zero), size * param(1e-6f));
            // The same whole number of b everywhere, b being one number.
            const real from = floor(a.lo / b.lo - param(1e-5f)), to = floor(a.hi / b.lo + param(1e-5f));
            const mask one_piece = both(both(ge(b.lo, b.hi), gt(b.lo, zero)), both(ge(from, to), lt(abs(from), real(param(1e4f)))));
            const Range piece = around(a.lo - b.lo * from, a.hi - b.lo * from, size * param(1e-6f));
            out = {select(one_piece, piece.lo, out.lo), select(one_piece, piece.hi, out.hi)};
            out = {select(apart, out.lo, -infinite()), select(apart, out.hi, infinite())};
            break;
        }
        case Fn::Copy: out = a; break;
        default: __builtin_unreachable();
    }
    mask known = both(is_finite(a), le(out.lo, out.hi));
    if (operands(fn) == 2) known = both(known, is_finite(b));
    return {select(known, out.lo, -infinite()), select(known, out.hi, infinite())};
}
#endif  // KILN_FEW

// SPDX-License-Identifier: MIT
// The tape interpreter for one lane type. Included once per instruction set, inside its own namespace, after the shape language and
// the generated texts. Works instruction by instruction on a chunk of points, so that decoding costs nothing.
// Uses no standard-library templates: what a wide instruction set compiles here must not be shared with other files.
// KILN_VECTORS: vectors in a chunk. load(), store() and real are the including file's. Included a second time, with KILN_FEW, it is the
// interpreter of distances alone for chunks of another size.

#include "sdf/expression.inl"

#ifndef KILN_FEW
struct MixChunk {
    Mix v[KILN_VECTORS];
};
#endif

struct Registers {
    Chunk cell[3];             // C
    Chunk point[3];            // P
    Chunk value[kRegisters];
    Chunk* memory;             // of formulas with more values than registers; null where the tape has none
};

static inline real3 point_at(const Chunk* p, int i) { return real3(p[0].v[i], p[1].v[i], p[2].v[i]); }
static inline void set_point(Chunk* p, int i, real3 q) {
    p[0].v[i] = q.x;
    p[1].v[i] = q.y;
    p[2].v[i] = q.z;
}
static inline param3 param3_at(const float* w) { return param3(param(w[0]), param(w[1]), param(w[2])); }

#ifndef KILN_FEW
// op_distance() of k = 0 with its zeros left out, which changes no bit.
template <uint32_t kOp>
static inline real hard_op(real a, real b) {
    return kOp == 0 ? min(a, b) : kOp == 1 ? -min(-a, b) : -min(-a, -b);
}

// Row-major 3x3 matrix times (p - t); w = t[3] M[9].
static inline real3 affine(real3 p, const float* w) {
    const real3 q = p - param3_at(w);
    return real3(param(w[3]) * q.x + param(w[4]) * q.y + param(w[5]) * q.z,
                 param(w[6]) * q.x + param(w[7]) * q.y + param(w[8]) * q.z,
                 param(w[9]) * q.x + param(w[10]) * q.y + param(w[11]) * q.z);
}

// Signed distance of p from the box; its faces may be infinite.
static inline real box_distance(real3 p, param3 lo, param3 hi) {
    const real zero = real(param(0));
    const real3 q = max(real3(lo) - p, p - real3(hi));
    return length(max(q, real3(zero, zero, zero))) + min(max(q.x, max(q.y, q.z)), zero);
}

// The distance a formula or a user's shape stands for: nothing where it is no number.
static inline real cleaned(real v) { return select(lt(abs(v), real(param(kEmpty))), v, real(param(kEmpty))); }
#endif

// One step of a formula. An operand may be the instruction's own number.
static void formula_step(Registers& r, uint32_t word, const float* w) {
    const uint32_t aux = (word >> 5) & 255u;
    const Fn fn = Fn(aux & kFnBits);
    Chunk& dst = r.value[(word >> 13) & 31u];
    const Chunk* a = &r.value[(word >> 18) & 31u];
    const Chunk* b = &r.value[(word >> 23) & 31u];
    switch (fn) {
        case Fn::X: dst = r.point[0]; return;
        case Fn::Y: dst = r.point[1]; return;
        case Fn::Z: dst = r.point[2]; return;
        case Fn::Constant: chunk_of(dst, real(param(w[0]))); return;
        case Fn::Store: r.memory[uint32_t(w[0])] = *a; return;
        case Fn::Load: dst = r.memory[uint32_t(w[0])]; return;
        default: break;
    }
    Chunk number;
    if ((aux & (kNumberA | kNumberB)) != 0) {
        chunk_of(number, real(param(w[0])));
        ((aux & kNumberA) != 0 ? a : b) = &number;
    }
    arithmetic(dst, *a, *b, fn);
}

// A user's function sees doubles, so that one function serves every lane type, exact answers among them.
static void custom_step(Chunk& dst, const Chunk* point, uint32_t index, const float* w) {
    constexpr int kCount = int(sizeof(Chunk) / sizeof(param));
    param lanes[kCount];
    double p[3][kCount], d[kCount];
    for (int axis = 0; axis < 3; ++axis) {
        __builtin_memcpy(lanes, &point[axis], sizeof lanes);
        for (int i = 0; i < kCount; ++i) p[axis][i] = double(lanes[i]);
    }
    custom_points(index, w + 3, p[0], p[1], p[2], kCount, d);
    for (int i = 0; i < kCount; ++i) lanes[i] = param(d[i]);
    __builtin_memcpy(&dst, lanes, sizeof lanes);
    for (int i = 0; i < KILN_VECTORS; ++i) dst.v[i] = cleaned(dst.v[i]) * param(w[0]);
}

// One instruction that moves the point or makes or changes one value. Kept apart so that both interpreters share its code.
static __attribute__((noinline)) void step(Registers& r, uint32_t word, const float* w, Samples samples) {
    const uint32_t aux = (word >> 5) & 255u;
    Chunk& dst = r.value[(word >> 13) & 31u];
    switch (Opcode(word & 31u)) {
        case Opcode::PointCell:
            for (int i = 0; i < KILN_VECTORS; ++i) set_point(r.point, i, point_at(r.cell, i));
            break;
        case Opcode::PointTranslate:
            for (int i = 0; i < KILN_VECTORS; ++i) set_point(r.point, i, point_at(r.cell, i) - param3_at(w));
            break;
        case Opcode::PointAffine:
            for (int i = 0; i < KILN_VECTORS; ++i) set_point(r.point, i, affine(point_at(r.cell, i), w));
            break;
        case Opcode::PointAffineOn:
            for (int i = 0; i < KILN_VECTORS; ++i) set_point(r.point, i, affine(point_at(r.point, i), w));
            break;
        case Opcode::PointWarp:
            for (int i = 0; i < KILN_VECTORS; ++i) set_point(r.point, i, point_warp(aux, point_at(r.point, i), w));
            break;
        case Opcode::PointCopy:
            for (int i = 0; i < KILN_VECTORS; ++i)
                set_point(r.point, i, copy_warp(aux, point_at(r.point, i), w + 6, param3_at(w), param3_at(w + 3)));
            break;
        case Opcode::PointClamp:
            for (int i = 0; i < KILN_VECTORS; ++i)
                set_point(r.point, i, clamp(point_at(r.point, i), param3_at(w), param3_at(w + 3)));
            break;
        case Opcode::Shape:
            for (int i = 0; i < KILN_VECTORS; ++i)
                dst.v[i] = shape_distance(aux, point_at(r.point, i), w + 3, samples) * param(w[0]);
            break;
        case Opcode::Value:
            for (int i = 0; i < KILN_VECTORS; ++i)
                dst.v[i] = value_warp(aux, dst.v[i] * param(w[1]), point_at(r.point, i), w + 2) * param(w[0]);
            break;
        case Opcode::Bound:
            for (int i = 0; i < KILN_VECTORS; ++i) {
                const real box = box_distance(point_at(r.point, i), param3_at(w + 2), param3_at(w + 5)) * param(w[0]);
                dst.v[i] = max(min(dst.v[i], real(param(w[1]))), box);
            }
            break;
        case Opcode::Arithmetic: formula_step(r, word, w); break;
        case Opcode::Custom: custom_step(dst, r.point, aux, w); break;
        case Opcode::Result: {
            const Chunk& from = r.value[(word >> 18) & 31u];
            for (int i = 0; i < KILN_VECTORS; ++i) dst.v[i] = cleaned(from.v[i]) * param(w[0]);
            break;
        }
        default: __builtin_unreachable();
    }
}

// Both instructions of a leaf that is_fused_leaf(), where `code` begins with PointTranslate and is one: most edits begin like this.
template <uint32_t kShape>
static inline void moved_leaf(Registers& r, Chunk& dst, const float* t, const float* w) {
    for (int i = 0; i < KILN_VECTORS; ++i) {
        const real3 p = point_at(r.cell, i) - param3_at(t);
        set_point(r.point, i, p);
        dst.v[i] = shape_distance(kShape, p, w + 3, Samples{nullptr}) * param(w[0]);
    }
}
static inline bool moved_ball_or_box(Registers& r, const uint32_t* code, const float* params) {
    const uint32_t word = code[2], shape = (word >> 5) & 255u;
    if (!is_fused_leaf(code[0], word)) return false;
    Chunk& dst = r.value[(word >> 13) & 31u];
    if (shape == kFusedSphere) {
        moved_leaf<kFusedSphere>(r, dst, params + code[1], params + code[3]);
    } else {
        moved_leaf<kFusedBox>(r, dst, params + code[1], params + code[3]);
    }
    return true;
}

template <uint32_t kOp>
static inline void combine_as(Chunk& dst, const Chunk& a, const Chunk& b, param k) {
    if (k > param(0)) {
        for (int i = 0; i < KILN_VECTORS; ++i) dst.v[i] = op_distance(kOp, a.v[i], b.v[i], k);
    } else {
        for (int i = 0; i < KILN_VECTORS; ++i) dst.v[i] = hard_op<kOp>(a.v[i], b.v[i]);
    }
}
static inline void combine(Chunk& dst, const Chunk& a, const Chunk& b, uint32_t op, param k) {
    switch (op) {
        case 0: combine_as<0>(dst, a, b, k); break;
        case 1: combine_as<1>(dst, a, b, k); break;
        case 2: combine_as<2>(dst, a, b, k); break;
        default:
            for (int i = 0; i < KILN_VECTORS; ++i) dst.v[i] = a.v[i];
            break;
    }
}

static void run_distance(Registers& r, const uint32_t* code, size_t count, const float* params, Samples samples) {
    for (size_t pc = 0; pc < count; ++pc) {
        const uint32_t word = code[2 * pc];
        const float* w = params + code[2 * pc + 1];
        Chunk& dst = r.value[(word >> 13) & 31u];
        const Chunk& a = r.value[(word >> 18) & 31u];
        const Chunk& b = r.value[(word >> 23) & 31u];
        const uint32_t aux = (word >> 5) & 255u;
        if (Opcode(word & 31u) == Opcode::PointTranslate && pc + 1 < count && moved_ball_or_box(r, code + 2 * pc, params)) {
            ++pc;
            continue;
        }
        switch (Opcode(word & 31u)) {
            case Opcode::Combine: combine(dst, a, b, aux & 3u, param(w[0])); break;
            case Opcode::Move:
                for (int i = 0; i < KILN_VECTORS; ++i) dst.v[i] = a.v[i];
                break;
            case Opcode::Negate:
                for (int i = 0; i < KILN_VECTORS; ++i) dst.v[i] = -a.v[i];
                break;
            case Opcode::Empty:
                for (int i = 0; i < KILN_VECTORS; ++i) dst.v[i] = real(param(kEmpty));
                break;
            case Opcode::Take:
                for (int i = 0; i < KILN_VECTORS; ++i) dst.v[i] = aux == 1u ? -b.v[i] : b.v[i];
                break;
            case Opcode::Constant:
                for (int i = 0; i < KILN_VECTORS; ++i) dst.v[i] = real(param(0));
                break;
            default: step(r, word, w, samples); break;
        }
    }
}

#ifndef KILN_FEW
// slot 1: materials, slot 2: edits (words of a Shape's parameters).
[[maybe_unused]] static void run_materials(Registers& r, MixChunk* mix, const uint32_t* code, size_t count, const float* params, Samples samples,
                          int slot) {
    const real none = real(param(kNoMaterial));
    const real zero = real(param(0));
    for (size_t pc = 0; pc < count; ++pc) {
        const uint32_t word = code[2 * pc];
        const float* w = params + code[2 * pc + 1];
        const uint32_t d = (word >> 13) & 31u;
        Chunk& dst = r.value[d];
        const Chunk& a = r.value[(word >> 18) & 31u];
        const Chunk& b = r.value[(word >> 23) & 31u];
        const MixChunk& mix_a = mix[(word >> 18) & 31u];
        const MixChunk& mix_b = mix[(word >> 23) & 31u];
        const uint32_t aux = (word >> 5) & 255u;
        switch (Opcode(word & 31u)) {
            case Opcode::Combine:
                for (int i = 0; i < KILN_VECTORS; ++i) {
                    const uint32_t op = aux & 3u;
                    const bool paint = op == 3u;
                    const real t = paint ? share_min(zero, b.v[i], param(w[1])) : op_share(op, a.v[i], b.v[i], param(w[1]));
                    mix[d].v[i] = blend_mix(mix_a.v[i], mix_b.v[i], t);
                    dst.v[i] = paint ? a.v[i] : op_distance(op, a.v[i], b.v[i], param(w[0]));
                }
                break;
            case Opcode::Move:
                for (int i = 0; i < KILN_VECTORS; ++i) {
                    dst.v[i] = a.v[i];
                    mix[d].v[i] = mix_a.v[i];
                }
                break;
            case Opcode::Negate:
                for (int i = 0; i < KILN_VECTORS; ++i) {
                    dst.v[i] = -a.v[i];
                    mix[d].v[i] = mix_a.v[i];
                }
                break;
            case Opcode::Empty:
                for (int i = 0; i < KILN_VECTORS; ++i) {
                    dst.v[i] = real(param(kEmpty));
                    mix[d].v[i] = make_mix(none, none, zero);
                }
                break;
            case Opcode::Take:
                for (int i = 0; i < KILN_VECTORS; ++i) {
                    dst.v[i] = aux == 1u ? -b.v[i] : b.v[i];
                    mix[d].v[i] = select_mix(same(mix_b.v[i].id0, none), mix_a.v[i], mix_b.v[i]);
                }
                break;
            case Opcode::Constant:
                for (int i = 0; i < KILN_VECTORS; ++i) {
                    dst.v[i] = zero;
                    mix[d].v[i] = make_mix(real(param(w[slot])), none, zero);
                }
                break;
            case Opcode::Shape:
            case Opcode::Result:
            case Opcode::Custom:
                step(r, word, w, samples);
                for (int i = 0; i < KILN_VECTORS; ++i) mix[d].v[i] = make_mix(real(param(w[slot])), none, zero);
                break;
            default: step(r, word, w, samples); break;
        }
    }
}
#endif

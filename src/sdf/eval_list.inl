// SPDX-License-Identifier: MIT
// Lists of edits at many places at once, for one float instruction set: which of them can matter in each of 64 balls (fold_list), and
// what a whole brick's 512 texels are (evaluate_brick). Needs eval_lanes.inl and eval_entry.inl.
// A brick's tape is mostly [point] [shape] [combine] of one edit after another. Those of common shapes run over the whole brick in
// one loop, z innermost, so that what does not depend on z is hoisted; everything else runs slice by slice through the interpreter.
// Both give the bits of evaluate_points().

// Points where m holds, one bit each.
static inline uint64_t chunk_bits(const mask* m) {
    uint64_t out = 0;
    for (int i = 0; i < KILN_VECTORS; ++i) out |= uint64_t(lane_bits(m[i])) << (i * (kChunkPoints / KILN_VECTORS));
    return out;
}

// See sdf/eval.h.
void fold_list(const FoldEntry* entries, size_t count, const float* params, const float* samples, const Balls& balls, uint64_t* left,
               uint64_t* right, float* value, float* own, void* memory) {
    Registers r;
    r.memory = static_cast<Chunk*>(memory);
    load_chunk(r, balls.x, balls.y, balls.z, kChunkPoints);
    Chunk ball;  // what rounding is counted from: largest coordinate of the centre, and the radius
    for (int i = 0; i < KILN_VECTORS; ++i) {
        const real3 p = point_at(r.cell, i);
        ball.v[i] = max(abs(p.x), max(abs(p.y), abs(p.z))) + param(balls.radius);
        r.value[0].v[i] = real(param(kEmpty));
    }
    const mask never = lt(real(param(1)), real(param(0)));
    const bool has_far = balls.far < 1e30f;
    for (size_t at = 0; at < count; ++at) {
        const FoldEntry& e = entries[at];
        run_distance(r, e.code, e.code_count, params, Samples{samples});
        Chunk& running = r.value[0];
        const Chunk& other = r.value[1];
        if (own != nullptr) store_chunk(other, own + kChunkPoints * at, kChunkPoints);
        if (e.join != FoldEntry::Combine) {
            const bool negated = e.join == FoldEntry::Negate || (e.join == FoldEntry::Take && e.op == 1);
            for (int i = 0; i < KILN_VECTORS; ++i) running.v[i] = negated ? -other.v[i] : other.v[i];
            left[at] = 0;
            right[at] = ~uint64_t(0);
            continue;
        }
        const real slack = real(param(2.0f * balls.radius + e.reach));
        const real limit = real(param(e.far + balls.radius + e.reach));
        mask wins_left[KILN_VECTORS], wins_right[KILN_VECTORS];
        for (int i = 0; i < KILN_VECTORS; ++i) {
            const real a = running.v[i], b = other.v[i];
            const real rounding = param(kPruneUlps) * (ball.v[i] + abs(a) + abs(b));
            const real all = slack + rounding;
            const real operand = e.op == 1 ? -b : b;
            const real gap = e.op == 0 ? operand - a : a - operand;
            wins_left[i] = e.op == 3 ? gt(b, all) : gt(gap, all);
            wins_right[i] = e.op == 3 ? never : gt(-gap, all);
            if (!has_far) continue;
            const real beyond = limit + rounding;
            const real3 p = point_at(r.cell, i);
            mask away = either(gt(abs(p.x - param(e.middle[0])), real(param(balls.half_side + e.half[0]))),
                               gt(abs(p.y - param(e.middle[1])), real(param(balls.half_side + e.half[1]))));
            away = either(away, gt(abs(p.z - param(e.middle[2])), real(param(balls.half_side + e.half[2]))));
            if (e.op != 2) away = either(away, gt(b, beyond));
            if (e.op == 1 || e.op == 2) away = either(away, gt(a, beyond));  // nothing there to cut
            const mask alone = e.op == 0 ? gt(a, beyond) : never;
            wins_left[i] = either(wins_left[i], away);
            wins_right[i] = both(either(wins_right[i], alone), no(wins_left[i]));
        }
        left[at] = chunk_bits(wins_left);
        right[at] = chunk_bits(wins_right);
        combine(running, running, other, e.op, param(e.blend));
    }
    store_chunk(r.value[0], value, kChunkPoints);
}

static constexpr int kSliceVectors = KILN_VECTORS;  // of a slice of 8 x 8 texels
static constexpr int kBrickSlices = 8;
static constexpr int kBrickLanes = kChunkPoints / KILN_VECTORS;

struct BrickPoints {
    real x[kSliceVectors], y[kSliceVectors];
    param z[kBrickSlices];
    bool plain;  // see is_plain()
};
// Of a brick's 512 values.
static inline float* vector_at(float* values, int slice, int i) { return values + (slice * kSliceVectors + i) * kBrickLanes; }

#ifdef KILN_PRODUCTS
// Numbers of which no leaf makes any whose square is lost: sums and differences of 0 and of what is from 2^-21 to 2^40 in size are multiples of 2^-44.
static inline bool is_plain(float v) {
    const float size = abs(v);
    return size <= 0 || (size >= 0x1p-21f && size < 0x1p40f);
}
static inline mask is_plain(real v) {
    const real size = abs(v);
    return either(le(size, real(0.0f)), both(ge(size, real(0x1p-21f)), lt(size, real(0x1p40f))));
}
#endif

// A leaf whose shape is fused: its own copy of all numbers, so that no store to the brick's values might change one.
struct FusedLeaf {
    real x[kSliceVectors], y[kSliceVectors];  // of a slice, from the shape's middle
    param z, scale;
    float shape[3];

    FusedLeaf(uint32_t kind, const BrickPoints& points, const float* t, const float* w)
        : z(param(t[2])), scale(param(w[0])), shape{w[3], 0, 0} {
        if (kind == kFusedBox) shape[1] = w[4], shape[2] = w[5];
        for (int i = 0; i < kSliceVectors; ++i) {
            x[i] = points.x[i] - param(t[0]);
            y[i] = points.y[i] - param(t[1]);
        }
    }
    // At vector i of a slice. The root of every kProducts-th vector is found by products, beside the divider: where there is other work for
    // multipliers, they take fewer.
    template <uint32_t kShape, int kProducts>
    __attribute__((always_inline)) real distance(int i, real from_z) const {
#ifdef KILN_PRODUCTS
        if (i % kProducts == kProducts - 1) {
            const products::real3 p(x[i].v, y[i].v, from_z.v);
            return products::shape_distance(kShape, p, shape, products::Samples{nullptr}).v;
        }
#endif
        return shape_distance(kShape, real3(x[i], y[i], from_z), shape, Samples{nullptr});
    }
};

// How a leaf's value meets the running one. kProducts: see FusedLeaf::distance(). Where vectors are wide, the divider takes each in two turns
// and an estimate is good after one step: more is left to products, quotients too.
#if defined(KILN_PRODUCTS) && KILN_LANES == 16
static constexpr bool kWide = true;
#else
static constexpr bool kWide = false;
#endif
struct JoinSet {
    static constexpr int kProducts = kWide ? 2 : 4;
    KILN_SDF real join(real, real d, param) { return d; }
};
struct JoinNegated {
    static constexpr int kProducts = kWide ? 2 : 4;
    KILN_SDF real join(real, real d, param) { return -d; }
};
template <uint32_t kOp>
struct JoinHard {
    static constexpr int kProducts = kWide ? 2 : 4;
    KILN_SDF real join(real a, real d, param) { return hard_op<kOp>(a, d); }
};
template <uint32_t kOp>
struct JoinSmooth {
    static constexpr int kProducts = 4;
    KILN_SDF real join(real a, real d, param k) {
#ifdef KILN_PRODUCTS
        if (kWide) return products::op_distance(kOp, a.v, d.v, k).v;
#endif
        return op_distance(kOp, a, d, k);
    }
};

// kScaled: the shape's values are times something else than 1.
template <uint32_t kShape, typename Join, bool kScaled>
static __attribute__((noinline)) void brick_leaf(const BrickPoints& points, float* values, const float* t, const float* w, float k) {
    const FusedLeaf leaf(kShape, points, t, w);
    for (int slice = 0; slice < kBrickSlices; ++slice) {
        const real from_z = real(points.z[slice] - leaf.z);
        // Some distances, then as many joins: each waits for what is before it.
        constexpr int kSome = 4;
#pragma GCC unroll 16
        for (int first = 0; first < kSliceVectors; first += kSome) {
            real d[kSome];
            for (int i = 0; i < kSome; ++i)
                d[i] = leaf.distance<kShape, kShape == kFusedSphere ? Join::kProducts : 4>(first + i, from_z);
            for (int i = 0; i < kSome; ++i) {
                float* const at = vector_at(values, slice, first + i);
                store(at, Join::join(load(at), kScaled ? d[i] * leaf.scale : d[i], param(k)));
            }
        }
    }
}

using BrickLeaf = void (*)(const BrickPoints&, float*, const float*, const float*, float);

// By shape (those worth their machine code), then by join.
template <uint32_t kShape, bool kScaled>
static BrickLeaf leaf_of(int join) {
    switch (join) {
        case 0: return &brick_leaf<kShape, JoinHard<0>, kScaled>;
        case 1: return &brick_leaf<kShape, JoinHard<1>, kScaled>;
        case 2: return &brick_leaf<kShape, JoinSmooth<0>, kScaled>;
        case 3: return &brick_leaf<kShape, JoinSmooth<1>, kScaled>;
        case 4: return &brick_leaf<kShape, JoinSet, kScaled>;
        default: return &brick_leaf<kShape, JoinNegated, kScaled>;
    }
}

// What a fused leaf's points are moved by.
static inline const float* leaf_origin(const uint32_t* code, const float* params) {
    static const float kOrigin[3] = {0, 0, 0};
    return Opcode(code[0] & 31u) == Opcode::PointTranslate ? params + code[1] : kOrigin;
}

// Whether a leaf's numbers, k among them, are within the bounds of its fused text.
static inline bool may_fuse(const BrickPoints& points, const uint32_t* code, const float* t, const float* w, float k) {
#ifdef KILN_PRODUCTS
    bool plain = points.plain && is_plain(t[0]) && is_plain(t[1]) && is_plain(t[2]) && (k <= 0 || (k > 0x1p-60f && k < 0x1p60f));
    if (((code[2] >> 5) & 255u) == kFusedBox) plain = plain && is_plain(w[3]) && is_plain(w[4]) && is_plain(w[5]);
    return plain;
#else
    return true;
#endif
}

// The leaf of [point] [shape] [combine, move, negate or take] at `code`, when it is one of those that run over the whole brick.
static BrickLeaf fused_leaf(const BrickPoints& points, const uint32_t* code, size_t left, const float* params, const float*& t,
                            float& k) {
    if (left < 3) return nullptr;
    const Opcode join = Opcode(code[4] & 31u);
    if (!is_fused_leaf(code[0], code[2]) || ((code[2] >> 13) & 31u) != 1u) return nullptr;
    t = leaf_origin(code, params);
    const uint32_t dst = (code[4] >> 13) & 31u, a = (code[4] >> 18) & 31u, b = (code[4] >> 23) & 31u, aux = (code[4] >> 5) & 255u;
    int how = -1;
    k = 0;
    if (join == Opcode::Combine && dst == 0 && a == 0 && b == 1 && (aux & 3u) < 2u) {
        k = params[code[5]];
        how = int(aux & 3u) + (k > 0 ? 2 : 0);
    } else if (join == Opcode::Move && dst == 0 && a == 1) {
        how = 4;
    } else if (join == Opcode::Negate && dst == 0 && a == 1) {
        how = 5;
    } else if (join == Opcode::Take && dst == 0 && b == 1) {
        how = aux == 1u ? 5 : 4;
    }
    if (how < 0 || !may_fuse(points, code, t, params + code[3], k)) return nullptr;
    const bool scaled = params[code[3]] != 1;
    switch ((code[2] >> 5) & 255u) {
        case kFusedSphere: return scaled ? leaf_of<kFusedSphere, true>(how) : leaf_of<kFusedSphere, false>(how);
        case kFusedBox: return scaled ? leaf_of<kFusedBox, true>(how) : leaf_of<kFusedBox, false>(how);
        default: return nullptr;
    }
}

// The eight numbers of a row, again and again, from lane `first` of a slice on; and of each row its own number. A brick's rows have just been
// written, four numbers or one at a time: what asks for more at once waits until they have reached the cache.
#if defined(KILN_LANES) && KILN_LANES == 16
static inline real row_from(const float* row, int) {
    typedef float four __attribute__((vector_size(16)));
    four low, high;
    __builtin_memcpy(&low, row, sizeof low);
    __builtin_memcpy(&high, row + 4, sizeof high);
    const auto one = __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
    return lane_f(__builtin_shufflevector(one, one, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15));
}
static inline real rows_from(const float* each, int first) {
    typedef float eight __attribute__((vector_size(32)));
    const eight one = eight{} + each[first / 8], next = eight{} + each[first / 8 + 1];
    return lane_f(__builtin_shufflevector(one, next, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15));
}
#else
static inline real row_from(const float* row, int first) { return load(row + first % 8); }
static inline real rows_from(const float* each, int first) { return real(param(each[first / 8])); }
#endif

static void place_brick(BrickPoints& points, const float* x, const float* y, const float* z) {
    for (int i = 0; i < kSliceVectors; ++i) {
        points.x[i] = row_from(x, i * kBrickLanes);
        points.y[i] = rows_from(y, i * kBrickLanes);
    }
    for (int slice = 0; slice < kBrickSlices; ++slice) points.z[slice] = param(z[slice]);
#ifdef KILN_PRODUCTS
    points.plain = all_of(both(is_plain(points.x[0]), both(is_plain(row_from(y, 0)), is_plain(row_from(z, 0)))));
#else
    points.plain = true;
#endif
}
static void place_slice(Registers& r, const BrickPoints& points, int slice) {
    for (int i = 0; i < kSliceVectors; ++i) {
        r.cell[0].v[i] = points.x[i];
        r.cell[1].v[i] = points.y[i];
        r.cell[2].v[i] = real(points.z[slice]);
    }
}

// Texel (i, j, k) is at (x[i], y[j], z[k]); out[(k * 8 + j) * 8 + i]. Returns the smallest |value|.
float evaluate_brick(const uint32_t* code, size_t count, const float* params, const float* samples, const float* x, const float* y,
                     const float* z, float* out, void* memory) {
    BrickPoints points;
    place_brick(points, x, y, z);
    size_t pc = 0;
    if (count > 0 && Opcode(code[0] & 31u) == Opcode::Empty && ((code[0] >> 13) & 31u) == 0u) {
        pc = 1;
        for (int slice = 0; slice < kBrickSlices; ++slice) {
            for (int i = 0; i < kSliceVectors; ++i) store(vector_at(out, slice, i), real(param(kEmpty)));
        }
    }
    Registers r;
    r.memory = static_cast<Chunk*>(memory);
    while (pc < count) {
        const float* t;
        float k;
        if (const BrickLeaf leaf = fused_leaf(points, code + 2 * pc, count - pc, params, t, k)) {
            leaf(points, out, t, params + code[2 * pc + 3], k);
            pc += 3;
            continue;
        }
        // To the end of this edit: the next instruction that makes R0.
        size_t end = pc;
        while (end < count) {
            const uint32_t word = code[2 * end++];
            if (Opcode(word & 31u) > Opcode::PointClamp && ((word >> 13) & 31u) == 0u) break;
        }
        for (int slice = 0; slice < kBrickSlices; ++slice) {
            place_slice(r, points, slice);
            for (int i = 0; i < kSliceVectors; ++i) r.value[0].v[i] = load(vector_at(out, slice, i));
            run_distance(r, code + 2 * pc, end - pc, params, Samples{samples});
            for (int i = 0; i < kSliceVectors; ++i) store(vector_at(out, slice, i), r.value[0].v[i]);
        }
        pc = end;
    }
    // Four at a time: a minimum waits for the one before it.
    real nearest[4];
    for (real& one : nearest) one = abs(load(out));
    for (int slice = 0; slice < kBrickSlices; ++slice) {
        for (int i = 0; i < kSliceVectors; ++i) nearest[i & 3] = min(nearest[i & 3], abs(load(vector_at(out, slice, i))));
    }
    float lanes[kBrickLanes];
    store(lanes, min(min(nearest[0], nearest[1]), min(nearest[2], nearest[3])));
    float least = lanes[0];
    for (int i = 1; i < kBrickLanes; ++i) least = lanes[i] < least ? lanes[i] : least;
    return least;
}

// Of a brick's values.
float highest(const float* values) {
    real most[4];  // as in evaluate_brick()
    for (int i = 0; i < 4; ++i) most[i] = load(values + i * kBrickLanes);
    for (int at = 4 * kBrickLanes; at < kBrickSlices * kChunkPoints; at += 4 * kBrickLanes) {
        for (int i = 0; i < 4; ++i) most[i] = max(most[i], load(values + at + i * kBrickLanes));
    }
    float lanes[kBrickLanes];
    store(lanes, max(max(most[0], most[1]), max(most[2], most[3])));
    float out = lanes[0];
    for (int i = 1; i < kBrickLanes; ++i) out = lanes[i] > out ? lanes[i] : out;
    return out;
}

#ifdef KILN_LANES
static inline lane_u word_bits(real v) { return lane_u(v.v); }
static inline lane_u choose(mask m, lane_u a, lane_u b) { return m.v ? a : b; }
typedef uint16_t lane_h __attribute__((vector_size(2 * KILN_LANES)));
static inline void store_words(uint16_t* to, lane_u words) {
    const lane_h narrow = __builtin_convertvector(words, lane_h);
    __builtin_memcpy(to, &narrow, sizeof narrow);
}
static inline lane_u all_words(uint32_t w) { return lane_u{} + w; }
static inline lane_u load_words(const uint16_t* from) {
    lane_h narrow;
    __builtin_memcpy(&narrow, from, sizeof narrow);
    return __builtin_convertvector(narrow, lane_u);
}
#else
static inline uint32_t word_bits(real v) { return __builtin_bit_cast(uint32_t, v); }
static inline uint32_t choose(mask m, uint32_t a, uint32_t b) { return m ? a : b; }
static inline void store_words(uint16_t* to, uint32_t word) { *to = uint16_t(word); }
static inline uint32_t all_words(uint32_t w) { return w; }
static inline uint32_t load_words(const uint16_t* from) { return *from; }
#endif

// See store_halves() in sdf/eval.h. To nearest, ties to even: by the processor's own conversion where it has one, else integer arithmetic.
#ifdef KILN_HALVES
void store_halves(const float* values, size_t count, float scale, float limit, float least, uint16_t* codes, uint64_t* solid) {
    const real zero = real(param(0));
    for (size_t slice = 0; slice < count / 64; ++slice) {
        uint64_t bits = 0;  // kept apart from memory: each vector's are joined to those before
        for (size_t at = 0; at < 64; at += size_t(kBrickLanes)) {
            const size_t i = 64 * slice + at;
            const real v = load(values + i) * param(scale);
            bits |= uint64_t(lane_bits(le(v, zero))) << at;
            // NaN is the limit: of two operands the processor takes the second then, which is select()'s way too.
            const real size = abs(v), inner = select(lt(size, real(param(limit))), size, real(param(limit)));
            const real off = max(inner, real(param(least)));
            const lane_u sign = lane_u(lt(v, zero).v) & all_words(0x80000000u), some = ~lane_u(le(size, zero).v);
            store_half_words(codes + i, lane_f((lane_u(off.v) | sign) & some));
        }
        solid[slice] = bits;
    }
}
#else
void store_halves(const float* values, size_t count, float scale, float limit, float least, uint16_t* codes, uint64_t* solid) {
    const real zero = real(param(0));
    const auto rounded = [](real size) {
        const auto bits = word_bits(size) - 0x38000000u;  // exponent bias 127 -> 15
        return (bits + 0x0fffu + ((bits >> 13) & 1u)) >> 13;
    };
    const auto at_limit = rounded(real(param(limit))), at_least = rounded(real(param(least)));
    for (size_t slice = 0; slice < count / 64; ++slice) {
        uint64_t bits = 0;  // kept apart from memory: each vector's are joined to those before
        for (size_t at = 0; at < 64; at += size_t(kBrickLanes)) {
            const size_t i = 64 * slice + at;
            const real v = load(values + i) * param(scale);
            bits |= uint64_t(lane_bits(le(v, zero))) << at;
            const real size = abs(v);
            auto code = choose(lt(size, real(param(limit))), rounded(size), at_limit);  // NaN is not below it
            code = choose(lt(size, real(param(least))), at_least, code);
            code = choose(le(size, zero), all_words(0), code) | choose(lt(v, zero), all_words(0x8000u), all_words(0));
            store_words(codes + i, code);
        }
        solid[slice] = bits;
    }
}
#endif

// Values of store_halves()'s bits.
static inline real half_values(const uint16_t* codes) {
#ifdef KILN_HALVES
    return real(load_half_words(codes));
#else
    const auto code = load_words(codes), size = code & 0x7fffu;
    const real one = real_of_bits(whole(((size << 13) + 0x38000000u) | ((code & 0x8000u) << 16)));
    return select(le(real_of(whole(size)), real(param(0))), real(param(0)), one);
#endif
}

// Which of some texels are too near.
static inline mask too_near(const Away& from, real value, int texel) {
    const real stored = half_values(from.halves + texel) * param(from.sign);
    return both(no(gt(value * param(from.scale), stored + param(from.margin))), gt(stored, real(param(from.floor))));
}

template <uint32_t kShape>
static __attribute__((noinline)) bool leaf_keeps_away(const BrickPoints& points, const float* t, const float* w, const Away& from) {
    const FusedLeaf leaf(kShape, points, t, w);
    for (int slice = 0; slice < kBrickSlices; ++slice) {
        const real from_z = real(points.z[slice] - leaf.z);
        mask near = gt(real(param(0)), real(param(0)));
#pragma GCC unroll 16
        for (int i = 0; i < kSliceVectors; ++i)
            near = either(near, too_near(from, leaf.distance<kShape, 4>(i, from_z) * leaf.scale, slice * kChunkPoints + i * kBrickLanes));
        if (lane_bits(near) != 0) return false;
    }
    return true;
}

// See sdf/eval.h.
bool keeps_away(const uint32_t* code, size_t count, const float* params, const float* samples, const float* x, const float* y,
                const float* z, const Away& from, void* memory) {
    BrickPoints points;
    place_brick(points, x, y, z);
    if (count == 2 && is_fused_leaf(code[0], code[2]) && may_fuse(points, code, leaf_origin(code, params), params + code[3], 0)) {
        const auto leaf = ((code[2] >> 5) & 255u) == kFusedSphere ? &leaf_keeps_away<kFusedSphere> : &leaf_keeps_away<kFusedBox>;
        return leaf(points, leaf_origin(code, params), params + code[3], from);
    }
    Registers r;
    r.memory = static_cast<Chunk*>(memory);
    for (int slice = 0; slice < kBrickSlices; ++slice) {
        place_slice(r, points, slice);
        run_distance(r, code, count, params, Samples{samples});
        for (int i = 0; i < kSliceVectors; ++i) {
            if (lane_bits(too_near(from, r.value[1].v[i], slice * kChunkPoints + i * kBrickLanes)) != 0) return false;
        }
    }
    return true;
}

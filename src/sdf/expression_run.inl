// SPDX-License-Identifier: MIT
// Runs FormulaOps on a chunk of 64 points, and on the intervals of sixteen tiles. Registers are the caller's memory, 64-byte aligned.

static constexpr int kTileVectors = KILN_VECTORS / 4;

struct TileRange {
    Range v[kTileVectors];
};

// registers: 64 floats each, the first three filled in. out: 64 floats.
void run_formula_points(const FormulaOp* code, size_t count, void* registers, uint32_t result, float* out) {
    Chunk* r = static_cast<Chunk*>(registers);
    for (size_t i = 0; i < count; ++i) {
        const FormulaOp& op = code[i];
        if (Fn(op.fn) == Fn::Constant) {
            chunk_of(r[op.dst], real(op.number));
            continue;
        }
        Chunk number;
        const Chunk* a = &r[op.a];
        const Chunk* b = &r[op.b];
        if ((op.number_a | op.number_b) != 0) {
            chunk_of(number, real(op.number));
            (op.number_a != 0 ? a : b) = &number;
        }
        arithmetic(r[op.dst], *a, *b, Fn(op.fn));
    }
    for (int i = 0; i < KILN_VECTORS; ++i) store(out + i * (64 / KILN_VECTORS), r[result].v[i]);
}

// bounds: lo and hi of x, y, z in turn, 16 floats each. registers: 32 floats each. choices: two words a Min or Max, bits of the tiles
// where a, where b is the result. out: lo, hi, 16 floats each.
void run_formula_tiles(const FormulaOp* code, size_t count, const float* bounds, void* registers, uint32_t result, uint16_t* choices,
                       float* out) {
    constexpr int kLanes = 16 / kTileVectors;
    TileRange* r = static_cast<TileRange*>(registers);
    for (int axis = 0; axis < 3; ++axis) {
        for (int i = 0; i < kTileVectors; ++i)
            r[axis].v[i] = {load(bounds + 32 * axis + i * kLanes), load(bounds + 32 * axis + 16 + i * kLanes)};
    }
    for (size_t n = 0; n < count; ++n) {
        const FormulaOp& op = code[n];
        const Fn fn = Fn(op.fn);
        const Range number{real(op.number), real(op.number)};
        TileRange& dst = r[op.dst];
        if (fn == Fn::Constant) {
            for (int i = 0; i < kTileVectors; ++i) dst.v[i] = number;
            continue;
        }
        uint32_t wins_a = 0, wins_b = 0;
        for (int i = 0; i < kTileVectors; ++i) {
            const Range a = op.number_a != 0 ? number : r[op.a].v[i];
            const Range b = op.number_b != 0 ? number : r[op.b].v[i];
            if (op.is_choice != 0) {
                const Winner2 winner = winner_of(a, b, fn == Fn::Min);
                wins_a |= lane_bits(winner.a) << (i * kLanes);
                wins_b |= lane_bits(winner.b) << (i * kLanes);
            }
            dst.v[i] = range_of(a, b, fn);
        }
        if (op.is_choice != 0) {
            *choices++ = uint16_t(wins_a);
            *choices++ = uint16_t(wins_b);
        }
    }
    for (int i = 0; i < kTileVectors; ++i) {
        store(out + i * kLanes, r[result].v[i].lo);
        store(out + 16 + i * kLanes, r[result].v[i].hi);
    }
}

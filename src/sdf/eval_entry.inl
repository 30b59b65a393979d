// SPDX-License-Identifier: MIT
// Entry points of one float instruction set: splits the points into chunks of 64, the last one padded with its last point. Sixteen points
// or fewer, where the instruction set has vectors (KILN_FEW), are a chunk of their own kind.

static constexpr int kChunkPoints = 64;
static constexpr int kFewPoints = 16;

template <int kPoints, typename R>
static void load_points(R& r, const float* x, const float* y, const float* z, int count) {
    constexpr int kVectors = int(sizeof(r.cell[0].v) / sizeof(r.cell[0].v[0]));
    alignas(64) float padded[3][kPoints];
    const float* from[3] = {x, y, z};
    for (int axis = 0; axis < 3; ++axis) {
        const float* source = from[axis];
        if (count < kPoints) {
            for (int i = 0; i < kPoints; ++i) padded[axis][i] = from[axis][i < count ? i : count - 1];
            source = padded[axis];
        }
        for (int i = 0; i < kVectors; ++i) r.cell[axis].v[i] = load(source + i * (kPoints / kVectors));
    }
}
static void load_chunk(Registers& r, const float* x, const float* y, const float* z, int count) {
    load_points<kChunkPoints>(r, x, y, z, count);
}

template <int kPoints, typename C>
static void store_points(const C& from, float* to, int count) {
    constexpr int kVectors = int(sizeof(from.v) / sizeof(from.v[0]));
    alignas(64) float out[kPoints];
    for (int i = 0; i < kVectors; ++i) store(out + i * (kPoints / kVectors), from.v[i]);
    for (int i = 0; i < count; ++i) to[i] = out[i];
}
static void store_chunk(const Chunk& from, float* to, int count) { store_points<kChunkPoints>(from, to, count); }

void evaluate_points(const uint32_t* code, size_t count, const float* params, const float* samples, const float* x, const float* y,
                     const float* z, int points, float* out, void* memory) {
#ifdef KILN_FEW
    if (points <= kFewPoints) {
        if (points <= 0) return;
        few::Registers r;
        r.memory = static_cast<few::Chunk*>(memory);
        load_points<kFewPoints>(r, x, y, z, points);
        few::run_distance(r, code, count, params, Samples{samples});
        store_points<kFewPoints>(r.value[0], out, points);
        return;
    }
#endif
    Registers r;
    r.memory = static_cast<Chunk*>(memory);
    for (int at = 0; at < points; at += kChunkPoints) {
        const int n = points - at < kChunkPoints ? points - at : kChunkPoints;
        load_chunk(r, x + at, y + at, z + at, n);
        run_distance(r, code, count, params, Samples{samples});
        store_chunk(r.value[0], out + at, n);
    }
}

// ids: two floats a point.
void evaluate_mixes(const uint32_t* code, size_t count, const float* params, const float* samples, const float* x, const float* y,
                    const float* z, int points, float* out, float* id0, float* id1, float* share, int slot, void* memory) {
    Registers r;
    r.memory = static_cast<Chunk*>(memory);
    MixChunk mix[kRegisters];
    for (int at = 0; at < points; at += kChunkPoints) {
        const int n = points - at < kChunkPoints ? points - at : kChunkPoints;
        load_chunk(r, x + at, y + at, z + at, n);
        run_materials(r, mix, code, count, params, Samples{samples}, slot);
        store_chunk(r.value[0], out + at, n);
        Chunk c;
        for (int i = 0; i < KILN_VECTORS; ++i) c.v[i] = mix[0].v[i].id0;
        store_chunk(c, id0 + at, n);
        for (int i = 0; i < KILN_VECTORS; ++i) c.v[i] = mix[0].v[i].id1;
        store_chunk(c, id1 + at, n);
        for (int i = 0; i < KILN_VECTORS; ++i) c.v[i] = mix[0].v[i].share;
        store_chunk(c, share + at, n);
    }
}

// SPDX-License-Identifier: MIT
// Entry points of one float instruction set: splits the points into chunks of 64, the last one padded with its last point.

static constexpr int kChunkPoints = 64;

static void load_chunk(Registers& r, const float* x, const float* y, const float* z, int count) {
    alignas(64) float padded[3][kChunkPoints];
    const float* from[3] = {x, y, z};
    for (int axis = 0; axis < 3; ++axis) {
        const float* source = from[axis];
        if (count < kChunkPoints) {
            for (int i = 0; i < kChunkPoints; ++i) padded[axis][i] = from[axis][i < count ? i : count - 1];
            source = padded[axis];
        }
        for (int i = 0; i < KILN_VECTORS; ++i) r.cell[axis].v[i] = load(source + i * (kChunkPoints / KILN_VECTORS));
    }
}

static void store_chunk(const Chunk& from, float* to, int count) {
    alignas(64) float out[kChunkPoints];
    for (int i = 0; i < KILN_VECTORS; ++i) store(out + i * (kChunkPoints / KILN_VECTORS), from.v[i]);
    for (int i = 0; i < count; ++i) to[i] = out[i];
}

void evaluate_points(const uint32_t* code, size_t count, const float* params, const float* samples, const float* x, const float* y,
                     const float* z, int points, float* out, void* memory) {
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

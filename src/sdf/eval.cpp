// SPDX-License-Identifier: MIT
// Chooses the instruction set at run time, and runs the tape in double precision for single exact answers.

#include "sdf/eval.h"

#include "sdf/eval_isa.h"

#include <algorithm>
#include <cstdlib>
#include <string_view>
#include <vector>

namespace kiln::sdf {

namespace exact {
#define KILN_SCALAR double
#define KILN_VECTORS 1
#include "sdf/lang/scalar.h"
#include "sdf/lang/trig_exact.h"
#include "sdf/lang/material.sdf.h"

#include "sdf/texts.gen.inl"

#include "sdf/eval_lanes.inl"
}  // namespace exact

namespace {

const uint32_t* words(std::span<const Instruction> code) { return reinterpret_cast<const uint32_t*>(code.data()); }

bool processor_has(Isa isa) {
    switch (isa) {
    case Isa::Scalar:
        return true;
    case Isa::Sse4:
        return __builtin_cpu_supports("sse4.1") != 0;
    case Isa::Avx2:
        return __builtin_cpu_supports("avx2") != 0;
    case Isa::Avx512:
        return __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512bw") != 0 &&
               __builtin_cpu_supports("avx512dq") != 0 && __builtin_cpu_supports("avx512vl") != 0;
    }
    return false;
}

Isa choose() {
    const char* wanted = std::getenv("KILN_ISA");
    const std::string_view name = wanted != nullptr ? wanted : "";
    if (name == "scalar") return Isa::Scalar;
    if (name == "sse4" && processor_has(Isa::Sse4)) return Isa::Sse4;
    if (name == "avx2" && processor_has(Isa::Avx2)) return Isa::Avx2;
    for (Isa isa : {Isa::Avx512, Isa::Avx2, Isa::Sse4}) {
        if (processor_has(isa)) return isa;
    }
    return Isa::Scalar;
}

// A thread's memory for formulas, aligned for every lane type. Null for tapes without any.
void* memory_of(uint32_t slots, size_t slot_bytes) {
    if (slots == 0) return nullptr;
    static thread_local std::vector<std::byte> bytes;
    constexpr size_t kAlign = 64;
    if (bytes.size() < slots * slot_bytes + kAlign) bytes.resize(slots * slot_bytes + kAlign);
    const auto at = reinterpret_cast<uintptr_t>(bytes.data());
    return bytes.data() + (kAlign - at % kAlign) % kAlign;
}
constexpr size_t kChunkBytes = 64 * sizeof(float);

}  // namespace

bool has_isa(Isa isa) { return processor_has(isa); }

Isa best_isa() {
    static const Isa chosen = choose();
    return chosen;
}

#define KILN_CHOOSE(isa, name)          \
    (isa == Isa::Avx512 ? &avx512::name \
     : isa == Isa::Avx2 ? &avx2::name   \
     : isa == Isa::Sse4 ? &sse4::name   \
                        : &scalar::name)

void evaluate(const TapeView& tape, const Points& points, float* out, Isa isa) {
    const auto run = KILN_CHOOSE(isa, evaluate_points);
    run(words(tape.code), tape.code.size(), tape.params, tape.samples, points.x, points.y, points.z, points.count, out,
        memory_of(tape.memory_slots, kChunkBytes));
}

void evaluate_materials(const TapeView& tape, const Points& points, float* out, MaterialMix* mix, bool edits, Isa isa) {
    const auto run = KILN_CHOOSE(isa, evaluate_mixes);
    constexpr int kBatch = 512;
    float id0[kBatch], id1[kBatch], share[kBatch];
    void* const memory = memory_of(tape.memory_slots, kChunkBytes);
    for (int at = 0; at < points.count; at += kBatch) {
        const int n = std::min(kBatch, points.count - at);
        run(words(tape.code), tape.code.size(), tape.params, tape.samples, points.x + at, points.y + at, points.z + at,
            n, out + at, id0, id1, share, edits ? 2 : 1, memory);
        for (int i = 0; i < n; ++i) mix[at + i] = {uint16_t(id0[i]), uint16_t(id1[i]), share[i]};
    }
}

double evaluate(const TapeView& tape, dvec3 p_world, MaterialMix* mix, bool edits) {
    exact::Registers r;
    r.memory = static_cast<exact::Chunk*>(memory_of(tape.memory_slots, sizeof(exact::Chunk)));
    r.cell[0].v[0] = p_world.x;
    r.cell[1].v[0] = p_world.y;
    r.cell[2].v[0] = p_world.z;
    const exact::Samples samples{tape.samples};
    if (mix == nullptr) {
        exact::run_distance(r, words(tape.code), tape.code.size(), tape.params, samples);
    } else {
        exact::MixChunk chunks[kRegisters];
        exact::run_materials(r, chunks, words(tape.code), tape.code.size(), tape.params, samples, edits ? 2 : 1);
        const exact::Mix& m = chunks[0].v[0];
        *mix = {uint16_t(m.id0), uint16_t(m.id1), float(m.share)};
    }
    return r.value[0].v[0];
}

void fold_list(std::span<const FoldEntry> entries, const TapeView& numbers, const Balls& balls, uint64_t* left,
               uint64_t* right, float* value, Isa isa) {
    KILN_CHOOSE(isa, fold_list)
    (entries.data(), entries.size(), numbers.params, numbers.samples, balls, left, right, value,
     memory_of(numbers.memory_slots, kChunkBytes));
}

float evaluate_brick(const TapeView& tape, const float* x, const float* y, const float* z, float* out, Isa isa) {
    return KILN_CHOOSE(isa, evaluate_brick)(words(tape.code), tape.code.size(), tape.params, tape.samples, x, y, z, out,
                                            memory_of(tape.memory_slots, kChunkBytes));
}

bool keeps_away(const TapeView& tape, const float* x, const float* y, const float* z, const Away& from, Isa isa) {
    return KILN_CHOOSE(isa, keeps_away)(words(tape.code), tape.code.size(), tape.params, tape.samples, x, y, z, from,
                                        memory_of(tape.memory_slots, kChunkBytes));
}

void store_halves(std::span<const float> values, float scale, float limit, float least, uint16_t* codes,
                  uint64_t* solid, Isa isa) {
    KILN_CHOOSE(isa, store_halves)(values.data(), values.size(), scale, limit, least, codes, solid);
}

double zero_bound(const TapeView& tape, dvec3 p_world) {
    exact::Registers r;
    r.cell[0].v[0] = p_world.x;
    r.cell[1].v[0] = p_world.y;
    r.cell[2].v[0] = p_world.z;
    const exact::Samples samples{tape.samples};
    double least[kRegisters] = {};
    for (const Instruction& in : tape.code) {
        exact::run_distance(r, &in.word, 1, tape.params, samples);
        if (in.moves_point()) continue;
        const auto value = [&](uint32_t reg) { return std::abs(double(r.value[reg].v[0])); };
        double& out = least[in.dst()];
        switch (in.opcode()) {
        case Opcode::Combine:
            if ((in.aux() & 3u) == uint32_t(Op::Paint)) {
                out = least[in.a()];
            } else if (tape.params[in.param] > 0) {
                out = value(in.dst());  // smooth: zeros of its own
            } else {
                out = std::max(value(in.dst()), std::min(least[in.a()], least[in.b()]));
            }
            break;
        case Opcode::Move:
        case Opcode::Negate:
            out = least[in.a()];
            break;
        case Opcode::Take:
            out = least[in.b()];
            break;
        default:
            out = value(in.dst());
            break;
        }
    }
    return least[0];
}

}  // namespace kiln::sdf

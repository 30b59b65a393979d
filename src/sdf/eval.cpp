// SPDX-License-Identifier: MIT
// Chooses the instruction set at run time, and runs the tape in double precision for single exact answers.

#include "sdf/eval.h"

#include "sdf/eval_isa.h"

#include <cpuid.h>

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

// Halves to floats and back; clang 14 does not know this one's name.
bool has_f16c() {
    unsigned a, b, c, d;
    return __get_cpuid(1, &a, &b, &c, &d) != 0 && (c & bit_F16C) != 0;
}

bool processor_has(Isa isa) {
    switch (isa) {
    case Isa::Scalar:
        return true;
    case Isa::Sse4:
        return __builtin_cpu_supports("sse4.1") != 0;
    case Isa::Avx2:
        return __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0 && has_f16c();
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
               uint64_t* right, float* value, float* own, Isa isa) {
    KILN_CHOOSE(isa, fold_list)
    (entries.data(), entries.size(), numbers.params, numbers.samples, balls, left, right, value, own,
     memory_of(numbers.memory_slots, kChunkBytes));
}

float evaluate_brick(const TapeView& tape, const float* x, const float* y, const float* z, float* out, Isa isa) {
    return KILN_CHOOSE(isa, evaluate_brick)(words(tape.code), tape.code.size(), tape.params, tape.samples, x, y, z, out,
                                            memory_of(tape.memory_slots, kChunkBytes));
}

float highest(std::span<const float> values, Isa isa) { return KILN_CHOOSE(isa, highest)(values.data()); }

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

namespace {

constexpr uint32_t kNoEdit = UINT32_MAX;

double size_of(exact::real3 v) { return std::sqrt(exact::dot(v, v)); }
double largest(exact::real3 v) { return std::max({std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)}); }

// M of affine() times v: how P changes where C (or P before) changes by v.
exact::real3 turned(exact::real3 v, const float* w) {
    return {double(w[3]) * v.x + double(w[4]) * v.y + double(w[5]) * v.z,
            double(w[6]) * v.x + double(w[7]) * v.y + double(w[8]) * v.z,
            double(w[9]) * v.x + double(w[10]) * v.y + double(w[11]) * v.z};
}

// The world's operation on the edit in R1 (program.h): there its value is whole.
bool ends_edit(const Instruction& in) {
    if (in.dst() != 0) return false;
    switch (in.opcode()) {
    case Opcode::Combine:
    case Opcode::Take:
        return in.b() == 1;
    case Opcode::Move:
    case Opcode::Negate:
        return in.a() == 1;
    default:
        return false;
    }
}

// Metres between the box and the one around a segment; 0 where they meet.
double gap_of(const Box3& box, exact::real3 middle, exact::real3 half) {
    if (box.empty()) return 0;
    const auto axis = [](float low, float high, double center, double reach) {
        return std::max({double(low) - (center + std::fabs(reach)), center - std::fabs(reach) - double(high), 0.0});
    };
    return size_of({axis(box.min.x, box.max.x, middle.x, half.x), axis(box.min.y, box.max.y, middle.y, half.y),
                    axis(box.min.z, box.max.z, middle.z, half.z)});
}

}  // namespace

double least_on_segment(const Program& program, std::span<const Instruction> code, dvec3 middle, dvec3 half) {
    const exact::real3 center(middle.x, middle.y, middle.z), reach(half.x, half.y, half.z);
    // Floats make slopes steeper by some of their ulps, doubles values wrong by some of theirs.
    const double rounding = 2e-15 * (largest(center) + largest(reach));
    const double way = size_of(reach) * (1 + 1e-6) + rounding;
    exact::Registers r, low, high;  // at the middle; and the least and most on the segment
    r.memory = static_cast<exact::Chunk*>(memory_of(program.memory_slots, sizeof(exact::Chunk)));
    exact::set_point(r.cell, 0, center);
    exact::real3 change = reach;  // of P from the middle to the end
    bool straight = true;         // P is an affine function of the way
    uint32_t edit = kNoEdit;      // whose code this is
    const exact::Samples samples{program.samples.data()};
    const float* params = program.params.data();
    for (const Instruction& in : code) {
        const float* w = params + in.param;
        exact::run_distance(r, &in.word, 1, params, samples);
        if (in.has_material()) edit = uint32_t(w[2]);
        if (edit != kNoEdit && ends_edit(in)) {
            const EditSpan& span = program.edits[edit];
            const double gap = gap_of(span.bounds, center, reach) - rounding;
            if (gap > 0) low.value[1].v[0] = std::max(low.value[1].v[0], double(span.rate) * gap);
        }
        const uint32_t dst = in.dst(), a = in.a(), b = in.b();
        double &least = low.value[dst].v[0], &most = high.value[dst].v[0];
        const double value = r.value[dst].v[0];
        const auto within = [&](double spread) { least = value - spread, most = value + spread; };
        switch (in.opcode()) {
        case Opcode::PointCell:
        case Opcode::PointTranslate:
            change = reach;
            straight = true;
            break;
        case Opcode::PointAffine:
            change = turned(reach, w);
            straight = true;
            break;
        case Opcode::PointAffineOn:
            change = turned(change, w);
            break;
        case Opcode::PointWarp:
        case Opcode::PointCopy:
        case Opcode::PointClamp:
            straight = false;
            break;
        case Opcode::Arithmetic:  // a number, no distance
            break;
        case Opcode::Shape:
            within(straight && in.aux() == uint32_t(ShapeKind::Plane) ? std::fabs(change.y * double(w[0])) + rounding
                                                                      : way);
            break;
        case Opcode::Combine: {
            const bool takes_away = (in.aux() & 3u) == uint32_t(Op::Subtract);
            exact::Chunk lower, upper;
            exact::combine(lower, low.value[a], takes_away ? high.value[b] : low.value[b], in.aux() & 3u, double(w[0]));
            exact::combine(upper, high.value[a], takes_away ? low.value[b] : high.value[b], in.aux() & 3u,
                           double(w[0]));
            least = std::max(lower.v[0], value - way);
            most = std::min(upper.v[0], value + way);
            break;
        }
        case Opcode::Move:
            least = low.value[a].v[0], most = high.value[a].v[0];
            break;
        case Opcode::Negate: {
            const double below = -high.value[a].v[0];
            most = -low.value[a].v[0], least = below;
            break;
        }
        case Opcode::Take: {
            const bool negative = in.aux() == 1u;
            const double lower = negative ? -high.value[b].v[0] : low.value[b].v[0];
            most = negative ? -low.value[b].v[0] : high.value[b].v[0], least = lower;
            break;
        }
        case Opcode::Empty:
        case Opcode::Constant:
            within(0);
            break;
        default:
            within(way);
            break;
        }
    }
    return low.value[0].v[0];
}

}  // namespace kiln::sdf

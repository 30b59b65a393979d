// SPDX-License-Identifier: MIT
// Evaluates a tape at many points at once. The same text runs for every instruction set and gives the same bytes on each;
// Isa::Double runs it in double precision for queries and comparisons.
#pragma once

#include "sdf/program.h"

#include <span>

namespace kiln::sdf {

enum class Isa : uint8_t { Scalar, Sse4, Avx2, Avx512 };

/// The widest one this processor has (or what KILN_ISA=scalar|sse4|avx2|avx512 asks for, when the processor has it).
Isa best_isa();
bool has_isa(Isa isa);

/// Up to two materials at a point; weight is the second's share, in [0, 0.5]. id1 is kNoMaterial when weight is 0.
struct MaterialMix {
    uint16_t id0 = uint16_t(kNoMaterial), id1 = uint16_t(kNoMaterial);
    float weight = 0;
};

/// Points as three arrays of equal length.
struct Points {
    const float* x;
    const float* y;
    const float* z;
    int count;
};

/// A tape to run: the whole program's code, or a pruned piece of it (prune.h), with the program's numbers.
struct TapeView {
    std::span<const Instruction> code;
    const float* params;
    const float* samples;
};
inline TapeView view(const Program& program) { return {program.code, program.params.data(), program.samples.data()}; }
inline TapeView view(const Program& program, std::span<const Instruction> code) {
    return {code, program.params.data(), program.samples.data()};
}

/// out[i] = value of the tape at point i, metres. Any thread; any count.
void evaluate(const TapeView& tape, const Points& points, float* out, Isa isa = best_isa());
/// Also the two heaviest materials. With `edits`, numbers of edits instead of materials (every operand counts).
void evaluate_materials(const TapeView& tape, const Points& points, float* out, MaterialMix* mix, bool edits = false,
                        Isa isa = best_isa());
/// One point in double precision; the materials (or edits) too when `mix` is given.
double evaluate(const TapeView& tape, dvec3 p_world, MaterialMix* mix = nullptr, bool edits = false);

}  // namespace kiln::sdf

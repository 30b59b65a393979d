// SPDX-License-Identifier: MIT
// Evaluates a tape at many points at once. The same text runs for every instruction set and gives the same bytes on each;
// Isa::Double runs it in double precision for queries and comparisons.
#pragma once

#include "sdf/program.h"

#include <limits>
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
    uint32_t memory_slots = 0;  ///< Program::memory_slots
};
inline TapeView view(const Program& program) {
    return {program.tape(), program.params.data(), program.samples.data(), program.memory_slots};
}
inline TapeView view(const Program& program, std::span<const Instruction> code) {
    return {code, program.params.data(), program.samples.data(), program.memory_slots};
}

/// out[i] = value of the tape at point i, metres. Any thread; any count.
void evaluate(const TapeView& tape, const Points& points, float* out, Isa isa = best_isa());
/// Also the two heaviest materials. With `edits`, numbers of edits instead of materials (every operand counts).
void evaluate_materials(const TapeView& tape, const Points& points, float* out, MaterialMix* mix, bool edits = false,
                        Isa isa = best_isa());
/// One point in double precision; the materials (or edits) too when `mix` is given.
double evaluate(const TapeView& tape, dvec3 p_world, MaterialMix* mix = nullptr, bool edits = false);
/// How near a zero of the tape can be to p at least, metres: a zero of hard operations is a zero of one of their operands, and each
/// operand changes by no more than one moves.
double zero_bound(const TapeView& tape, dvec3 p_world);
/// A lower bound of the values on the segment from middle - half to middle + half, metres. `code` is the program's or a pruned piece of it.
/// A half-space's change on the way is known, another leaf's is at most the way, and an edit outside of whose box the segment stays is as
/// far as that box says; operations are monotone in each operand, so intervals pass through them (segment tracing: Galin, Guerin, Paris and
/// Peytavie, "Segment Tracing Using Local Lipschitz Bounds", 2020; ours asks for no other bound of a slope than that of a plane).
double least_on_segment(const Program& program, std::span<const Instruction> code, dvec3 middle, dvec3 half);

/// Float evaluation is off by a few ulps of the coordinates and values involved; 2^-18 of their size covers 64 of them.
inline constexpr float kPruneUlps = 3.8e-6f;

/// One edit of a list to fold: its code without the world Combine, result in R1.
struct FoldEntry {
    enum Join : uint8_t { Combine, Take, Move, Negate };
    const uint32_t* code;
    uint32_t code_count;
    float blend, reach;  ///< of its Combine, metres
    float far;           ///< Balls::far, and what later entries can lead down to it: see EditIndex::blend_allowance
    uint8_t op;
    Join join;                 ///< Combine, or what pruning for a larger ball has made of it (program.h)
    float middle[3], half[3];  ///< box outside of which its value is above far + reach; half may be infinite
};

/// Centres of up to 64 balls of one radius; those without a bit in `live` are computed but mean nothing.
struct Balls {
    alignas(64) float x[64], y[64], z[64];
    float radius = 0;                                    ///< metres
    float half_side = 0;                                 ///< of the cube that matters in each ball, metres
    float far = std::numeric_limits<float>::infinity();  ///< values beyond +-far need only stay beyond it, metres
    uint64_t live = 0;

    vec3 center(int i) const { return {x[i], y[i], z[i]}; }
};

/// Folds the list at the centres of 64 balls: value[i] is the world's there. Bit i of left[e] (right[e]) says that at edit e everything
/// before it (the edit alone) decides throughout ball i: as sdf::prune finds, or because the other is beyond `far`. `own`: null, or takes
/// each edit's own value at the centres, 64 an edit.
void fold_list(std::span<const FoldEntry> entries, const TapeView& numbers, const Balls& balls, uint64_t* left,
               uint64_t* right, float* value, float* own = nullptr, Isa isa = best_isa());

/// evaluate() at the 512 points (x[i], y[j], z[k]), i fastest; the smallest |value| of them. Code that begins with joining an edit joins it
/// to what `out` holds.
float evaluate_brick(const TapeView& tape, const float* x, const float* y, const float* z, float* out,
                     Isa isa = best_isa());

/// The greatest of 512 values.
float highest(std::span<const float> values, Isa isa = best_isa());

/// What an edit's values are compared with, texel by texel: see keeps_away().
struct Away {
    const uint16_t* halves;  ///< the texels of a brick, as store_halves() writes them
    float scale;             ///< values are times this
    float sign;              ///< 1 or -1: stored ones likewise
    float margin;            ///< how far above a stored one a value must be
    float floor;             ///< stored ones up to here ask for nothing
};
/// Whether at each of the 512 points of evaluate_brick() the value that `tape` leaves in R1, an edit's without its Combine, is above the
/// stored one by more than the margin.
bool keeps_away(const TapeView& tape, const float* x, const float* y, const float* z, const Away& from,
                Isa isa = best_isa());

/// Half-float bits of values * scale: clamped to +-limit, which NaN becomes too, and never below `least` unless exactly 0 (which loses its
/// sign). Bit i of `solid`: value i is 0 or less. `count` is a multiple of 64; limit and least are normal halves.
void store_halves(std::span<const float> values, float scale, float limit, float least, uint16_t* codes,
                  uint64_t* solid, Isa isa = best_isa());

}  // namespace kiln::sdf

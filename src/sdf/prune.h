// SPDX-License-Identifier: MIT
// Pruning: which instructions of a tape can matter inside a ball. The pruned tape has the full tape's bits at every point of the
// ball: an operand is dropped only where the other one wins by more than both can change plus the blend radius
// (Barbier et al., "Lipschitz Pruning: Hierarchical Simplification of Primitive-Based SDFs", 2025; ours is on registers, and
// drops the whole prefix of a world list where a later edit wins).
#pragma once

#include "sdf/eval.h"

#include <vector>

namespace kiln::sdf {

/// Reused between calls; holds no state that a caller may rely on.
struct PruneScratch {
    std::vector<float> left, right;
    std::vector<Instruction> reversed;
    std::vector<uint8_t> operand;  ///< of Min and Max in formulas: 1 or 2 where a or b is the result all over the ball
    std::vector<float> memory;     ///< of formulas, at the centre
    std::vector<float> ranges;     ///< and over the ball, two numbers a slot
    std::vector<uint8_t> slot_needed;
};

/// Prunes `tape` for the ball of `radius` around `center` (world metres). Writes the kept code to `out` (cleared first) and
/// returns the tape's value at the centre. Any thread, one scratch each.
float prune(const TapeView& tape, vec3 center, float radius, std::vector<Instruction>& out, PruneScratch& scratch);

/// The same for one edit of a world list: its code without the world Combine, which makes R1. `whole`: its value is needed; else only what
/// it is made of. Appends to `out`.
void prune_edit(const TapeView& edit, vec3 center, float radius, bool whole, std::vector<Instruction>& out,
                PruneScratch& scratch);

}  // namespace kiln::sdf

// SPDX-License-Identifier: MIT
// Pruning walks the tape twice: forwards, evaluating at the centre and noting both operands of every Combine; backwards, keeping
// what the result still needs. A register needed only for its material (architecture §5: a cut face shows what was there) is
// followed as far as the winners are certain, so that a long history shrinks to one Constant.

#include "sdf/prune.h"

#include "sdf/eval_isa.h"

#include <algorithm>
#include <cmath>

namespace kiln::sdf {

namespace centre {
#define KILN_SCALAR float
#define KILN_VECTORS 1
#include "sdf/lang/scalar.h"
#define KILN_T real
#include "sdf/lang/trig.sdf.h"
#undef KILN_T
#include "sdf/lang/material.sdf.h"

#include "sdf/texts.gen.inl"

#include "sdf/eval_lanes.inl"
}  // namespace centre

namespace {

enum Need : uint8_t { None, Material, Value };

// Which operands of a Combine can matter in the ball.
enum class Winner : uint8_t { Both, Left, Right };

struct Ball {
    float radius;
    float center_size;  // largest coordinate of the centre, for rounding error
};

float rounding(const Ball& ball, float left, float right) {
    return kPruneUlps * (ball.center_size + ball.radius + std::fabs(left) + std::fabs(right));
}

Winner decide(uint32_t op, float left, float right, float reach, const Ball& ball) {
    const float slack = 2.0f * ball.radius + reach + rounding(ball, left, right);
    if (op == uint32_t(Op::Paint)) {
        // Painted where right < 0, softly within reach; distance is left's either way, so "Right" never wins whole.
        return right > slack ? Winner::Left : Winner::Both;
    }
    const float other = op == uint32_t(Op::Subtract) ? -right : right;
    const float gap = op == uint32_t(Op::Union) ? other - left : left - other;  // > 0: left wins
    if (gap > slack) return Winner::Left;
    if (-gap > slack) return Winner::Right;
    return Winner::Both;
}

// Appends what is kept; returns the value of `root`.
float prune_register(const TapeView& tape, vec3 center, float radius, uint32_t root, Need root_need,
                     std::vector<Instruction>& out, PruneScratch& scratch) {
    const size_t n = tape.code.size();
    scratch.left.resize(n);
    scratch.right.resize(n);
    centre::Registers r;
    r.cell[0].v[0] = center.x;
    r.cell[1].v[0] = center.y;
    r.cell[2].v[0] = center.z;
    const centre::Samples samples{tape.samples};
    for (size_t pc = 0; pc < n; ++pc) {
        const Instruction& in = tape.code[pc];
        if (in.opcode() == Opcode::Combine) {
            scratch.left[pc] = r.value[in.a()].v[0];
            scratch.right[pc] = r.value[in.b()].v[0];
        }
        centre::run_distance(r, &in.word, 1, tape.params, samples);
    }
    const float value = r.value[root].v[0];

    const Ball ball{radius, std::max({std::fabs(center.x), std::fabs(center.y), std::fabs(center.z)})};
    Need need[kRegisters] = {};
    need[root] = root_need;
    bool need_point = false;
    std::vector<Instruction>& kept = scratch.reversed;
    kept.clear();
    const auto raise = [&](uint32_t reg, Need to) { need[reg] = std::max(need[reg], to); };
    for (size_t pc = n; pc-- > 0;) {
        const Instruction in = tape.code[pc];
        const Opcode op = in.opcode();
        if (in.moves_point()) {
            if (!need_point) continue;
            kept.push_back(in);
            if (in.starts_chain()) need_point = false;
            continue;
        }
        const uint32_t dst = in.dst();
        const Need wanted = need[dst];
        if (wanted == Need::None) continue;
        switch (op) {
        case Opcode::Shape:
            need[dst] = Need::None;
            if (wanted == Need::Material) {
                kept.push_back(Instruction::make(Opcode::Constant, 0, dst, 0, 0, in.param));
            } else {
                kept.push_back(in);
                need_point = true;
            }
            break;
        case Opcode::Value:
        case Opcode::Bound:
            if (wanted == Need::Value) {
                kept.push_back(in);
                need_point = true;
            }
            break;
        case Opcode::Empty:
        case Opcode::Constant:
            need[dst] = Need::None;
            kept.push_back(in);
            break;
        case Opcode::Move:
        case Opcode::Negate:
            need[dst] = Need::None;
            raise(in.a(), wanted);
            if (op == Opcode::Negate || in.a() != dst) kept.push_back(in);
            break;
        case Opcode::Take:
            need[dst] = Need::None;
            raise(in.a(), Need::Material);
            raise(in.b(), wanted);
            kept.push_back(in);
            break;
        case Opcode::Combine: {
            const uint32_t kind = in.aux() & 3u;
            const float* w = tape.params + in.param;
            const bool right_may_lack = (in.aux() & kMayLackMaterial) != 0;
            const Winner winner = decide(kind, scratch.left[pc], scratch.right[pc], std::max(w[0], w[1]), ball);
            need[dst] = Need::None;
            if (winner == Winner::Left) {
                raise(in.a(), wanted);
                if (in.a() != dst) kept.push_back(Instruction::make(Opcode::Move, 0, dst, in.a(), 0, 0));
            } else if (winner == Winner::Right) {
                const bool negate = kind == uint32_t(Op::Subtract);
                raise(in.b(), wanted);
                if (right_may_lack) {
                    raise(in.a(), Need::Material);
                    kept.push_back(Instruction::make(Opcode::Take, negate ? 1u : 0u, dst, in.a(), in.b(), 0));
                } else if (negate) {
                    kept.push_back(Instruction::make(Opcode::Negate, 0, dst, in.b(), 0, 0));
                } else if (in.b() != dst) {
                    kept.push_back(Instruction::make(Opcode::Move, 0, dst, in.b(), 0, 0));
                }
            } else {
                raise(in.a(), Need::Value);
                raise(in.b(), Need::Value);
                kept.push_back(in);
            }
            break;
        }
        default:
            break;
        }
    }
    out.insert(out.end(), kept.rbegin(), kept.rend());
    return value;
}

}  // namespace

float prune(const TapeView& tape, vec3 center, float radius, std::vector<Instruction>& out, PruneScratch& scratch) {
    out.clear();
    return prune_register(tape, center, radius, 0, Need::Value, out, scratch);
}

void prune_edit(const TapeView& edit, vec3 center, float radius, bool whole, std::vector<Instruction>& out,
                PruneScratch& scratch) {
    prune_register(edit, center, radius, 1, whole ? Need::Value : Need::Material, out, scratch);
}

}  // namespace kiln::sdf

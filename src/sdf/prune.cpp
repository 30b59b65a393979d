// SPDX-License-Identifier: MIT
// Pruning walks the tape twice: forwards, evaluating at the centre and noting both operands of every Combine; backwards, keeping
// what the result still needs. A register needed only for its material (architecture §5: a cut face shows what was there) is
// followed as far as the winners are certain, so that a long history shrinks to one Constant.
// Inside formulas nothing is known of slopes: there the forward walk also carries intervals over the ball, and a min or max whose
// operands' intervals lie apart keeps one of them (Duff, "Interval Arithmetic and Recursive Subdivision for Implicit Functions and
// Constructive Solid Geometry", 1992).

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
#include "sdf/lang/explog.sdf.h"
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

// What the numbers of formulas can be inside the ball.
class FormulaRanges {
public:
    FormulaRanges(vec3 center, float radius, PruneScratch& scratch) : radius_(radius), memory_(scratch.ranges) {
        center_size_ = std::max({std::fabs(center.x), std::fabs(center.y), std::fabs(center.z)});
    }

    // After the point itself has moved at the centre.
    void move_point(const Instruction& in, const float* params, const centre::Registers& r) {
        const float* w = params + in.param;
        switch (in.opcode()) {
        case Opcode::PointCell:
        case Opcode::PointTranslate:
        case Opcode::PointAffine:
            // A ball becomes an ellipsoid: as wide along an axis as the matrix's row is long.
            for (size_t i = 0; i < 3; ++i) {
                const bool affine = in.opcode() == Opcode::PointAffine;
                const float* row = w + 3 + 3 * i;
                const float length = affine ? std::sqrt(row[0] * row[0] + row[1] * row[1] + row[2] * row[2]) : 1.0f;
                const float offset = in.opcode() == Opcode::PointCell
                                         ? 0.0f
                                         : std::max({std::fabs(w[0]), std::fabs(w[1]), std::fabs(w[2])});
                const float half = length * (radius_ * 1.00001f + 2e-6f * (center_size_ + radius_ + offset));
                const float at = r.point[i].v[0];
                point_[i] = {at - half, at + half};
            }
            break;
        case Opcode::PointAffineOn: {
            centre::Range moved[3];
            for (size_t i = 0; i < 3; ++i) moved[i] = centre::range_of(point_[i], {w[i], w[i]}, Fn::Sub);
            for (size_t i = 0; i < 3; ++i) {
                centre::Range sum{0, 0};
                for (size_t j = 0; j < 3; ++j) {
                    const float m = w[3 + 3 * i + j];
                    sum = centre::range_of(sum, centre::range_of(moved[j], {m, m}, Fn::Mul), Fn::Add);
                }
                point_[i] = sum;
            }
            break;
        }
        case Opcode::PointClamp:
            for (size_t i = 0; i < 3; ++i) {
                point_[i].lo = std::clamp(point_[i].lo, w[i], w[i + 3]);
                point_[i].hi = std::clamp(point_[i].hi, w[i], w[i + 3]);
            }
            break;
        default:  // warps and copies may tear the ball apart
            for (centre::Range& axis : point_) axis = {-INFINITY, INFINITY};
            break;
        }
    }

    // Returns 1 or 2 where that operand is the result all over the ball.
    uint8_t compute(const Instruction& in, const float* params) {
        const Fn fn = Fn(in.aux() & kFnBits);
        const float* w = params + in.param;
        centre::Range& dst = value_[in.dst()];
        switch (fn) {
        case Fn::X:
        case Fn::Y:
        case Fn::Z:
            dst = point_[size_t(fn)];
            return 0;
        case Fn::Constant:
            dst = {w[0], w[0]};
            return 0;
        case Fn::Store:
            memory_[2 * size_t(w[0])] = value_[in.a()].lo;
            memory_[2 * size_t(w[0]) + 1] = value_[in.a()].hi;
            return 0;
        case Fn::Load:
            dst = {memory_[2 * size_t(w[0])], memory_[2 * size_t(w[0]) + 1]};
            return 0;
        default:
            break;
        }
        const centre::Range a = (in.aux() & kNumberA) != 0 ? centre::Range{w[0], w[0]} : value_[in.a()];
        const centre::Range b = operands(fn) < 2             ? centre::Range{0, 0}
                                : (in.aux() & kNumberB) != 0 ? centre::Range{w[0], w[0]}
                                                             : value_[in.b()];
        dst = centre::range_of(a, b, fn);
        if (fn != Fn::Min && fn != Fn::Max) return 0;
        const centre::Winner2 winner = centre::winner_of(a, b, fn == Fn::Min);
        return winner.a ? 1 : winner.b ? 2 : 0;
    }

private:
    float radius_, center_size_;
    std::vector<float>& memory_;
    centre::Range point_[3]{};
    centre::Range value_[kRegisters]{};
};

// Appends what is kept; returns the value of `root`.
float prune_register(const TapeView& tape, vec3 center, float radius, uint32_t root, Need root_need,
                     std::vector<Instruction>& out, PruneScratch& scratch) {
    const size_t n = tape.code.size();
    scratch.left.resize(n);
    scratch.right.resize(n);
    scratch.operand.assign(n, 0);
    scratch.memory.resize(tape.memory_slots);
    scratch.ranges.resize(2 * size_t(tape.memory_slots));
    centre::Registers r;
    r.cell[0].v[0] = center.x;
    r.cell[1].v[0] = center.y;
    r.cell[2].v[0] = center.z;
    r.memory = reinterpret_cast<centre::Chunk*>(scratch.memory.data());
    const centre::Samples samples{tape.samples};
    FormulaRanges ranges(center, radius, scratch);
    for (size_t pc = 0; pc < n; ++pc) {
        const Instruction& in = tape.code[pc];
        if (in.opcode() == Opcode::Combine) {
            scratch.left[pc] = r.value[in.a()].v[0];
            scratch.right[pc] = r.value[in.b()].v[0];
        }
        centre::run_distance(r, &in.word, 1, tape.params, samples);
        if (in.moves_point()) {
            ranges.move_point(in, tape.params, r);
        } else if (in.opcode() == Opcode::Arithmetic) {
            scratch.operand[pc] = ranges.compute(in, tape.params);
        }
    }
    const float value = r.value[root].v[0];

    const Ball ball{radius, std::max({std::fabs(center.x), std::fabs(center.y), std::fabs(center.z)})};
    Need need[kRegisters] = {};
    need[root] = root_need;
    bool need_point = false;
    scratch.slot_needed.assign(tape.memory_slots, 0);
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
        if (op == Opcode::Arithmetic && Fn(in.aux() & kFnBits) == Fn::Store) {
            uint8_t& wanted_slot = scratch.slot_needed[size_t(tape.params[in.param])];
            if (wanted_slot != 0) {
                kept.push_back(in);
                raise(in.a(), Need::Value);
            }
            wanted_slot = 0;
            continue;
        }
        const Need wanted = need[dst];
        if (wanted == Need::None) continue;
        switch (op) {
        case Opcode::Shape:
        case Opcode::Custom:
            need[dst] = Need::None;
            if (wanted == Need::Material) {
                kept.push_back(Instruction::make(Opcode::Constant, 0, dst, 0, 0, in.param));
            } else {
                kept.push_back(in);
                need_point = true;
            }
            break;
        case Opcode::Result:
            need[dst] = Need::None;
            if (wanted == Need::Material) {
                kept.push_back(Instruction::make(Opcode::Constant, 0, dst, 0, 0, in.param));
            } else {
                kept.push_back(in);
                raise(in.a(), Need::Value);
            }
            break;
        case Opcode::Arithmetic: {
            const Fn fn = Fn(in.aux() & kFnBits);
            need[dst] = Need::None;
            if (fn == Fn::Load) scratch.slot_needed[size_t(tape.params[in.param])] = 1;
            if (fn <= Fn::Z) need_point = true;
            const bool number_a = (in.aux() & kNumberA) != 0, number_b = (in.aux() & kNumberB) != 0;
            if (const uint8_t operand = scratch.operand[pc]; operand != 0) {
                const uint32_t from = operand == 1 ? in.a() : in.b();
                if (operand == 1 ? number_a : number_b) {
                    kept.push_back(Instruction::make(Opcode::Arithmetic, uint32_t(Fn::Constant), dst, 0, 0, in.param));
                } else {
                    raise(from, Need::Value);
                    if (from != dst)
                        kept.push_back(Instruction::make(Opcode::Arithmetic, uint32_t(Fn::Copy), dst, from, 0, 0));
                }
                break;
            }
            kept.push_back(in);
            if (operands(fn) > 0 && !number_a) raise(in.a(), Need::Value);
            if (operands(fn) == 2 && !number_b) raise(in.b(), Need::Value);
            break;
        }
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

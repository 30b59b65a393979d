// SPDX-License-Identifier: MIT
// The brick's list is folded at 64 balls at once, as cells are (cull.h), eight to an octant: balls around two texels a side, so that an edit
// is left out of an octant where each of its balls says so, which asks for far less than one ball around the octant would.
#include "sdf/octants.h"

#include "sdf/eval_isa.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kiln::sdf {
namespace {

// Instructions that the lanes run one by one, below which a brick is evaluated sooner than cut. Balls and boxes that are only moved count for
// little: a whole brick of them is one loop (eval_list.inl).
constexpr int kWorthCutting = 24;

bool is_join(Instruction in) {
    switch (in.opcode()) {
    case Opcode::Combine:
        return in.dst() == 0 && in.a() == 0 && in.b() == 1;
    case Opcode::Take:
        return in.dst() == 0 && in.b() == 1;
    case Opcode::Move:
    case Opcode::Negate:
        return in.dst() == 0 && in.a() == 1;
    default:
        return false;
    }
}

}  // namespace

// Finds the segments; false where the code is short, or no list.
bool OctantCodes::divide(std::span<const Instruction> code) {
    segments_.clear();
    from_empty_ = !code.empty() && code[0].opcode() == Opcode::Empty && code[0].dst() == 0;
    int alone = 0;
    for (uint32_t at = from_empty_ ? 1 : 0; at < code.size();) {
        uint32_t end = at;
        while (end < code.size() && (code[end].moves_point() || code[end].dst() != 0)) ++end;
        if (end == code.size() || !is_join(code[end])) return false;
        segments_.push_back({at, end - at});
        const bool fused = end - at == 2 && is_fused_leaf(code[at].word, code[at + 1].word);
        if (!fused) alone += int(end - at) + 1;
        at = end + 1;
    }
    return alone >= kWorthCutting;
}

bool OctantCodes::cut(const TapeView& tape, const float* x, const float* y, const float* z, Isa isa) {
    if (int(tape.code.size()) < kWorthCutting || !divide(tape.code)) return false;
    tape_ = tape;
    isa_ = isa;
    x_ = x;
    y_ = y;
    z_ = z;
    const size_t n = segments_.size();
    entries_.resize(n);
    left_.resize(n);
    right_.resize(n);
    constexpr float kInfinite = std::numeric_limits<float>::infinity();
    for (size_t i = 0; i < n; ++i) {
        const Segment& segment = segments_[i];
        const Instruction join = tape.code[segment.first + segment.content];
        FoldEntry& entry = entries_[i];
        entry = {reinterpret_cast<const uint32_t*>(tape.code.data() + segment.first),
                 segment.content,
                 0,
                 0,
                 kInfinite,
                 0,
                 FoldEntry::Combine,
                 {0, 0, 0},
                 {kInfinite, kInfinite, kInfinite}};
        switch (join.opcode()) {
        case Opcode::Combine:
            entry.blend = tape.params[join.param];
            entry.reach = std::max(entry.blend, tape.params[join.param + 1]);
            entry.op = uint8_t(join.aux() & 3u);
            break;
        case Opcode::Take:
            entry.join = FoldEntry::Take;
            entry.op = uint8_t(join.aux());
            break;
        case Opcode::Negate:
            entry.join = FoldEntry::Negate;
            break;
        default:
            entry.join = FoldEntry::Move;
            break;
        }
    }

    Balls balls;
    float most[3] = {0, 0, 0}, farthest = 0;
    const float* axes[3] = {x, y, z};
    for (size_t axis = 0; axis < 3; ++axis) {
        for (int i = 0; i < 8; i += 2) most[axis] = std::max(most[axis], axes[axis][i + 1] - axes[axis][i]);
        farthest = std::max({farthest, std::fabs(axes[axis][0]), std::fabs(axes[axis][7])});
    }
    balls.radius = 0.50001f * std::sqrt(most[0] * most[0] + most[1] * most[1] + most[2] * most[2]) + 5e-7f * farthest;
    balls.half_side = balls.radius;
    for (int i = 0; i < 64; ++i) {
        const auto middle = [](const float* axis, int pair) { return 0.5f * (axis[2 * pair] + axis[2 * pair + 1]); };
        const int octant = i >> 3;
        balls.x[i] = middle(x, (octant & 1) * 2 + (i & 1));
        balls.y[i] = middle(y, (octant >> 1 & 1) * 2 + (i >> 1 & 1));
        balls.z[i] = middle(z, (octant >> 2) * 2 + (i >> 2 & 1));
    }
    balls.live = ~uint64_t(0);
    float values[64];
    fold_list(entries_, tape, balls, left_.data(), right_.data(), values, nullptr, isa);
    return true;
}

// From the last edit to the first, as prune() walks its tape: what comes before is needed as a value, for its material, or not.
void OctantCodes::write(int octant, Want want, std::vector<Instruction>& out) const {
    const uint64_t mask = uint64_t(255) << (8 * octant);
    const auto everywhere = [&](uint64_t balls) { return (balls & mask) == mask; };
    out.clear();  // backwards, and turned round at the end
    bool value = true, material = false;
    for (size_t i = segments_.size(); i-- > 0 && (value || material);) {
        const bool won = everywhere(right_[i]);
        if (!won && everywhere(left_[i])) continue;
        const Segment& segment = segments_[i];
        const std::span<const Instruction> content = tape_.code.subspan(segment.first, segment.content);
        Instruction join = tape_.code[segment.first + segment.content];
        const bool paint = join.opcode() == Opcode::Combine && (join.aux() & 3u) == uint32_t(Op::Paint);
        if (paint && want == Want::Distance) continue;
        const bool shown = !value;
        if (won) {
            if (join.opcode() == Opcode::Combine) {
                const bool negated = (join.aux() & 3u) == uint32_t(Op::Subtract);
                if (want == Want::Materials && (join.aux() & kMayLackMaterial) != 0) {
                    join = Instruction::make(Opcode::Take, negated ? 1u : 0u, 0, 0, 1, 0);
                } else {
                    join = Instruction::make(negated ? Opcode::Negate : Opcode::Move, 0, 0, 1, 0, 0);
                }
            }
            value = false;
            material = join.opcode() == Opcode::Take && want == Want::Materials;
        } else {
            value = true;
            material = false;
        }
        out.push_back(join);
        const auto leaf =
            std::find_if(content.begin(), content.end(), [](Instruction in) { return in.has_material(); });
        if (won && shown && content.size() > 1 && leaf != content.end() && std::next(leaf) == content.end()) {
            out.push_back(Instruction::make(Opcode::Constant, 0, 1, 0, 0, leaf->param));  // no tree: its material alone
        } else {
            out.insert(out.end(), content.rbegin(), content.rend());
        }
    }
    if (from_empty_ && (value || material)) out.push_back(tape_.code[0]);
    std::reverse(out.begin(), out.end());
}

float OctantCodes::evaluate(float* out) const {
    thread_local std::vector<Instruction> code;
    float least = std::numeric_limits<float>::infinity();
    for (int octant = 0; octant < kOctants; ++octant) {
        write(octant, Want::Distance, code);
        alignas(64) float points[3][kTexels], values[kTexels];
        for (int t = 0; t < kTexels; ++t) {
            const int texel = texel_of_octant(octant, t);
            points[0][t] = x_[texel & 7];
            points[1][t] = y_[texel >> 3 & 7];
            points[2][t] = z_[texel >> 6];
        }
        sdf::evaluate({code, tape_.params, tape_.samples, tape_.memory_slots},
                      {points[0], points[1], points[2], kTexels}, values, isa_);
        for (int t = 0; t < kTexels; ++t) {
            out[texel_of_octant(octant, t)] = values[t];
            least = std::min(least, std::fabs(values[t]));
        }
    }
    return least;
}

std::span<const Instruction> OctantCodes::material_code(int octant) {
    write(octant, Want::Materials, code_);
    return code_;
}

}  // namespace kiln::sdf

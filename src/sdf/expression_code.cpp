// SPDX-License-Identifier: MIT

#include "sdf/expression_code.h"
#include "sdf/expression_glsl.h"

#include "base/format.h"

#include <algorithm>
#include <array>
#include <bit>
#include <map>
#include <mutex>
#include <unordered_map>

namespace kiln::sdf {

namespace {

constexpr uint32_t kNowhere = UINT32_MAX;
constexpr uint32_t kNever = UINT32_MAX;
constexpr uint32_t kMostRegisters = 32;

class Allocator {
public:
    Allocator(const Formula& formula, uint32_t most_registers)
        : nodes_(formula.nodes), most_(std::clamp(most_registers, kFewestFormulaRegisters, kMostRegisters)) {}

    FormulaCode run() {
        register_.assign(nodes_.size(), kNowhere);
        slot_.assign(nodes_.size(), kNowhere);
        find_uses();
        holds_.fill(kNowhere);
        const uint32_t value = uint32_t(nodes_.size() - 1);
        for (uint32_t i = 0; i <= value; ++i) {
            now_ = i;
            const FormulaNode& n = nodes_[i];
            const int count = operands(n.fn);
            if (count == 0) continue;  // numbers stand in instructions, coordinates are taken where they are wanted
            uint32_t flags = 0, number = 0;
            uint32_t in[2] = {0, 0};
            pinned_ = {kNowhere, kNowhere};
            for (int k = 0; k < count; ++k) {
                const uint32_t operand = k == 0 ? n.a : n.b;
                if (nodes_[operand].fn == Fn::Constant) {
                    flags = k == 0 ? kNumberA : kNumberB;
                    number = add_number(nodes_[operand].constant);
                    continue;
                }
                in[k] = bring(operand);
                pinned_[size_t(k)] = in[k];
            }
            for (int k = 0; k < count; ++k) release_after_use(k == 0 ? n.a : n.b);
            const uint32_t dst = take_register();
            put(i, dst);
            emit(n.fn, flags, dst, in[0], in[1], number);
        }
        now_ = value;
        pinned_ = {kNowhere, kNowhere};
        if (nodes_[value].fn == Fn::Constant) {
            const uint32_t dst = take_register();
            emit(Fn::Constant, 0, dst, 0, 0, add_number(nodes_[value].constant));
            out_.result = dst;
        } else {
            out_.result = bring(value);
        }
        return std::move(out_);
    }

private:
    // Where each node is used, as one list cut in pieces; the value itself is used after the end.
    void find_uses() {
        first_use_.assign(nodes_.size() + 1, 0);
        for (const FormulaNode& n : nodes_)
            for (int k = 0; k < operands(n.fn); ++k) ++first_use_[(k == 0 ? n.a : n.b) + 1];
        for (size_t i = 1; i < first_use_.size(); ++i) first_use_[i] += first_use_[i - 1];
        uses_.resize(first_use_.back());
        next_use_.assign(first_use_.begin(), first_use_.end() - 1);
        std::vector<uint32_t> fill = next_use_;
        for (uint32_t i = 0; i < nodes_.size(); ++i)
            for (int k = 0; k < operands(nodes_[i].fn); ++k) uses_[fill[k == 0 ? nodes_[i].a : nodes_[i].b]++] = i;
    }
    uint32_t next_use(uint32_t node) const {
        const uint32_t at = next_use_[node];
        if (at < first_use_[node + 1]) return uses_[at];
        return node + 1 == nodes_.size() ? uint32_t(nodes_.size()) : kNever;
    }

    void emit(Fn fn, uint32_t flags, uint32_t dst, uint32_t a, uint32_t b, uint32_t param) {
        out_.code.push_back(Instruction::make(Opcode::Arithmetic, uint32_t(fn) | flags, dst, a, b, param));
        out_.registers = std::max(out_.registers, dst + 1);
    }
    uint32_t add_number(float value) {
        const auto [it, fresh] = numbers_.emplace(std::bit_cast<uint32_t>(value), uint32_t(out_.params.size()));
        if (fresh) out_.params.push_back(value);
        return it->second;
    }
    void put(uint32_t node, uint32_t reg) {
        register_[node] = reg;
        holds_[reg] = node;
    }

    uint32_t take_register() {
        for (uint32_t r = 0; r < most_; ++r)
            if (holds_[r] == kNowhere) return r;
        uint32_t victim = kNowhere;
        for (uint32_t r = 0; r < most_; ++r) {
            if (r == pinned_[0] || r == pinned_[1]) continue;
            if (victim == kNowhere || next_use(holds_[r]) > next_use(holds_[victim])) victim = r;
        }
        const uint32_t node = holds_[victim];
        if (operands(nodes_[node].fn) > 0 && slot_[node] == kNowhere) {
            slot_[node] = take_slot();
            emit(Fn::Store, 0, victim, victim, 0, add_number(float(slot_[node])));
        }
        register_[node] = kNowhere;
        holds_[victim] = kNowhere;
        return victim;
    }
    uint32_t take_slot() {
        if (!free_slots_.empty()) {
            const uint32_t slot = free_slots_.back();
            free_slots_.pop_back();
            return slot;
        }
        return out_.memory_slots++;
    }

    uint32_t bring(uint32_t node) {
        if (register_[node] != kNowhere) return register_[node];
        const uint32_t reg = take_register();
        if (operands(nodes_[node].fn) == 0) {
            emit(nodes_[node].fn, 0, reg, 0, 0, 0);
        } else {
            emit(Fn::Load, 0, reg, 0, 0, add_number(float(slot_[node])));
        }
        put(node, reg);
        return reg;
    }

    void release_after_use(uint32_t node) {
        if (nodes_[node].fn == Fn::Constant) return;
        while (next_use_[node] < first_use_[node + 1] && uses_[next_use_[node]] <= now_) ++next_use_[node];
        if (next_use(node) != kNever) return;
        if (register_[node] != kNowhere) holds_[register_[node]] = kNowhere;
        register_[node] = kNowhere;
        if (slot_[node] != kNowhere) free_slots_.push_back(slot_[node]);
        slot_[node] = kNowhere;
    }

    const std::vector<FormulaNode>& nodes_;
    uint32_t most_;
    uint32_t now_ = 0;
    FormulaCode out_;
    std::vector<uint32_t> register_, slot_;  // by node
    std::vector<uint32_t> first_use_, next_use_, uses_;
    std::array<uint32_t, kMostRegisters> holds_{};
    std::array<uint32_t, 2> pinned_{};
    std::vector<uint32_t> free_slots_;
    std::unordered_map<uint32_t, uint32_t> numbers_;
};

using Numbers = std::array<float, 4>;
using Look = std::pair<std::string_view, Numbers>;
// Compares what is kept with what is asked, without a copy of its text.
struct Less {
    using is_transparent = void;
    static Look of(const std::pair<std::string, Numbers>& key) { return {key.first, key.second}; }
    static Look of(const Look& key) { return key; }
    bool operator()(const auto& a, const auto& b) const { return of(a) < of(b); }
};

using Prepared = Result<std::shared_ptr<const PreparedFormula>>;

Prepared prepare(const std::string& data, vec3 half_extents, float declared) {
    const bool model = data.starts_with(kModelText);
    if (data.starts_with(kModelFile)) return Error{"refers to a file that was not loaded", ErrorKind::Input};
    const bool glsl = !model && is_glsl(data);
    auto formula = model  ? read_vm(std::string_view(data).substr(kModelText.size()))
                   : glsl ? read_glsl(data)
                          : parse_formula(data);
    const std::string_view what = model ? "model " : glsl ? "GLSL " : "expression ";
    if (!formula) return Error{std::string(what) + formula.error().message, ErrorKind::Input};
    auto lipschitz = formula_lipschitz(*formula, half_extents, declared);
    if (!lipschitz) return lipschitz.error();
    return std::make_shared<const PreparedFormula>(PreparedFormula{std::move(*formula), *lipschitz});
}

}  // namespace

FormulaCode formula_code(const Formula& formula, uint32_t most_registers) {
    return Allocator(formula, most_registers).run();
}

Prepared prepare_formula(const std::string& data, vec3 half_extents, float declared) {
    // Enough for a scene's; a world with more distinct formulas than this prepares some again.
    constexpr size_t kMostKept = 1024;
    static std::mutex mutex;
    static std::map<std::pair<std::string, Numbers>, Prepared, Less> kept;
    const Look key{data, {half_extents.x, half_extents.y, half_extents.z, declared}};
    {
        const std::lock_guard lock(mutex);
        if (const auto found = kept.find(key); found != kept.end()) return found->second;
    }
    Prepared made = prepare(data, half_extents, declared);
    const std::lock_guard lock(mutex);
    if (kept.size() >= kMostKept) kept.clear();
    return kept.emplace(std::pair(data, key.second), std::move(made)).first->second;
}

}  // namespace kiln::sdf

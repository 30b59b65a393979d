// SPDX-License-Identifier: MIT
#include "render/passes/tape_use.h"

#include "base/format.h"

#include <algorithm>
#include <map>
#include <memory>
#include <mutex>

namespace kiln::render {

namespace {

constexpr uint32_t bit(uint32_t n) { return n < 32 ? 1u << n : 0u; }
constexpr uint32_t bit(sdf::Opcode op) { return bit(uint32_t(op)); }

struct Specialised {
    std::string name;
    std::vector<rhi::SpecConstant> constants;
    Kernel kernel;
};

}  // namespace

TapeUse tape_use(std::span<const sdf::Instruction> code) {
    using sdf::Opcode;
    // What pruning may put in the place of a Combine.
    TapeUse use{.shapes = 0,
                .warps = 0,
                .opcodes = bit(Opcode::Move) | bit(Opcode::Negate) | bit(Opcode::Take) | bit(Opcode::Constant),
                .registers = 1};
    for (const sdf::Instruction in : code) {
        use.opcodes |= bit(in.opcode());
        if (in.opcode() == Opcode::Shape) use.shapes |= bit(in.aux());
        if (in.opcode() == Opcode::PointWarp || in.opcode() == Opcode::PointCopy || in.opcode() == Opcode::Value)
            use.warps |= bit(in.aux());
        use.registers = std::max({use.registers, in.dst() + 1, in.a() + 1, in.b() + 1});
    }
    return use;
}

TapeUse any_kind(const TapeUse& use) {
    return {.registers = std::min((use.registers + 3) / 4 * 4, uint32_t(sdf::kRegisters))};
}

TapeUse both(const TapeUse& a, const TapeUse& b) {
    return {a.shapes | b.shapes, a.warps | b.warps, a.opcodes | b.opcodes, std::max(a.registers, b.registers)};
}

const Kernel& specialised(const Kernel& kernel, const TapeUse& use) {
    if (use == TapeUse{}) return kernel;
    static std::mutex mutex;
    static std::map<std::string, std::unique_ptr<Specialised>> made;
    const std::lock_guard lock(mutex);
    const std::string name = formatted("{} [{:x} {:x} {:x} {} {}]", kernel.name, use.shapes, use.warps, use.opcodes,
                                       use.registers, use.planes);
    std::unique_ptr<Specialised>& slot = made[name];
    if (!slot) {
        slot = std::make_unique<Specialised>();
        slot->name = name;
        slot->constants.assign(kernel.constants.begin(), kernel.constants.end());
        for (const rhi::SpecConstant c : {rhi::SpecConstant{1, use.shapes},
                                          {2, use.warps},
                                          {3, use.opcodes},
                                          {4, use.registers},
                                          {8, use.planes}}) {
            slot->constants.push_back(c);
        }
        slot->kernel = {slot->name, kernel.spirv, slot->constants};
    }
    return slot->kernel;
}

}  // namespace kiln::render

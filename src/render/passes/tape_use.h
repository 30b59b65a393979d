// SPDX-License-Identifier: MIT
// Kernels made for the shapes in use; see tape_use.glsl.
#pragma once

#include "render/graph_kernel.h"
#include "sdf/program.h"

namespace kiln::render {

// What can occur on a tape. Software rasterisers execute the branches that no lane takes, too: there kernels are made for what is in
// use (a new pipeline when a new kind of shape appears); on GPUs a kernel serves every kind.
struct TapeUse {
    uint32_t shapes = ~0u, warps = ~0u, opcodes = ~0u;  // a bit a kind
    uint32_t registers = sdf::kRegisters;
    uint32_t planes = 0;  // the code is so many half-spaces, which FrameParams has; 0: it is run
    friend bool operator==(const TapeUse&, const TapeUse&) = default;
};
TapeUse tape_use(std::span<const sdf::Instruction> code);
// Every kind, and registers in steps of four: what kernels on GPUs are made for. Registers live in memory there; 24 of them and their
// materials would push each other out of the nearest cache.
TapeUse any_kind(const TapeUse& use);
TapeUse both(const TapeUse& a, const TapeUse& b);
// The kernel for that use; lives as long as the program.
const Kernel& specialised(const Kernel& kernel, const TapeUse& use);

}  // namespace kiln::render

// SPDX-License-Identifier: MIT
// What can occur on the tape, as specialisation constants; see TapeUse in passes.h. Included ahead of sdf/tape.glsl.

layout(constant_id = 1) const uint kShapesUsed = 0xffffffffu;   // a bit a kind
layout(constant_id = 2) const uint kWarpsUsed = 0xffffffffu;
layout(constant_id = 3) const uint kOpcodesUsed = 0xffffffffu;
layout(constant_id = 4) const int kRegistersUsed = 24;
layout(constant_id = 8) const int kPlanes = 0;

#define KILN_USES_SHAPE(kind) ((kShapesUsed & (1u << kind)) != 0u)
#define KILN_USES_WARP(kind) ((kWarpsUsed & (1u << kind)) != 0u)
#define KILN_USES_OPCODE(opcode) ((kOpcodesUsed & (1u << opcode)) != 0u)
#define KILN_TAPE_REGISTERS kRegistersUsed

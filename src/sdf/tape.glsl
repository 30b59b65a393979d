// SPDX-License-Identifier: MIT
// The tape interpreter in GLSL: the twin of eval_lanes.inl, one point at a time. A kernel calls it from one place, inside a loop:
// every inlined copy costs compile time.
// The including kernel declares, before this file:
//   uvec2 sdf_code(uint at)      instruction `at`: word, param
//   float sdf_param(uint at)     number `at` of Program::params
//   float sdf_sample(uint at)    number `at` of Program::samples
// Then: float tape_distance(uint first, uint count, vec3 p_world), or, with KILN_TAPE_MATERIALS defined,
//       float tape_materials(uint first, uint count, vec3 p_world, bool wanted, out Mix mix): the mix where it is wanted.

// It may define KILN_USES_SHAPE(kind), KILN_USES_WARP(kind), KILN_USES_OPCODE(opcode), KILN_TAPE_REGISTERS as specialisation constants
// that say what can occur: software rasterisers execute the branches that no lane takes, too.

#ifndef KILN_USES_SHAPE
#define KILN_USES_SHAPE(kind) true
#define KILN_USES_WARP(kind) true
#define KILN_USES_OPCODE(opcode) true
#define KILN_TAPE_REGISTERS 24
#endif

#include "sdf/lang/lang.glsl"
#define KILN_T float
#include "sdf/lang/trig.sdf.h"
#undef KILN_T
#include "sdf/lang/explog.sdf.h"
#include "sdf/expression_fn.sdf.h"
#ifdef KILN_TAPE_MATERIALS
#include "sdf/lang/material.sdf.h"
#endif
#include "sdf/texts.gen.glsl"
// From here on plain GLSL: the names of the shape language would get in the way of it.
#undef real
#undef real2
#undef real3
#undef param
#undef param2
#undef param3
#undef mask
#undef whole
#undef both
#undef either
#undef no
#undef select
#undef lt
#undef le
#undef gt
#undef ge

const float kTapeEmpty = 1e30;
const float kTapeEmptyTest = 1e29;
const uint kNoMaterial = 65535u;

// Values of sdf::Opcode.
const uint kOpPointCell = 0u;
const uint kOpPointTranslate = 1u;
const uint kOpPointAffine = 2u;
const uint kOpPointAffineOn = 3u;
const uint kOpPointWarp = 4u;
const uint kOpPointCopy = 5u;
const uint kOpPointClamp = 6u;
const uint kOpShape = 7u;
const uint kOpValue = 8u;
const uint kOpBound = 9u;
const uint kOpCombine = 10u;
const uint kOpMove = 11u;
const uint kOpNegate = 12u;
const uint kOpEmpty = 13u;
const uint kOpTake = 14u;
const uint kOpConstant = 15u;
const uint kOpArithmetic = 16u;
const uint kOpResult = 17u;
const uint kOpPaint = 3u;  // value of kiln::Op::Paint

// Of an Arithmetic instruction's aux, and values of sdf::Fn. Store and Load have no twin here: the renderer keeps tapes with values
// in memory off the GPU.
const uint kFnBits = 63u;
const uint kNumberA = 64u;
const uint kNumberB = 128u;

float tape_arithmetic(uint fn, float a, float b) {
    switch (fn) {
        case 6u: return a;
        case 7u: return -a;
        case 8u: return abs(a);
        case 9u: return fn_sqrt(a);
        case 10u: return a * a;
        case 11u: return floor(a);
        case 12u: return fn_sin(a);
        case 13u: return fn_cos(a);
        case 14u: return exp_of(a);
        case 15u: return log_of(a);
        case 16u: return a + b;
        case 17u: return a - b;
        case 18u: return a * b;
        case 19u: return a / b;
        case 20u: return b < a ? b : a;
        case 21u: return a < b ? b : a;
        case 22u: return atan_of(a, b);
        case 23u: return fn_mod(a, b);
        default: return 0.0;
    }
}

vec3 tape_vec3(uint at) { return vec3(sdf_param(at), sdf_param(at + 1u), sdf_param(at + 2u)); }

// Row-major 3x3 matrix times (p - t), numbers t[3] M[9].
vec3 tape_affine(vec3 p, uint at) {
    vec3 q = p - tape_vec3(at);
    return vec3(sdf_param(at + 3u) * q.x + sdf_param(at + 4u) * q.y + sdf_param(at + 5u) * q.z,
                sdf_param(at + 6u) * q.x + sdf_param(at + 7u) * q.y + sdf_param(at + 8u) * q.z,
                sdf_param(at + 9u) * q.x + sdf_param(at + 10u) * q.y + sdf_param(at + 11u) * q.z);
}

#ifdef KILN_TAPE_MATERIALS
float tape_materials(uint first, uint count, vec3 p_world, bool wanted, out Mix mix_out) {
    Mix mixes[KILN_TAPE_REGISTERS];
#else
float tape_distance(uint first, uint count, vec3 p_world) {
#endif
    float value[KILN_TAPE_REGISTERS];
    vec3 p = p_world;
    for (uint pc = first; pc < first + count; ++pc) {
        uvec2 instruction = sdf_code(pc);
        uint word = instruction.x;
        uint at = instruction.y;
        uint aux = (word >> 5u) & 255u;
        uint dst = (word >> 13u) & 31u;
        uint a = (word >> 18u) & 31u;
        uint b = (word >> 23u) & 31u;
        switch (word & 31u) {
            case kOpPointCell: p = p_world; break;
            case kOpPointTranslate: p = p_world - tape_vec3(at); break;
            case kOpPointAffine:
            case kOpPointAffineOn:
                if (KILN_USES_OPCODE(kOpPointAffine) || KILN_USES_OPCODE(kOpPointAffineOn)) {
                    p = tape_affine((word & 31u) == kOpPointAffine ? p_world : p, at);
                }
                break;
            case kOpPointWarp:
                if (KILN_USES_OPCODE(kOpPointWarp)) p = point_warp(aux, p, at);
                break;
            case kOpPointCopy:
                if (KILN_USES_OPCODE(kOpPointCopy)) p = copy_warp(aux, p, at + 6u, tape_vec3(at), tape_vec3(at + 3u));
                break;
            case kOpPointClamp:
                if (KILN_USES_OPCODE(kOpPointClamp)) p = clamp(p, tape_vec3(at), tape_vec3(at + 3u));
                break;
            case kOpShape:
                value[dst] = shape_distance(aux, p, at + 3u, 0u) * sdf_param(at);
#ifdef KILN_TAPE_MATERIALS
                if (wanted) mixes[dst] = make_mix(sdf_param(at + 1u), float(kNoMaterial), 0.0);
#endif
                break;
            case kOpValue:
                if (KILN_USES_OPCODE(kOpValue)) value[dst] = value_warp(aux, value[dst] * sdf_param(at + 1u), p, at + 2u) * sdf_param(at);
                break;
            case kOpArithmetic:
                if (KILN_USES_OPCODE(kOpArithmetic)) {
                    uint fn = aux & kFnBits;
                    if (fn < 3u) {
                        value[dst] = fn == 0u ? p.x : fn == 1u ? p.y : p.z;
                    } else if (fn == 3u) {
                        value[dst] = sdf_param(at);
                    } else {
                        float left = (aux & kNumberA) != 0u ? sdf_param(at) : value[a];
                        float right = (aux & kNumberB) != 0u ? sdf_param(at) : value[b];
                        value[dst] = tape_arithmetic(fn, left, right);
                    }
                }
                break;
            case kOpResult:
                if (KILN_USES_OPCODE(kOpResult)) {
                    float number = value[a];
                    value[dst] = (abs(number) < kTapeEmpty ? number : kTapeEmpty) * sdf_param(at);
#ifdef KILN_TAPE_MATERIALS
                    if (wanted) mixes[dst] = make_mix(sdf_param(at + 1u), float(kNoMaterial), 0.0);
#endif
                }
                break;
            case kOpBound:
                if (KILN_USES_OPCODE(kOpBound)) {
                    vec3 q = max(tape_vec3(at + 2u) - p, p - tape_vec3(at + 5u));
                    float box = length(max(q, vec3(0.0))) + min(max(q.x, max(q.y, q.z)), 0.0);
                    value[dst] = max(min(value[dst], sdf_param(at + 1u)), box * sdf_param(at));
                }
                break;
            case kOpCombine: {
                uint op = aux & 3u;
                float x = value[a];
                float y = value[b];
#ifdef KILN_TAPE_MATERIALS
                if (wanted) {
                    float k = sdf_param(at + 1u);
                    float share = op == kOpPaint ? share_min(0.0, y, k) : op_share(op, x, y, k);
                    mixes[dst] = blend_mix(mixes[a], mixes[b], share);
                }
#endif
                value[dst] = op == kOpPaint ? x : op_distance(op, x, y, sdf_param(at));
                break;
            }
            case kOpMove:
            case kOpNegate:
                value[dst] = (word & 31u) == kOpNegate ? -value[a] : value[a];
#ifdef KILN_TAPE_MATERIALS
                if (wanted) mixes[dst] = mixes[a];
#endif
                break;
            case kOpEmpty:
                value[dst] = kTapeEmpty;
#ifdef KILN_TAPE_MATERIALS
                if (wanted) mixes[dst] = make_mix(float(kNoMaterial), float(kNoMaterial), 0.0);
#endif
                break;
            case kOpTake:
                if (!KILN_USES_OPCODE(kOpTake)) break;
                value[dst] = aux == 1u ? -value[b] : value[b];
#ifdef KILN_TAPE_MATERIALS
                if (wanted && mixes[b].id0 == float(kNoMaterial)) {
                    mixes[dst] = mixes[a];
                } else if (wanted) {
                    mixes[dst] = mixes[b];
                }
#endif
                break;
            case kOpConstant:
                value[dst] = 0.0;
#ifdef KILN_TAPE_MATERIALS
                if (wanted) mixes[dst] = make_mix(sdf_param(at + 1u), float(kNoMaterial), 0.0);
#endif
                break;
            default: break;
        }
    }
#ifdef KILN_TAPE_MATERIALS
    if (wanted) mix_out = mixes[0];
#endif
    return value[0];
}

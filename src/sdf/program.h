// SPDX-License-Identifier: MIT
// Program: the world's ordered edits compiled to register code, one row an edit. A value: copying one is a few pointers, and a copy with
// an edit inserted or removed costs that edit alone, so every state of a world can be kept.
//
// The tape is a list of 8-byte instructions over 24 value registers, one point register P and the cell's point C. Every value
// register holds, in world metres, a 1-Lipschitz function of the world point: scales and Lipschitz factors are folded into
// each leaf's multiplier, so operands may be compared directly (architecture: "fields that never lie").
// Register 0 carries the running result of the world list; each edit is evaluated into register 1 and combined.
// The child that needs more registers goes first (Sethi and Ullman, "The Generation of Optimal Code for Arithmetic
// Expressions", 1970), so 24 registers serve any tree of up to 2^22 leaves.
#pragma once

#include "base/append_array.h"
#include "sdf/edit_index.h"
#include "sdf/expression_fn.h"

#include <kiln/edit.h>
#include <kiln/result.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace kiln::sdf {

inline constexpr int kRegisters = 24;
/// Distance of empty space: finite, so that no operation on it makes a NaN. Anything >= kEmptyTest means "nothing there".
inline constexpr float kEmpty = 1e30f;
inline constexpr float kEmptyTest = 1e29f;
/// "No material": a subtract or intersect operand that leaves what was there. Others are 0 … 65533.
inline constexpr uint32_t kNoMaterial = 65535;
/// Material numbers in tapes and bricks: 0 is the default grey, MaterialId::index + 1 the rest.
inline constexpr uint32_t kDefaultMaterial = 0;
inline constexpr uint16_t kSeveralMaterials = 65534;  ///< of an edit: its leaves are of more than one
inline constexpr uint32_t material_number(MaterialId id) { return id ? id.index + 1 : kDefaultMaterial; }

// Instruction word: opcode 0-4, aux 5-12, dst 13-17, a 18-22, b 23-27. `param` indexes Program::params.
enum class Opcode : uint32_t {
    PointCell,       // P = C                                                 (starts a chain)
    PointTranslate,  // P = C − t               t[3]                           (starts a chain)
    PointAffine,     // P = M · (C − t)         t[3] M[9], row-major           (starts a chain)
    PointAffineOn,   // P = M · (P − t)         t[3] M[9]
    PointWarp,       // P = point_warp[aux](P)  its params
    PointCopy,       // P = copy_warp[aux](P)   middle[3] second[3] its params
    PointClamp,      // P = clamp(P, lo, hi)    lo[3] hi[3]
    Shape,           // R[dst] = s · shape[aux](P)                 s, material, edit, its params
    Value,           // R[dst] = s · value_warp[aux](R[dst] / s, P)  s, 1/s, its params
    Bound,           // R[dst] = max(min(R[dst], m), s · signed distance(P, box))   s, m, lo[3] hi[3]
    Combine,  // R[dst] = op[aux & 3](R[a], R[b], k)        k, k of materials. aux & 3 = Op (Paint keeps R[a]'s distance);
              //                                            aux & kMayLackMaterial: R[b] may carry no material
    Move,     // R[dst] = R[a]
    Negate,  // R[dst] = −R[a]
    Empty,   // R[dst] = kEmpty, no material
    // Only in pruned code, where R[b] won a Combine by distance but what R[a] was made of still shows through:
    Take,      // R[dst] = R[b] (aux 0) or −R[b] (aux 1); material: R[b]'s, or R[a]'s where R[b] has none
    Constant,  // R[dst] = 0 with the material (edit) of the Shape at param: only its material is looked at
    // Formulas (expression.h): registers hold numbers here, not distances, until Result.
    Arithmetic,  // R[dst] = Fn(aux & kFnBits)(R[a], R[b])   kNumberA, kNumberB: that operand is the one number; Store, Load: slot
    Result,  // R[dst] = s · R[a], kEmpty for NaN        s, material, edit
    Custom,  // R[dst] = s · custom[aux](P), kEmpty for NaN   s, material, edit, its params. Not on the GPU
};
inline constexpr uint32_t kMayLackMaterial = 4;
inline constexpr uint32_t kFnBits = 63, kNumberA = 64, kNumberB = 128;

/// Does an Arithmetic instruction of this aux read the number at its param?
inline constexpr bool reads_number(uint32_t aux) {
    const Fn fn = Fn(aux & kFnBits);
    return (aux & (kNumberA | kNumberB)) != 0 || fn == Fn::Constant || fn == Fn::Store || fn == Fn::Load;
}

struct Instruction {
    uint32_t word;
    uint32_t param;

    static constexpr Instruction make(Opcode op, uint32_t aux, uint32_t dst, uint32_t a, uint32_t b, uint32_t param) {
        return {uint32_t(op) | aux << 5 | dst << 13 | a << 18 | b << 23, param};
    }
    constexpr Opcode opcode() const { return Opcode(word & 31u); }
    constexpr uint32_t aux() const { return (word >> 5) & 255u; }
    constexpr uint32_t dst() const { return (word >> 13) & 31u; }
    constexpr uint32_t a() const { return (word >> 18) & 31u; }
    constexpr uint32_t b() const { return (word >> 23) & 31u; }
    /// Makes a value with a material and an edit's number: param + 1, param + 2.
    constexpr bool has_material() const {
        return opcode() == Opcode::Shape || opcode() == Opcode::Constant || opcode() == Opcode::Result ||
               opcode() == Opcode::Custom;
    }
    /// Has no twin on the GPU: a formula's values in memory, a program's own shape.
    constexpr bool cpu_only() const {
        if (opcode() == Opcode::Custom) return true;
        const Fn fn = Fn(aux() & kFnBits);
        return opcode() == Opcode::Arithmetic && (fn == Fn::Store || fn == Fn::Load);
    }
    constexpr bool starts_chain() const { return opcode() <= Opcode::PointAffine; }
    constexpr bool moves_point() const { return opcode() <= Opcode::PointClamp; }
    friend bool operator==(const Instruction&, const Instruction&) = default;
};
static_assert(sizeof(Instruction) == 8);

/// One edit, compiled: a row of the program. Never changes once written.
struct EditSpan {
    uint32_t first = 0, count = 0;  ///< its instructions in Program::code, the world Combine last; count 0: hidden
    Box3 bounds;                    ///< of its solid, world metres; infinite faces for unbounded edits
    float blend = 0;                ///< blend radius, metres
    float reach =
        0;  ///< max(blend radius, material blend radius): it can change values within band + reach of its solid
    float rate = 1;  ///< outside `bounds` its value is at least this times the distance to them
    Op op = Op::Union;
    uint16_t material = uint16_t(kNoMaterial);  ///< of all its leaves that have one; kSeveralMaterials
    uint32_t owner = 0;                         ///< the caller's number of the edit
    uint64_t order = 0;                         ///< its place in the list: the world folds by ascending order

    bool everywhere() const { return op == Op::Intersect || !bounds.finite(); }
    IndexedEdit indexed(uint32_t row) const {
        return {row,         bounds, reach, 1.0f / rate, 0.25f * (op == Op::Union ? blend : reach), op == Op::Union,
                everywhere()};
    }
};

/// Where the numbers of a sampled shape lie in Program::samples, and its largest difference between neighbours along x and z.
struct GridPlace {
    uint32_t first = 0;
    vec2 steps;
};

class Program {
public:
    AppendArray<Instruction> code;  ///< of every row, one after another, removed ones too
    AppendArray<float> params;
    AppendArray<float> samples;   ///< numbers of sampled shapes
    AppendArray<EditSpan> edits;  ///< rows; which of them are in the world, `index` knows
    EditIndex index;              ///< the visible edits
    std::vector<GridPlace> grids;
    std::vector<uint32_t> meshes;  ///< blocks of samples where each begins
    Box3 bounds;  ///< what the finite edits can change: solids of unions, and of the others where something is
                  ///< unbounded; empty when none
    bool unbounded = false;  ///< some visible union edit has infinite bounds
    uint32_t numbering =
        0;  ///< times that the list had new orders: of rows removed before the last, `order` says nothing any more
    uint32_t memory_slots = 0;  ///< values that formulas keep outside the registers at once; the GPU has none

    /// Rows of the visible edits, in order.
    std::vector<uint32_t> rows() const;
    /// The whole world as one tape, [Empty R0] [edit 0] [edit 1] …, with its result in R0: made when first asked. Any thread.
    std::span<const Instruction> tape() const;
    /// Takes an edit out of the world. O(log edits).
    void remove(uint32_t row);
    /// Gives all edits of the world new orders, `rows` being all rows in order (hidden ones too). O(rows).
    void number_anew(std::span<const uint32_t> rows);
    /// Brings bounds, and the tape to come, up to the index.
    void settle();

private:
    struct Tape;
    std::shared_ptr<Tape> tape_;
};

/// Grid of a heightfield, row by row in z, values in [0, 1].
struct HeightGrid {
    int columns = 0, rows = 0;
    std::vector<float> values;
};

/// Signed distance of a mesh in its own unit: one sample every 7 cells everywhere, and bricks of 8x8x8 samples near the surface.
/// 1-Lipschitz as it is interpolated (shapes/mesh.sdf.h), positive on and near the faces of its box.
struct MeshGrid {
    static constexpr int kBrickCells = 7;
    static constexpr size_t kBlock = 512;  ///< samples of a brick
    /// The solid keeps this many cells inside the box (shapes/mesh.sdf.h says the same).
    static constexpr int kAirCells = 8;

    vec3 lo, hi;                            ///< the box; the bricks reach a little beyond hi
    float cell = 0;                         ///< side of a fine cell
    int columns = 0, rows = 0, layers = 0;  ///< bricks along x, y, z
    /// For each point of the coarse lattice (x fastest, one more than bricks on each axis) its value and the block of the brick that
    /// begins there, or -1; padded to whole blocks. Then the bricks, a block each, x fastest.
    std::vector<float> values;
};

/// What compile() reads.
struct Source {
    std::span<const Edit> edits;
    std::span<const Object> objects;            ///< ObjectId::index refers here
    std::span<const HeightGrid> grids;          ///< Shape::data of a heightfield is the decimal index of its grid
    std::span<const GridPlace> placed{};        ///< the first grids, whose numbers a program holds already
    uint32_t samples = 0;                       ///< how many numbers it holds
    std::span<const MeshGrid> meshes{};         ///< likewise for `mesh`
    std::span<const uint32_t> placed_meshes{};  ///< blocks of the first meshes
    std::span<const uint32_t> owners{};         ///< EditSpan::owner by edit; none: the edits' own numbers
};

/// Where compile() found a fault.
struct Fault {
    uint32_t edit = UINT32_MAX;    ///< the edit it came through
    uint32_t object = UINT32_MAX;  ///< the object the node is in; UINT32_MAX: the edit's own node
    uint32_t node = 0;
    int warp = -1;  ///< entry of the node's domain, -1: none
};

/// Compiles all edits, row i being edit i. Fails on references to nothing, cycles, a repeat whose child does not fit its spacing, warps
/// that need a bounded child, bends past their limit, and trees that expand to more than 2^22 leaves. `fault`, if given, says where.
/// Parameter ranges are not checked here (see out_of_range). Any thread.
Result<Program> compile(const Source& source, Fault* fault = nullptr);

/// Order of an edit that compile() puts at `position`, and one between two others (0 and UINT64_MAX: no other there); 0 where the two
/// leave no room, and the list wants new numbers.
inline constexpr uint64_t order_at(uint64_t position) { return (uint64_t(1) << 62) + (position << 32); }
uint64_t order_between(uint64_t before, uint64_t after);

/// Adds `edit` to the world as a new row, and answers its number; with place and objects as compile(). Fails as compile(), and changes
/// nothing then. Costs what the edit costs. The owner's thread.
Result<uint32_t> insert(Program& program, const Edit& edit, std::span<const Object> objects,
                        std::span<const HeightGrid> grids, uint64_t order, uint32_t owner, Fault* fault = nullptr,
                        std::span<const MeshGrid> meshes = {});

}  // namespace kiln::sdf

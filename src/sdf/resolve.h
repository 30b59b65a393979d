// SPDX-License-Identifier: MIT
// Resolved source: every reference followed once, cycles refused, composites expanded to objects, bounds of every node known.
// What the tape compiler and the judge both start from; it decides nothing about distances.
#pragma once

#include "sdf/expression_code.h"
#include "sdf/program.h"

#include <map>
#include <vector>

namespace kiln::sdf {

/// How an entry with value f over its child is evaluated: rigid entries as f, others as the bounded leaf
/// max(min(f / lipschitz, margin), signed distance to the box of the solid after the entry).
struct EntryFactor {
    float lipschitz = 1;
    float margin = kEmpty;
    bool bounded = false;  ///< evaluated as a bounded leaf
    bool second[3] = {};   ///< Copies: axes along which two points see the child
    int copies() const { return 1 << (int(second[0]) + int(second[1]) + int(second[2])); }
};

/// Bounds of one node: solid of its bare content, then after each domain entry, then in its parent's space.
struct NodeBounds {
    std::vector<Box3> stages;          ///< [0] content, [i + 1] after domain[i]
    std::vector<EntryFactor> factors;  ///< of domain[i]
    Box3 parent;
    float rate = 1;       ///< (0, 1]: outside `parent` the node's value is at least rate · distance(p, parent)
    uint64_t leaves = 1;  ///< primitives it expands to, copies counted
};

/// Most primitives one world may expand to: what 22 value registers can serve (Sethi–Ullman: log2 + 1).
inline constexpr uint64_t kMaxLeaves = uint64_t(1) << 22;

struct Resolved {
    Source source;
    std::vector<Object> composites;                      ///< objects of composite shapes, numbered after source.objects
    std::vector<std::vector<NodeBounds>> object_bounds;  ///< by object, by node
    std::vector<NodeBounds> edit_bounds;                 ///< by edit; empty stages for hidden edits

    std::vector<float> samples;    ///< the grids and meshes that are not yet placed, one after another
    std::vector<GridPlace> grids;  ///< all
    std::vector<uint32_t> meshes;  ///< where each mesh begins among the program's samples, in blocks

    /// A shape's numbers with the internal fields of sampled shapes filled in.
    std::array<float, kMaxParams> params_of(const Shape& shape) const;

    const Object& object(uint32_t index) const {
        return index < source.objects.size() ? source.objects[index] : composites[index - source.objects.size()];
    }
    /// The object a node stands for: a reference or a composite shape; UINT32_MAX for primitives and folds.
    uint32_t object_of(const Node& node) const;
    /// Formulas of expressions, by their Shape's data and numbers.
    const PreparedFormula& formula_of(const Shape& shape) const;
    std::map<std::pair<uint16_t, std::array<float, kMaxParams>>, uint32_t> composite_index;
    std::map<std::pair<std::string_view, std::array<float, kMaxParams>>, std::shared_ptr<const PreparedFormula>>
        formulas;
};

/// Follows everything the visible edits reach. Faults as compile().
Result<Resolved> resolve(const Source& source, Fault* fault);

}  // namespace kiln::sdf

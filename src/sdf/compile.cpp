// SPDX-License-Identifier: MIT
// The tape compiler. Each edit's tree is expanded into binary nodes on an explicit stack (depth is limited by memory only):
// transforms run together into one affine map, scales and Lipschitz factors sink into the leaves' multipliers, repeats
// become unions of their nearest copies. Then registers are dealt out and the code is written.

#include "sdf/bounds.h"
#include "sdf/custom.h"
#include "sdf/expression_code.h"
#include "sdf/program.h"
#include "sdf/resolve.h"
#include "sdf/tables.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <mutex>
#include <string>

namespace kiln::sdf {
namespace {

constexpr uint32_t kNone = UINT32_MAX;
// What a formula may use before it keeps values in memory; trees around it need the others.
constexpr uint32_t kFormulaRegisters = 16;

// q = M · (p − t), in double until it is written to the tape.
struct AffineMap {
    std::array<double, 9> m{1, 0, 0, 0, 1, 0, 0, 0, 1};
    std::array<double, 3> t{};

    bool linear_identity() const { return m == std::array<double, 9>{1, 0, 0, 0, 1, 0, 0, 0, 1}; }
    bool identity() const { return linear_identity() && t == std::array<double, 3>{}; }
};

// From a node's parent space into its own: M = scale⁻¹ · rotation⁻¹, t = position.
AffineMap into_node(const Transform& transform) {
    AffineMap out;
    out.t = {transform.position.x, transform.position.y, transform.position.z};
    const quat& q = transform.rotation;
    const double x = q.x, y = q.y, z = q.z, w = q.w;
    const double n = x * x + y * y + z * z + w * w;  // exact unit length is not a float's to give
    const double s = n > 0 ? 2.0 / n : 0.0;
    const std::array<double, 9> rotation{1 - s * (y * y + z * z), s * (x * y - z * w),     s * (x * z + y * w),
                                         s * (x * y + z * w),     1 - s * (x * x + z * z), s * (y * z - x * w),
                                         s * (x * z - y * w),     s * (y * z + x * w),     1 - s * (x * x + y * y)};
    const double scale[3] = {transform.scale.x, transform.scale.y, transform.scale.z};
    for (size_t i = 0; i < 3; ++i) {
        for (size_t j = 0; j < 3; ++j) out.m[3 * i + j] = rotation[3 * j + i] / scale[i];
    }
    return out;
}

// First a, then b: M_b (M_a (p − t_a) − t_b) = M_b M_a (p − t_a − M_a⁻¹ t_b). M_a⁻¹ is solved for t_b by Cramer's rule.
AffineMap then(const AffineMap& a, const AffineMap& b) {
    AffineMap out;
    for (size_t i = 0; i < 3; ++i) {
        for (size_t j = 0; j < 3; ++j) {
            out.m[3 * i + j] = b.m[3 * i] * a.m[j] + b.m[3 * i + 1] * a.m[3 + j] + b.m[3 * i + 2] * a.m[6 + j];
        }
    }
    const auto det = [](const std::array<double, 9>& m) {
        return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
               m[2] * (m[3] * m[7] - m[4] * m[6]);
    };
    const double d = det(a.m);
    for (size_t column = 0; column < 3; ++column) {
        std::array<double, 9> replaced = a.m;
        for (size_t row = 0; row < 3; ++row) replaced[3 * row + column] = b.t[row];
        out.t[column] = a.t[column] + det(replaced) / d;
    }
    return out;
}

// One step of a point's way from the cell to a leaf; the way shares its beginning with others'.
struct ChainStep {
    uint32_t before;  // kNone: starts at the cell's point
    Opcode opcode;
    uint32_t aux;
    uint32_t param;
};

struct Binary {
    enum class Kind : uint8_t { Leaf, Value, Bound, Combine };
    Kind kind = Kind::Leaf;
    bool lacks_material = false;    // some leaf under it carries none
    uint8_t need = 1;               // registers
    Opcode opcode = Opcode::Shape;  // of a Leaf
    uint32_t aux = 0;
    uint32_t chain = kNone;
    uint32_t param = 0;
    uint32_t left = kNone, right = kNone;
    const Formula* source = nullptr;  // Leaf of an expression: `param` is its Result's
    const FormulaCode* formula = nullptr;
};

// A node still to be expanded into binary node `parent`'s left or right.
struct Task {
    const Node* node;
    const NodeBounds* bounds;
    uint32_t object;    // whose nodes the node's children are
    size_t entries;     // domain entries still to pass, last first
    bool entered;       // transform and material already applied
    AffineMap pending;  // since the chain's last step
    uint32_t chain;
    double scale;  // local metres to world metres, divided by the Lipschitz factors so far
    uint32_t material;
    uint32_t parent;
    bool right;
};

class Compiler {
public:
    Compiler(const Resolved& resolved, Program& out) : resolved_(resolved), out_(out) {}

    // Makes edit `e` of the source the program's next row.
    Result<void> add(uint32_t e, uint64_t order, uint32_t owner) {
        const Edit& edit = resolved_.source.edits[e];
        EditSpan span;
        span.op = edit.op;
        span.order = order;
        span.owner = owner;
        edit_ = e;
        row_ = uint32_t(out_.edits.size());
        params_first_ = uint32_t(out_.params.size());
        params_.clear();
        code_.clear();
        material_ = uint16_t(kNoMaterial);
        if (!edit.hidden) {
            const float k = edit.blend_radius;
            const float k_material = edit.material_blend_radius < 0 ? k : edit.material_blend_radius;
            expand(edit);
            formula_registers_ = kFormulaRegisters;
            write_formulas();
            deal_registers();
            for (uint32_t most = kFormulaRegisters / 2; nodes_[0].need >= kRegisters && most >= kFewestFormulaRegisters;
                 most /= 2) {
                formula_registers_ = most;
                write_formulas();
                deal_registers();
            }
            if (nodes_[0].need >= kRegisters)
                return Error{"edit " + edit.name + ": needs too many registers", ErrorKind::Input};
            emit(0, 1);
            const uint32_t at = add_params({k, k_material});
            const uint32_t flag = nodes_[0].lacks_material ? kMayLackMaterial : 0u;
            code_.push_back(Instruction::make(Opcode::Combine, uint32_t(edit.op) | flag, 0, 0, 1, at));
            span.material = material_;
            span.bounds = resolved_.edit_bounds[e].parent;
            span.blend = k;
            span.rate = resolved_.edit_bounds[e].rate;
            span.reach = std::max(k, k_material);
            span.first = uint32_t(out_.code.size());
            span.count = uint32_t(code_.size());
            out_.params.append(params_);
            out_.code.append(code_);
        }
        out_.edits.push_back(span);
        if (span.count > 0) out_.index.insert(span.indexed(row_));
        return {};
    }

private:
    uint32_t add_params(std::initializer_list<float> head, std::span<const float> tail = {}) {
        const uint32_t at = params_first_ + uint32_t(params_.size());
        params_.insert(params_.end(), head);
        params_.insert(params_.end(), tail.begin(), tail.end());
        return at;
    }

    uint32_t add_step(uint32_t before, Opcode opcode, uint32_t aux, uint32_t param) {
        steps_.push_back({before, opcode, aux, param});
        return uint32_t(steps_.size() - 1);
    }

    // The chain with the pending affine map written out.
    uint32_t flush(uint32_t chain, const AffineMap& map) {
        if (map.identity()) return chain != kNone ? chain : add_step(kNone, Opcode::PointCell, 0, 0);
        const auto f = [](double v) { return float(v); };
        if (chain == kNone && map.linear_identity()) {
            return add_step(kNone, Opcode::PointTranslate, 0, add_params({f(map.t[0]), f(map.t[1]), f(map.t[2])}));
        }
        const uint32_t at = add_params({f(map.t[0]), f(map.t[1]), f(map.t[2]), f(map.m[0]), f(map.m[1]), f(map.m[2]),
                                        f(map.m[3]), f(map.m[4]), f(map.m[5]), f(map.m[6]), f(map.m[7]), f(map.m[8])});
        return add_step(chain, chain == kNone ? Opcode::PointAffine : Opcode::PointAffineOn, 0, at);
    }

    uint32_t add_node(const Task& task, Binary node) {
        const uint32_t index = uint32_t(nodes_.size());
        nodes_.push_back(node);
        if (task.parent != kNone) (task.right ? nodes_[task.parent].right : nodes_[task.parent].left) = index;
        return index;
    }

    void expand(const Edit& edit) {
        nodes_.clear();
        steps_.clear();
        tasks_.clear();
        const bool shows_others = edit.op == Op::Subtract || edit.op == Op::Intersect;
        const uint32_t material = shows_others ? kNoMaterial : kDefaultMaterial;
        tasks_.push_back({&edit.node,
                          &resolved_.edit_bounds[edit_],
                          kNone,
                          edit.node.domain.size(),
                          false,
                          {},
                          kNone,
                          1.0,
                          material,
                          kNone,
                          false});
        while (!tasks_.empty()) {
            Task task = tasks_.back();
            tasks_.pop_back();
            if (!task.entered) {
                task.entered = true;
                const AffineMap map = into_node(task.node->transform);
                task.pending = task.pending.identity() ? map : then(task.pending, map);
                task.scale *= double(smallest_scale(task.node->transform));
                if (task.node->material) task.material = material_number(task.node->material);
            }
            pass_entries(task);
        }
    }

    // Walks the domain from its last entry to its first, then expands the content.
    void pass_entries(Task task) {
        while (task.entries > 0) {
            const size_t i = --task.entries;
            const Warp& warp = task.node->domain[i];
            const Box3& solid = task.bounds->stages[i + 1];
            const KindRow::How how = warp_rows()[warp.kind].how;
            const EntryFactor& factor = task.bounds->factors[i];
            if (factor.bounded) add_bound(task, flush(task.chain, task.pending), solid, factor.margin);
            task.scale /= double(factor.lipschitz);
            if (how == KindRow::Copies) {
                expand_copies(task, warp, task.bounds->stages[i], factor);
                return;
            }
            if (how == KindRow::Point) {
                task.chain = add_step(flush(task.chain, task.pending), Opcode::PointWarp, warp.kind,
                                      add_params({}, warp.params));
                task.pending = {};
            } else {
                Binary value;
                value.kind = Binary::Kind::Value;
                value.aux = warp.kind;
                value.chain = flush(task.chain, task.pending);
                value.param = add_params({float(task.scale), float(1.0 / task.scale)}, warp.params);
                task.parent = add_node(task, value);
                task.right = false;
            }
        }
        expand_content(task);
    }

    // R = max(min(R, m), signed distance(p, box)): resolve.cpp proves it.
    void add_bound(Task& task, uint32_t chain, const Box3& box, float margin) {
        Binary bound;
        bound.kind = Binary::Kind::Bound;
        bound.chain = chain;
        bound.param = add_params({float(task.scale), float(double(margin) * task.scale), box.min.x, box.min.y,
                                  box.min.z, box.max.x, box.max.y, box.max.z});
        task.parent = add_node(task, bound);
        task.right = false;
    }

    // A union of the two nearest copies an axis. In a repeat, a child that is not an exact distance is bounded by its box, so that where
    // the second nearest copy changes sides both candidates are their boxes' distances, which are equal there.
    void expand_copies(const Task& task, const Warp& warp, const Box3& child, const EntryFactor& factor) {
        float spacing = INFINITY;
        for (size_t axis = 0; axis < 3; ++axis) {
            if (factor.second[axis]) spacing = std::min(spacing, warp.params[axis]);
        }
        const auto middle = [](float lo, float hi) {
            return std::isfinite(lo) && std::isfinite(hi) ? 0.5f * (lo + hi) : 0.0f;
        };
        const vec3 center{middle(child.min.x, child.max.x), middle(child.min.y, child.max.y),
                          middle(child.min.z, child.max.z)};
        const bool exact = task.entries == 0 && task.node->kind == Node::Kind::Shape &&
                           shape_rows()[task.node->shape.kind].how == KindRow::Exact;
        const uint32_t chain = flush(task.chain, task.pending);
        const uint32_t copies = uint32_t(factor.copies());
        Task holder = task;
        for (uint32_t c = 0; c < copies; ++c) {
            Task copy = task;
            if (c + 1 < copies) {
                Binary both;
                both.kind = Binary::Kind::Combine;
                both.aux = uint32_t(Op::Union);
                both.param = add_params({0.0f, 0.0f});
                holder.parent = add_node(holder, both);
                holder.right = true;
                copy.right = false;
            } else {
                copy.right = holder.right;
            }
            copy.parent = holder.parent;
            float second[3] = {0, 0, 0};
            for (uint32_t axis = 0, bit = 0; axis < 3; ++axis) {
                if (factor.second[axis]) second[axis] = float(c >> bit++ & 1u);
            }
            copy.chain =
                add_step(chain, Opcode::PointCopy, warp.kind,
                         add_params({center.x, center.y, center.z, second[0], second[1], second[2]}, warp.params));
            copy.pending = {};
            if (!exact && !factor.bounded && copies > 1) add_bound(copy, copy.chain, child, 0.5f * spacing);
            tasks_.push_back(copy);
        }
    }

    void expand_content(const Task& task) {
        const Node& node = *task.node;
        if (const uint32_t object = resolved_.object_of(node); object != kNone) {
            const Object& inner = resolved_.object(object);
            Task root = task;
            root.node = &inner.nodes[0];
            root.bounds = &resolved_.object_bounds[object][0];
            root.object = object;
            root.entries = root.node->domain.size();
            root.entered = false;
            tasks_.push_back(root);
        } else if (node.kind == Node::Kind::Fold) {
            expand_fold(task);
        } else {
            add_leaf(task);
        }
    }

    // ((c0 op c1) op c2) …: the last operation is outermost.
    void expand_fold(const Task& task) {
        const Node& node = *task.node;
        const float scale = float(task.scale);
        const float k = node.blend_radius;
        const float k_material = node.material_blend_radius < 0 ? k : node.material_blend_radius;
        const bool shows_others = node.op == Op::Subtract || node.op == Op::Intersect;
        const Object& object = resolved_.object(task.object);
        const std::vector<NodeBounds>& bounds = resolved_.object_bounds[task.object];
        Task holder = task;
        for (size_t i = node.children.size(); i-- > 0;) {
            Task child = task;
            child.node = &object.nodes[node.children[i]];
            child.bounds = &bounds[node.children[i]];
            child.entries = child.node->domain.size();
            child.entered = false;
            if (i > 0) {
                Binary both;
                both.kind = Binary::Kind::Combine;
                both.aux = uint32_t(node.op);
                both.param = add_params({k * scale, k_material * scale});
                holder.parent = add_node(holder, both);
                holder.right = false;
                child.right = true;
                if (shows_others) child.material = kNoMaterial;
            } else {
                child.right = holder.right;
            }
            child.parent = holder.parent;
            tasks_.push_back(child);
        }
    }

    void add_leaf(const Task& task) {
        const Shape& shape = task.node->shape;
        if (shape_rows()[shape.kind].how == KindRow::Formula) {
            const PreparedFormula& prepared = resolved_.formula_of(shape);
            Binary formula;
            formula.source = &prepared.formula;
            return add_boxed(task, formula, prepared.lipschitz, {});
        }
        if (shape_rows()[shape.kind].how == KindRow::Custom) {
            const Result<CustomBounds> checked = check_custom(shape);
            Binary custom;
            if (checked->formula) {
                own_formulas_.push_back(checked->formula);
                custom.source = checked->formula.get();
                return add_boxed(task, custom, checked->lipschitz, {});
            }
            custom.opcode = Opcode::Custom;
            custom.aux = custom_index(shape.kind);
            return add_boxed(task, custom, checked->lipschitz, shape.params);
        }
        const std::array<float, kMaxParams> params = resolved_.params_of(shape);
        Binary leaf;
        leaf.aux = shape.kind;
        leaf.chain = flush(task.chain, task.pending);
        leaf.param = add_params({float(task.scale), float(task.material), float(row_)}, params);
        add_material(task, leaf);
        add_node(task, leaf);
    }

    void add_material(const Task& task, Binary& leaf) {
        leaf.lacks_material = task.material == kNoMaterial;
        if (leaf.lacks_material) return;
        const bool first = material_ == kNoMaterial;
        material_ = first || material_ == task.material ? uint16_t(task.material) : kSeveralMaterials;
    }

    // The bounded leaf of architecture §4 without a margin: the point is held in the box, where the slope's bound is proven, so
    // max(value, distance from the box) is 1-Lipschitz everywhere.
    void add_boxed(Task task, Binary leaf, float lipschitz, std::span<const float> params) {
        const Box3 box = shape_bounds(task.node->shape);
        const uint32_t chain = flush(task.chain, task.pending);
        Binary bound;
        bound.kind = Binary::Kind::Bound;
        bound.chain = chain;
        bound.param =
            add_params({float(task.scale), kEmpty, box.min.x, box.min.y, box.min.z, box.max.x, box.max.y, box.max.z});
        task.parent = add_node(task, bound);
        task.right = false;
        leaf.chain = add_step(chain, Opcode::PointClamp, 0,
                              add_params({box.min.x, box.min.y, box.min.z, box.max.x, box.max.y, box.max.z}));
        leaf.param = add_params({float(task.scale / double(lipschitz)), float(task.material), float(row_)}, params);
        add_material(task, leaf);
        add_node(task, leaf);
    }

    // The code of every formula of the edit, once each, for as many registers as formula_registers_ says.
    void write_formulas() {
        formulas_.clear();
        for (Binary& n : nodes_) {
            if (n.source == nullptr) continue;
            auto& written = formulas_[n.source];
            if (written.code.empty()) {
                written = formula_code(*n.source, formula_registers_);
                const uint32_t numbers = add_params({}, written.params);
                for (Instruction& in : written.code) in.param = reads_number(in.aux()) ? in.param + numbers : 0;
                out_.memory_slots = std::max(out_.memory_slots, written.memory_slots);
            }
            n.formula = &written;
            n.need = uint8_t(written.registers);
        }
    }

    // Children have higher indices than their parents, so one backward pass sees every child first.
    void deal_registers() {
        for (size_t i = nodes_.size(); i-- > 0;) {
            Binary& n = nodes_[i];
            if (n.kind == Binary::Kind::Leaf) continue;
            const Binary& l = nodes_[n.left];
            n.need = l.need;
            n.lacks_material = l.lacks_material;
            if (n.kind == Binary::Kind::Combine) {
                const Binary& r = nodes_[n.right];
                n.need = l.need == r.need ? uint8_t(l.need + 1) : std::max(l.need, r.need);
                n.lacks_material = n.lacks_material || r.lacks_material;
            }
        }
    }

    void emit_chain(uint32_t chain) {
        const size_t from = code_.size();
        for (uint32_t s = chain; s != kNone; s = steps_[s].before) {
            code_.push_back(Instruction::make(steps_[s].opcode, steps_[s].aux, 0, 0, 0, steps_[s].param));
        }
        std::reverse(code_.begin() + long(from), code_.end());
    }

    void emit_formula(const Binary& n, uint32_t dst) {
        for (const Instruction in : n.formula->code) {
            const Fn fn = Fn(in.aux() & kFnBits);
            const bool reads = operands(fn) > 0 || fn == Fn::Store;
            const uint32_t a = reads && (in.aux() & kNumberA) == 0 ? in.a() + dst : dst;
            const uint32_t b = operands(fn) == 2 && (in.aux() & kNumberB) == 0 ? in.b() + dst : dst;
            code_.push_back(Instruction::make(Opcode::Arithmetic, in.aux(), in.dst() + dst, a, b, in.param));
        }
        code_.push_back(Instruction::make(Opcode::Result, 0, dst, n.formula->result + dst, 0, n.param));
    }

    void emit(uint32_t root, uint32_t dst) {
        struct Visit {
            uint32_t node;
            uint32_t dst;
            int stage;
        };
        std::vector<Visit> stack{{root, dst, 0}};
        while (!stack.empty()) {
            const Visit v = stack.back();
            stack.pop_back();
            const Binary& n = nodes_[v.node];
            if (n.kind == Binary::Kind::Leaf) {
                emit_chain(n.chain);
                if (n.formula != nullptr) {
                    emit_formula(n, v.dst);
                    continue;
                }
                code_.push_back(Instruction::make(n.opcode, n.aux, v.dst, 0, 0, n.param));
            } else if (n.kind != Binary::Kind::Combine) {
                if (v.stage == 0) {
                    stack.push_back({v.node, v.dst, 1});
                    stack.push_back({n.left, v.dst, 0});
                } else {
                    emit_chain(n.chain);
                    const Opcode op = n.kind == Binary::Kind::Value ? Opcode::Value : Opcode::Bound;
                    code_.push_back(Instruction::make(op, n.aux, v.dst, 0, 0, n.param));
                }
            } else {
                const bool left_first = nodes_[n.left].need >= nodes_[n.right].need;
                if (v.stage == 0) {
                    stack.push_back({v.node, v.dst, 1});
                    stack.push_back({n.right, left_first ? v.dst + 1 : v.dst, 0});
                    stack.push_back({n.left, left_first ? v.dst : v.dst + 1, 0});
                    if (!left_first) std::swap(stack[stack.size() - 1], stack[stack.size() - 2]);
                } else {
                    const uint32_t a = left_first ? v.dst : v.dst + 1;
                    const uint32_t b = left_first ? v.dst + 1 : v.dst;
                    const uint32_t flag = nodes_[n.right].lacks_material ? kMayLackMaterial : 0u;
                    code_.push_back(Instruction::make(Opcode::Combine, n.aux | flag, v.dst, a, b, n.param));
                }
            }
        }
    }

    const Resolved& resolved_;
    Program& out_;
    uint32_t edit_ = 0, row_ = 0;
    uint16_t material_ = uint16_t(kNoMaterial);  // of the edit's leaves so far
    uint32_t params_first_ = 0;                  // where params_ will lie in the program
    std::vector<float> params_;
    std::vector<std::shared_ptr<const Formula>> own_formulas_;  // of the program's own shapes, while they are compiled
    std::vector<Instruction> code_;
    std::vector<Binary> nodes_;
    std::map<const Formula*, FormulaCode> formulas_;
    uint32_t formula_registers_ = kFormulaRegisters;
    std::vector<ChainStep> steps_;
    std::vector<Task> tasks_;
};

// What every program begins with: the number that instructions without numbers name.
void begin(Program& program) {
    if (program.params.empty()) program.params.push_back(0);
}

void adopt_grids(Program& program, const Resolved& resolved) {
    program.samples.append(resolved.samples);
    program.grids = resolved.grids;
    program.meshes = resolved.meshes;
}

}  // namespace

struct Program::Tape {
    std::once_flag once;
    std::vector<Instruction> code;
};

std::vector<uint32_t> Program::rows() const {
    std::vector<uint32_t> out;
    index.all(out);
    std::sort(out.begin(), out.end(), [this](uint32_t a, uint32_t b) { return edits[a].order < edits[b].order; });
    return out;
}

std::span<const Instruction> Program::tape() const {
    static constexpr Instruction kNothing[] = {Instruction::make(Opcode::Empty, 0, 0, 0, 0, 0)};
    if (!tape_) return kNothing;
    std::call_once(tape_->once, [this] {
        std::vector<Instruction>& out = tape_->code;
        out.push_back(kNothing[0]);
        for (const uint32_t row : rows()) {
            const auto part = code.subspan(edits[row].first, edits[row].count);
            out.insert(out.end(), part.begin(), part.end());
        }
    });
    return tape_->code;
}

void Program::settle() {
    unbounded = index.fills_space();
    bounds = unbounded ? box_union(index.solids(), index.others()) : index.solids();
    tape_ = std::make_shared<Tape>();
}

void Program::remove(uint32_t row) {
    if (edits[row].count > 0) index.remove(edits[row].indexed(row));
    settle();
}

void Program::number_anew(std::span<const uint32_t> rows) {
    std::vector<EditSpan> next(edits.begin(), edits.end());
    for (size_t i = 0; i < rows.size(); ++i) next[rows[i]].order = order_at(i);
    edits = {};
    edits.append(next);
    ++numbering;
    settle();
}

uint64_t order_between(uint64_t before, uint64_t after) {
    if (before == 0 && after == UINT64_MAX) return order_at(0);
    if (before == 0) return after - std::min(after / 2, uint64_t(1) << 32);
    if (after == UINT64_MAX) return before + std::min((after - before) / 2, uint64_t(1) << 32);
    const uint64_t middle = before + (after - before) / 2;
    return middle == before ? 0 : middle;
}

Result<Program> compile(const Source& source, Fault* fault) {
    auto resolved = resolve(source, fault);
    if (!resolved) return resolved.error();
    Program out;
    begin(out);
    Compiler compiler(*resolved, out);
    for (uint32_t e = 0; e < source.edits.size(); ++e) {
        if (auto r = compiler.add(e, order_at(e), source.owners.empty() ? e : source.owners[e]); !r) return r.error();
    }
    adopt_grids(out, *resolved);
    out.settle();
    return out;
}

Result<uint32_t> insert(Program& program, const Edit& edit, std::span<const Object> objects,
                        std::span<const HeightGrid> grids, uint64_t order, uint32_t owner, Fault* fault,
                        std::span<const MeshGrid> meshes) {
    const Source source{{&edit, 1}, objects,       grids, program.grids, uint32_t(program.samples.size()),
                        meshes,     program.meshes};
    auto resolved = resolve(source, fault);
    if (!resolved) return resolved.error();
    begin(program);
    const uint32_t row = uint32_t(program.edits.size());
    if (auto r = Compiler(*resolved, program).add(0, order, owner); !r) return r.error();
    adopt_grids(program, *resolved);
    program.settle();
    return row;
}

}  // namespace kiln::sdf

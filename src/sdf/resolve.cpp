// SPDX-License-Identifier: MIT
// References are followed depth first with a stack of its own; bounds go from the leaves up.
//
// Bounds and rates. Every step keeps one promise: outside its box B a node's value v is at least rate · distance(p, B), 0 < rate <= 1.
// So the solid lies in B, and a value's growth away from B is known where scales and Lipschitz factors have divided it.
// - A primitive's value is at least the distance to its box: rate 1.
// - Transform: a world length is at most (largest scale) times the local one, the value is multiplied by the smallest.
// - A value entry moves the surface out by at most a where the child's value is a distance: v >= rate · distance(p, B) - a, which is
//   rate · distance(p, B') for B' = B inflated by a / rate.
// - An entry evaluated as a bounded leaf, and a copy of a repeat that is, are at least the distance to their box: rate 1.
// - Mirror and elongate move each coordinate on its own, never nearer to B's interval than the point is to B's interval after them.
// - Folds: see fold_bounds.

#include "sdf/resolve.h"

#include "sdf/bounds.h"
#include "sdf/custom.h"
#include "sdf/library/library.h"
#include "sdf/tables.h"

#include <kiln/shapes.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace kiln::sdf {
namespace {

constexpr float kSmallestRate = 1e-18f;

bool is_mesh(const Shape& shape) { return ShapeKind(shape.kind) == ShapeKind::SampledMesh; }
bool is_composite(const Shape& shape) { return shape_rows()[shape.kind].how == KindRow::Composite; }
bool is_copies(const Warp& warp) { return warp_rows()[warp.kind].how == KindRow::Copies; }

Error fail(Fault* fault, const Fault& where, std::string message) {
    if (fault != nullptr) *fault = where;
    return Error{std::move(message), ErrorKind::Input};
}

// A box and how fast the value grows outside it, as NodeBounds::rate.
struct Hull {
    Box3 box;
    float rate = 1;
};

// A smooth union of n values, none below x, is nowhere below x - k · bulge(n): with s = x - k u so far, the next is at worst x itself,
// and smooth_min(s, x, k) = s - k (1 - u)² / 4. Rises towards 1 as 1 - 4 / n.
float bulge(size_t n) {
    float u = 0;
    for (size_t i = 1; i < n; ++i) u += 0.25f * (1 - u) * (1 - u);
    return u;
}

// Which child each face of an intersection's box is of, and what the faces together promise. A point outside the box is off it by d_i
// along at most three axes, each beyond one face; children c with these faces have values v >= rate_c · |(d_i of c's faces)|, and
// the intersection's is no less than any of them, so |d|² <= v² · sum over those children of 1 / rate_c².
class Faces {
public:
    explicit Faces(const NodeBounds& first) : box_(first.parent) { rates_.push_back(first.rate); }

    void intersect(const NodeBounds& next) {
        const Box3 shared = box_intersection(box_, next.parent);
        // Disjoint boxes: the solid is empty, but later entries still need some finite box to be proven on.
        if (shared.empty()) return;
        const vec3 &lo = shared.min, &hi = shared.max;
        const bool moved[6] = {lo.x > box_.min.x, lo.y > box_.min.y, lo.z > box_.min.z,
                               hi.x < box_.max.x, hi.y < box_.max.y, hi.z < box_.max.z};
        for (size_t face = 0; face < 6; ++face) {
            if (moved[face]) owner_[face] = rates_.size();
        }
        rates_.push_back(next.rate);
        box_ = shared;
    }

    Hull hull() const {
        const float faces[6] = {box_.min.x, box_.min.y, box_.min.z, box_.max.x, box_.max.y, box_.max.z};
        double most = 1;
        for (size_t corner = 0; corner < 8; ++corner) {
            double sum = 0;
            for (size_t axis = 0; axis < 3; ++axis) {
                const auto side = [&](size_t a) { return a + 3 * (corner >> a & 1u); };
                bool counted = !std::isfinite(faces[side(axis)]);  // nothing is beyond it
                for (size_t a = 0; a < axis; ++a)
                    counted = counted || (std::isfinite(faces[side(a)]) && owner_[side(a)] == owner_[side(axis)]);
                const double rate = double(rates_[owner_[side(axis)]]);
                if (!counted) sum += 1 / (rate * rate);
            }
            most = std::max(most, sum);
        }
        return {box_, float(1 / std::sqrt(most))};
    }

private:
    Box3 box_;
    std::vector<float> rates_;
    std::array<size_t, 6> owner_{};  // of the faces -x -y -z +x +y +z, an index of rates_
};

// Union: a value >= rate · distance to its own box, hence to the common one, with the smallest rate. Subtract and intersect are no
// less than their operands d and (d, e), blended or not.
Hull fold_bounds(const Node& node, const std::vector<NodeBounds>& nodes) {
    const NodeBounds& first = nodes[node.children[0]];
    if (node.op == Op::Subtract || node.op == Op::Paint) return {first.parent, first.rate};
    if (node.op == Op::Intersect) {
        Faces faces(first);
        for (size_t i = 1; i < node.children.size(); ++i) faces.intersect(nodes[node.children[i]]);
        return faces.hull();
    }
    Hull out{first.parent, first.rate};
    for (size_t i = 1; i < node.children.size(); ++i) {
        out.box = box_union(out.box, nodes[node.children[i]].parent);
        out.rate = std::min(out.rate, nodes[node.children[i]].rate);
    }
    out.box = out.box.inflated(node.blend_radius * bulge(node.children.size()) / out.rate);
    return out;
}

bool has_face(const Box3& box) {
    return std::isfinite(box.min.x) || std::isfinite(box.min.y) || std::isfinite(box.min.z) ||
           std::isfinite(box.max.x) || std::isfinite(box.max.y) || std::isfinite(box.max.z);
}

// A repeat needs its child's bounds to fit one spacing on every axis that it repeats.
const char* repeat_fault(const Warp& warp, const Box3& child) {
    if (warp.kind != uint16_t(WarpKind::Repeat)) return nullptr;
    const float size[3] = {child.max.x - child.min.x, child.max.y - child.min.y, child.max.z - child.min.z};
    for (size_t axis = 0; axis < 3; ++axis) {
        const float spacing = warp.params[axis];
        if (spacing <= 0 || warp.params[3 + axis] == 1) continue;
        if (!(size[axis] <= spacing * 1.0001f))
            return "the repeated shape is wider than the spacing; use a larger spacing or a smaller shape";
    }
    return nullptr;
}

// Bounded leaf of an entry that moves points, with f(p) = child(map(p)), the child 1-Lipschitz, its solid in its box B, value and B
// keeping the promise of the head comment. N is B inflated by M, in the child's space; L the map's largest stretch where it leads
// into N. Outside N the child's value is at least rate · M, so u = min(f / L, m) with m = rate · M / L is
//   - m at every point that the map takes out of N,
//   - 1-Lipschitz along a way whose image stays in N, for f changes by at most L times the way.
// Any straight way is made of such pieces (u is m where they meet, also where the map jumps, if it jumps from outside N to outside
// N), so u is 1-Lipschitz; so is the signed distance to a box, hence their maximum. u has the child's sign, and in the box of the
// solid after the entry the box's distance is negative: the solid is the child's image. Nothing is asked of the map outside N.
EntryFactor entry_factor(const Warp& warp, const Hull& child, const Box3& after) {
    constexpr float inf = std::numeric_limits<float>::infinity();
    const auto second = [&](const Box3& region) {
        return is_copies(warp) ? second_copies(warp, region) : vec3{0, 0, 0};
    };
    EntryFactor out;
    const auto see = [&](const Box3& region) {
        const vec3 s = second(region);
        out.second[0] = s.x != 0, out.second[1] = s.y != 0, out.second[2] = s.z != 0;
    };
    const float everywhere = warp_lipschitz(warp, {{-inf, -inf, -inf}, {inf, inf, inf}});
    if (everywhere == 1.0f) {
        see(child.box);
        return out;
    }
    if (warp_rows()[warp.kind].how == KindRow::Value) {
        // 1-Lipschitz everywhere once divided; the box makes it grow with rate 1.
        out.lipschitz = everywhere;
        out.bounded = has_face(after);
        return out;
    }
    out.bounded = true;
    const float least = warp_lipschitz(warp, child.box);
    const vec3 half = child.box.half_extents();
    float size = 0;
    for (float extent : {half.x, half.y, half.z}) size = std::max(size, std::isfinite(extent) ? extent : 0.0f);
    if (size == 0) size = 1;  // a solid without size, or without an end
    // The wider the margin, the farther the value stays close to the true distance, but the larger the factor. One that needs no
    // second copy is preferred unless it is narrow.
    for (bool alone : {true, false}) {
        for (float share = 0.25f; share > (alone ? 0.05f : 1e-3f); share *= 0.5f) {
            const Box3 region = child.box.inflated(share * size);
            const float l = warp_lipschitz(warp, region);
            if (!std::isfinite(l) || l > 2.0f * least || (alone && second(region) != second(child.box))) continue;
            out.lipschitz = l;
            out.margin = child.rate * share * size / l;
            see(region);
            return out;
        }
    }
    out.lipschitz = inf;
    return out;
}

// Largest difference between neighbours along x and along z.
vec2 steepest_steps(const HeightGrid& grid) {
    vec2 step;
    for (int z = 0; z < grid.rows; ++z) {
        for (int x = 0; x < grid.columns; ++x) {
            const float v = grid.values[size_t(z * grid.columns + x)];
            if (x > 0) step.x = std::max(step.x, std::fabs(v - grid.values[size_t(z * grid.columns + x - 1)]));
            if (z > 0) step.y = std::max(step.y, std::fabs(v - grid.values[size_t((z - 1) * grid.columns + x)]));
        }
    }
    return step;
}

class Resolver {
public:
    Resolver(Resolved& out, Fault* fault) : out_(out), fault_(fault) {}

    Result<void> run() {
        const Source& s = out_.source;
        for (const GridPlace& place : s.placed) out_.grids.push_back(place);
        for (size_t i = s.placed.size(); i < s.grids.size(); ++i) {
            const HeightGrid& grid = s.grids[i];
            out_.grids.push_back({s.samples + uint32_t(out_.samples.size()), steepest_steps(grid)});
            out_.samples.insert(out_.samples.end(), grid.values.begin(), grid.values.end());
        }
        out_.meshes.assign(s.placed_meshes.begin(), s.placed_meshes.end());
        for (size_t i = s.placed_meshes.size(); i < s.meshes.size(); ++i) {
            const size_t block = (s.samples + out_.samples.size() + MeshGrid::kBlock - 1) / MeshGrid::kBlock;
            out_.meshes.push_back(uint32_t(block));
            out_.samples.resize(block * MeshGrid::kBlock - s.samples);
            out_.samples.insert(out_.samples.end(), s.meshes[i].values.begin(), s.meshes[i].values.end());
        }
        // Texts count samples in 32 bits.
        if (s.samples + out_.samples.size() > size_t(1) << 31)
            return fail(fault_, where_,
                        "its height images and meshes have more than 2147483648 samples; lower \"resolution\"");
        collect_composites();
        const size_t objects = s.objects.size() + out_.composites.size();
        state_.assign(objects, Unseen);
        out_.object_bounds.resize(objects);
        out_.edit_bounds.resize(s.edits.size());
        uint64_t leaves = 0;
        for (uint32_t e = 0; e < s.edits.size(); ++e) {
            if (s.edits[e].hidden) continue;
            where_ = {};
            where_.edit = e;
            const Node& node = s.edits[e].node;
            if (node.kind == Node::Kind::Fold)
                return fail(fault_, where_, "an edit has no children of its own; name an object");
            if (auto r = visit_object_of(node); !r) return r;
            where_.object = UINT32_MAX;
            where_.node = 0;
            if (auto r = bound_node(node, nullptr, out_.edit_bounds[e]); !r) return r;
            leaves += out_.edit_bounds[e].leaves;
            if (leaves > kMaxLeaves) {
                return fail(fault_, where_,
                            "the edits up to here expand to more than 4194304 primitives; use fewer copies");
            }
        }
        return {};
    }

private:
    enum State : uint8_t { Unseen, Open, Done };

    // Every composite shape in reach becomes one object per distinct parameter set.
    void collect_composites() {
        const auto add = [&](const Node& node) {
            if (node.kind != Node::Kind::Shape || !is_composite(node.shape)) return;
            const auto key = std::pair(node.shape.kind, node.shape.params);
            const auto index = uint32_t(out_.source.objects.size() + out_.composites.size());
            if (out_.composite_index.emplace(key, index).second) {
                out_.composites.push_back(composite_object(node.shape.kind, node.shape.params));
            }
        };
        for (const Object& o : out_.source.objects) std::for_each(o.nodes.begin(), o.nodes.end(), add);
        for (const Edit& e : out_.source.edits) {
            if (!e.hidden) add(e.node);
        }
        for (size_t i = 0; i < out_.composites.size(); ++i) {
            const std::vector<Node> nodes = out_.composites[i].nodes;  // a copy: adding may move the vector
            std::for_each(nodes.begin(), nodes.end(), add);
        }
    }

    // Depth-first over references, with a stack of its own: chains of references may be as long as memory allows.
    Result<void> visit_object_of(const Node& node) {
        if (node.kind == Node::Kind::Fold) return {};
        if (node.kind == Node::Kind::Shape && !is_composite(node.shape)) return {};
        struct Level {
            uint32_t object;
            uint32_t next_node;
        };
        std::vector<Level> stack;
        const auto enter = [&](uint32_t object) -> Result<void> {
            const size_t count = out_.source.objects.size() + out_.composites.size();
            if (object >= count || out_.object(object).nodes.empty()) {
                return fail(fault_, where_, "refers to an object that does not exist");
            }
            if (state_[object] == State::Open)
                return fail(fault_, where_, "object contains itself: " + cycle(stack, object));
            if (state_[object] == State::Unseen) {
                state_[object] = State::Open;
                stack.push_back({object, 0});
            }
            return {};
        };
        if (auto r = enter(out_.object_of(node)); !r) return r;
        while (!stack.empty()) {
            const uint32_t index = stack.back().object;
            const Object& object = out_.object(index);
            bool descended = false;
            while (stack.back().next_node < object.nodes.size()) {
                const uint32_t n = stack.back().next_node++;
                const uint32_t inner = out_.object_of(object.nodes[n]);
                if (inner == UINT32_MAX && object.nodes[n].kind != Node::Kind::Object) continue;
                where_.object = index;
                where_.node = n;
                const size_t depth = stack.size();
                if (auto r = enter(inner); !r) return r;
                if (stack.size() > depth) {
                    descended = true;
                    break;
                }
            }
            if (descended) continue;
            if (auto r = bound_object(index); !r) return r;
            state_[index] = State::Done;
            stack.pop_back();
        }
        return {};
    }

    template <typename Stack>
    std::string cycle(const Stack& stack, uint32_t object) const {
        std::string text;
        bool inside = false;
        for (const auto& open : stack) {
            inside = inside || open.object == object;
            if (inside) text += out_.object(open.object).name + " -> ";
            if (text.size() > 300) return text + "… -> " + out_.object(object).name;
        }
        return text + out_.object(object).name;
    }

    Result<void> bound_object(uint32_t index) {
        const Object& object = out_.object(index);
        std::vector<NodeBounds>& bounds = out_.object_bounds[index];
        bounds.resize(object.nodes.size());
        where_.object = index;
        for (uint32_t n = uint32_t(object.nodes.size()); n-- > 0;) {
            where_.node = n;
            for (uint32_t child : object.nodes[n].children) {
                if (child <= n || child >= object.nodes.size())
                    return fail(fault_, where_, "a child must come after its parent");
            }
            if (auto r = bound_node(object.nodes[n], &bounds, bounds[n]); !r) return r;
        }
        return {};
    }

    Result<void> prepare(const Shape& shape) {
        auto& slot = out_.formulas[std::pair(std::string_view(shape.data), shape.params)];
        if (slot) return {};
        const float* p = shape.params.data();  // lipschitz, half_extents
        auto made = prepare_formula(shape.data, {p[1], p[2], p[3]}, p[0]);
        if (!made) return fail(fault_, where_, made.error().message);
        slot = *made;
        return {};
    }

    // Shape::data is the index of a grid with at least 2 x 2 values, or of a mesh.
    bool has_grid(const Shape& shape) const {
        size_t index = 0;
        const auto end = shape.data.data() + shape.data.size();
        const auto [rest, error] = std::from_chars(shape.data.data(), end, index);
        if (error != std::errc{} || rest != end) return false;
        if (is_mesh(shape)) return index < out_.source.meshes.size();
        if (index >= out_.source.grids.size()) return false;
        const HeightGrid& grid = out_.source.grids[index];
        return grid.columns >= 2 && grid.rows >= 2 && grid.values.size() == size_t(grid.columns) * size_t(grid.rows);
    }

    Result<void> bound_node(const Node& node, const std::vector<NodeBounds>* nodes, NodeBounds& out) {
        where_.warp = -1;
        Hull hull;
        Box3& box = hull.box;
        uint64_t leaves = 1;
        if (node.kind == Node::Kind::Fold) {
            if (node.children.empty()) return fail(fault_, where_, "a node with `op` needs at least one child");
            hull = fold_bounds(node, *nodes);
            leaves = 0;
            for (uint32_t child : node.children) leaves += (*nodes)[child].leaves;
        } else if (const uint32_t object = out_.object_of(node); object != UINT32_MAX) {
            hull = {out_.object_bounds[object][0].parent, out_.object_bounds[object][0].rate};
            leaves = out_.object_bounds[object][0].leaves;
        } else {
            if (shape_rows()[node.shape.kind].how == KindRow::Sampled && !has_grid(node.shape)) {
                return fail(fault_, where_, "refers to a file that was not loaded");
            }
            if (shape_rows()[node.shape.kind].how == KindRow::Formula) {
                if (auto r = prepare(node.shape); !r) return r;
            }
            if (shape_rows()[node.shape.kind].how == KindRow::Custom) {
                if (auto r = check_custom(node.shape); !r) return fail(fault_, where_, r.error().message);
            }
            Shape shape = node.shape;
            shape.params = out_.params_of(node.shape);
            box = shape_bounds(shape);
        }
        out.stages.clear();
        out.factors.clear();
        out.stages.push_back(box);
        for (size_t i = 0; i < node.domain.size(); ++i) {
            const Warp& warp = node.domain[i];
            where_.warp = int(i);
            if (const char* why = repeat_fault(warp, box)) return fail(fault_, where_, why);
            const Box3 after = warp_bounds(warp, box, hull.rate);
            const EntryFactor factor = entry_factor(warp, hull, after);
            if (std::isinf(factor.lipschitz)) {
                return fail(fault_, where_,
                            warp.kind == uint16_t(WarpKind::Bend) && box.finite()
                                ? "bends this shape through the centre of its circle or twice around it; use a smaller "
                                  "curvature or shape"
                                : "needs a shape of finite size; use it on a bounded shape");
            }
            // Copies of a repeat are exact or bounded by their boxes.
            if (factor.bounded || factor.copies() > 1) hull.rate = 1;
            box = after;
            leaves *= uint64_t(factor.copies());
            out.stages.push_back(box);
            out.factors.push_back(factor);
            leaves = std::min(leaves, uint64_t(1) << 40);
        }
        where_.warp = -1;
        if (leaves > kMaxLeaves)
            return fail(fault_, where_, "expands to more than 4194304 primitives; use fewer copies");
        out.leaves = leaves;
        out.parent = transformed_box(box, node.transform);
        out.rate = hull.rate * smallest_scale(node.transform) / largest_scale(node.transform);
        // No box promises anything of a value that is this much squeezed.
        if (!(out.rate >= kSmallestRate)) {
            const float inf = std::numeric_limits<float>::infinity();
            out.parent = {{-inf, -inf, -inf}, {inf, inf, inf}};
            out.rate = kSmallestRate;
        }
        return {};
    }

    Resolved& out_;
    Fault* fault_;
    Fault where_;
    std::vector<State> state_;
};

}  // namespace

uint32_t Resolved::object_of(const Node& node) const {
    if (node.kind == Node::Kind::Object) return node.object.index;
    if (node.kind == Node::Kind::Shape && is_composite(node.shape)) {
        return composite_index.at({node.shape.kind, node.shape.params});
    }
    return UINT32_MAX;
}

std::array<float, kMaxParams> Resolved::params_of(const Shape& shape) const {
    std::array<float, kMaxParams> params = shape.params;
    if (shape_rows()[shape.kind].how != KindRow::Sampled) return params;
    size_t index = 0;  // checked by the resolver
    std::from_chars(shape.data.data(), shape.data.data() + shape.data.size(), index);
    if (is_mesh(shape)) {
        const MeshGrid& mesh = source.meshes[index];
        for (const FieldRow& field : shape_rows()[shape.kind].fields()) {
            const size_t at = size_t(field.offset);
            const auto put = [&](vec3 v) {
                params[at] = v.x;
                params[at + 1] = v.y;
                params[at + 2] = v.z;
            };
            if (field.name == "first") params[at] = float(meshes[index]);
            if (field.name == "lo") put(mesh.lo);
            if (field.name == "hi") put(mesh.hi);
            if (field.name == "cell") params[at] = mesh.cell;
            if (field.name == "columns") params[at] = float(mesh.columns);
            if (field.name == "rows") params[at] = float(mesh.rows);
        }
        return params;
    }
    const HeightGrid& grid = source.grids[index];
    for (const FieldRow& field : shape_rows()[shape.kind].fields()) {
        if (field.range != "internal") continue;
        const size_t at = size_t(field.offset);
        if (field.name == "first") params[at] = float(grids[index].first);
        if (field.name == "columns") params[at] = float(grid.columns);
        if (field.name == "rows") params[at] = float(grid.rows);
        if (field.name == "step_x") params[at] = grids[index].steps.x;
        if (field.name == "step_z") params[at] = grids[index].steps.y;
    }
    return params;
}

const PreparedFormula& Resolved::formula_of(const Shape& shape) const {
    return *formulas.at(std::pair(std::string_view(shape.data), shape.params));
}

Result<Resolved> resolve(const Source& source, Fault* fault) {
    Resolved out;
    out.source = source;
    if (auto r = Resolver(out, fault).run(); !r) return r.error();
    return out;
}

}  // namespace kiln::sdf

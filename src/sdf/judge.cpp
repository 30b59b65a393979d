// SPDX-License-Identifier: MIT
// A small machine with a stack of its own (trees may be as deep as memory allows). A frame is either a node seen from its parent
// (level < 0) or the stage of a node after `level` entries of its domain.

#include "sdf/judge.h"

#include "sdf/bounds.h"
#include "sdf/custom.h"
#include "sdf/eval_isa.h"
#include "sdf/resolve.h"
#include "sdf/tables.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace kiln::sdf {

namespace judging {
#define KILN_SCALAR double
#include "sdf/lang/scalar.h"

#include "sdf/lang/trig_exact.h"

#include "sdf/texts.gen.inl"
}  // namespace judging

using judging::real3;

namespace {

constexpr uint32_t kNone = UINT32_MAX;

real3 into_node(const Transform& transform, real3 p) {
    const double q[4] = {transform.rotation.x, transform.rotation.y, transform.rotation.z, transform.rotation.w};
    const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    // Conjugate of the unit quaternion: u = −(x, y, z)/n, w/n.
    const real3 u(-q[0] / n, -q[1] / n, -q[2] / n);
    const double w = q[3] / n;
    const real3 v = p - real3(transform.position.x, transform.position.y, transform.position.z);
    const auto cross = [](real3 a, real3 b) {
        return real3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
    };
    const real3 t = cross(u, v) * 2.0;
    const real3 turned = v + t * w + cross(u, t);
    return real3(turned.x / double(transform.scale.x), turned.y / double(transform.scale.y),
                 turned.z / double(transform.scale.z));
}

real3 to_real3(vec3 v) { return real3(v.x, v.y, v.z); }

double box_distance(real3 p, const Box3& box) {
    const real3 q = max(to_real3(box.min) - p, p - to_real3(box.max));
    return length(max(q, real3(0, 0, 0))) + std::min(std::max({q.x, q.y, q.z}), 0.0);
}

double combine(Op op, double a, double b, double k) {
    return op == Op::Paint ? a : judging::op_distance(uint32_t(op), a, b, k);
}

struct Frame {
    const Node* node;
    const NodeBounds* bounds;
    uint32_t object;
    int level;
    real3 p;
    uint32_t step = 0;  // children or copies already asked for
    double value = 0;   // folded so far
};

}  // namespace

struct Judge::Prepared {
    Resolved resolved;
};

Result<Judge> Judge::create(const Source& source) {
    auto resolved = resolve(source, nullptr);
    if (!resolved) return resolved.error();
    auto prepared = std::make_shared<Prepared>();
    prepared->resolved = std::move(*resolved);
    Judge judge;
    judge.prepared_ = std::move(prepared);
    return judge;
}

double Judge::distance(dvec3 p_world) const {
    const Resolved& r = prepared_->resolved;
    std::vector<Frame> stack;
    double result = double(kEmpty);
    for (size_t e = 0; e < r.source.edits.size(); ++e) {
        const Edit& edit = r.source.edits[e];
        if (edit.hidden) continue;
        stack.push_back({&edit.node, &r.edit_bounds[e], kNone, -1, real3(p_world.x, p_world.y, p_world.z)});
        double answer = 0;  // of the frame that has just finished
        while (!stack.empty()) {
            Frame& f = stack.back();
            const Node& node = *f.node;
            if (f.level < 0) {
                if (f.step++ == 0) {
                    stack.push_back(
                        {f.node, f.bounds, f.object, int(node.domain.size()), into_node(node.transform, f.p)});
                } else {
                    answer *= double(smallest_scale(node.transform));
                    stack.pop_back();
                }
                continue;
            }
            if (f.level > 0) {
                const size_t entry = size_t(f.level - 1);
                const Warp& warp = node.domain[entry];
                const KindRow::How how = warp_rows()[warp.kind].how;
                const Box3& solid = f.bounds->stages[entry + 1];
                const EntryFactor& factor = f.bounds->factors[entry];
                const Box3& child = f.bounds->stages[entry];
                const auto middle = [](float lo, float hi) {
                    return std::isfinite(lo) && std::isfinite(hi) ? 0.5 * (double(lo) + double(hi)) : 0.0;
                };
                const real3 center(middle(child.min.x, child.max.x), middle(child.min.y, child.max.y),
                                   middle(child.min.z, child.max.z));
                // All eight corners of the two nearest an axis; where an axis has one copy they coincide or lie outside the region.
                const uint32_t copies = how == KindRow::Copies ? 8 : 1;
                const auto seen = [&](uint32_t c) {
                    if (how == KindRow::Point) return judging::point_warp(warp.kind, f.p, warp.params.data());
                    if (how == KindRow::Value) return f.p;
                    return judging::copy_warp(warp.kind, f.p, warp.params.data(), center,
                                              real3(c & 1u, c >> 1 & 1u, c >> 2 & 1u));
                };
                if (f.step > 0) {
                    const bool exact = entry == 0 && node.kind == Node::Kind::Shape &&
                                       shape_rows()[node.shape.kind].how == KindRow::Exact;
                    if (how == KindRow::Copies && !factor.bounded && factor.copies() > 1 && !exact) {
                        double spacing = INFINITY;
                        for (size_t axis = 0; axis < 3; ++axis) {
                            if (factor.second[axis]) spacing = std::min(spacing, double(warp.params[axis]));
                        }
                        answer = std::max(std::min(answer, 0.5 * spacing), box_distance(seen(f.step - 1), child));
                    }
                    f.value = f.step == 1 ? answer : std::min(f.value, answer);
                }
                if (f.step < copies) {
                    const Frame next{f.node, f.bounds, f.object, f.level - 1, seen(f.step++)};
                    stack.push_back(next);
                    continue;
                }
                answer = f.value;
                if (how == KindRow::Value) answer = judging::value_warp(warp.kind, answer, f.p, warp.params.data());
                answer /= double(factor.lipschitz);
                if (factor.bounded)
                    answer = std::max(std::min(answer, double(factor.margin)), box_distance(f.p, solid));
                stack.pop_back();
                continue;
            }
            // The bare content.
            if (const uint32_t object = r.object_of(node); object != kNone) {
                if (f.step++ == 0) {
                    const Frame next{&r.object(object).nodes[0], &r.object_bounds[object][0], object, -1, f.p};
                    stack.push_back(next);
                } else {
                    stack.pop_back();
                }
            } else if (node.kind == Node::Kind::Fold) {
                if (f.step > 0) {
                    f.value = f.step == 1 ? answer : combine(node.op, f.value, answer, double(node.blend_radius));
                }
                if (f.step == node.children.size()) {
                    answer = f.value;
                    stack.pop_back();
                } else {
                    const uint32_t child = node.children[f.step++];
                    const Frame next{&r.object(f.object).nodes[child], &r.object_bounds[f.object][child], f.object, -1,
                                     f.p};
                    stack.push_back(next);
                }
            } else if (shape_rows()[node.shape.kind].how == KindRow::Formula) {
                const PreparedFormula& formula = r.formula_of(node.shape);
                const Box3 box = shape_bounds(node.shape);
                const real3 q = clamp(f.p, to_real3(box.min), to_real3(box.max));
                const double value = evaluate(formula.formula, {q.x, q.y, q.z});
                const double known = std::fabs(value) < double(kEmpty) ? value : double(kEmpty);
                answer = std::max(known / double(formula.lipschitz), box_distance(f.p, box));
                stack.pop_back();
            } else if (shape_rows()[node.shape.kind].how == KindRow::Custom) {
                const Box3 box = shape_bounds(node.shape);
                const real3 q = clamp(f.p, to_real3(box.min), to_real3(box.max));
                const Result<CustomBounds> custom = check_custom(node.shape);
                double value = 0;
                if (custom->formula) {
                    value = evaluate(*custom->formula, {q.x, q.y, q.z});
                } else {
                    custom_distances(custom_index(node.shape.kind), node.shape.params.data(), {&q.x, &q.y, &q.z, 1},
                                     &value);
                }
                const double known = std::fabs(value) < double(kEmpty) ? value : double(kEmpty);
                answer = std::max(known / double(custom->lipschitz), box_distance(f.p, box));
                stack.pop_back();
            } else {
                const std::array<float, kMaxParams> params = r.params_of(node.shape);
                answer =
                    judging::shape_distance(node.shape.kind, f.p, params.data(), judging::Samples{r.samples.data()});
                stack.pop_back();
            }
        }
        result = combine(edit.op, result, answer, double(edit.blend_radius));
    }
    return result;
}

}  // namespace kiln::sdf

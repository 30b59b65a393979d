// SPDX-License-Identifier: MIT
#include "sdf/regions.h"

#include "sdf/prune.h"

#include <algorithm>
#include <cmath>

namespace kiln::sdf {
namespace {

constexpr size_t kShort = 24;  // instructions that are not worth halving
constexpr int kMostDepth = 28;
constexpr size_t kMostKept = 8u << 20;  // instructions: 64 MiB
constexpr double kRootScenes = 64;      // the root's side in sides of the scene
constexpr double kHalfDiagonal = 1.7320509;

}  // namespace

double region_margin(dvec3 center, double half) { return 1e-4 * (1 + 0.01 * (largest(center) + half)); }

bool Regions::Node::contains(dvec3 p) const {
    return std::abs(p.x - center.x) <= half && std::abs(p.y - center.y) <= half && std::abs(p.z - center.z) <= half;
}

Regions::Node::~Node() {
    for (std::atomic<const Node*>& one : children) delete one.load(std::memory_order_relaxed);
}

Regions::Regions(const Program& program) : program_(program) {
    const Box3& box = program.bounds;
    scene_half_ = 1;
    if (!box.empty() && box.finite()) {
        const vec3 c = box.center(), h = box.half_extents();
        root_.center = {double(c.x), double(c.y), double(c.z)};
        scene_half_ = std::max({double(h.x), double(h.y), double(h.z), 1e-3});
    }
    root_.half = scene_half_ * kRootScenes;
    root_.code.assign(program.tape().begin(), program.tape().end());
}

const Regions::Node* Regions::child(const Node& node, int octant) const {
    std::atomic<const Node*>& place = const_cast<Node&>(node).children[size_t(octant)];
    if (const Node* made = place.load(std::memory_order_acquire)) return made;
    if (node.code.size() <= kShort || node.depth >= kMostDepth || node.idle >= kMostIdle ||
        instructions_.load(std::memory_order_relaxed) > kMostKept)
        return nullptr;
    auto fresh = std::make_unique<Node>();
    fresh->half = 0.5 * node.half;
    const auto middle = [&](double center, int bit) {
        return center + ((octant >> bit & 1) != 0 ? fresh->half : -fresh->half);
    };
    fresh->center = {middle(node.center.x, 0), middle(node.center.y, 1), middle(node.center.z, 2)};
    fresh->depth = node.depth + 1;
    thread_local PruneScratch scratch;
    const vec3 center{float(fresh->center.x), float(fresh->center.y), float(fresh->center.z)};
    // The centre is rounded to float: a little more room for that.
    const double radius =
        kHalfDiagonal * (fresh->half + region_margin(fresh->center, fresh->half)) + 1e-6 * largest(fresh->center);
    prune(view(program_, node.code), center, float(radius * 1.0001), fresh->code, scratch);
    fresh->code.shrink_to_fit();
    const bool shrank = 5 * fresh->code.size() <= 4 * node.code.size();
    fresh->idle = fresh->half < scene_half_ && !shrank ? node.idle + 1 : 0;
    const Node* none = nullptr;
    if (place.compare_exchange_strong(none, fresh.get(), std::memory_order_acq_rel)) {
        instructions_.fetch_add(fresh->code.size(), std::memory_order_relaxed);
        return fresh.release();
    }
    return none;  // another thread was first, with the same bits
}

const Regions::Node* Regions::leaf(dvec3 p) const {
    if (!root_.contains(p)) return nullptr;
    const Node* node = &root_;
    while (true) {
        const int octant =
            (p.x > node->center.x ? 1 : 0) | (p.y > node->center.y ? 2 : 0) | (p.z > node->center.z ? 4 : 0);
        const Node* next = child(*node, octant);
        if (next == nullptr) return node;
        node = next;
    }
}

TapeView Regions::tape_around(dvec3 center, double half) const {
    const auto holds = [&](const Node& n) {
        return std::abs(center.x - n.center.x) + half <= n.half && std::abs(center.y - n.center.y) + half <= n.half &&
               std::abs(center.z - n.center.z) + half <= n.half;
    };
    if (!holds(root_)) return view(program_);
    const Node* node = &root_;
    while (true) {
        const int octant = (center.x > node->center.x ? 1 : 0) | (center.y > node->center.y ? 2 : 0) |
                           (center.z > node->center.z ? 4 : 0);
        const Node* next = child(*node, octant);
        if (next == nullptr || !holds(*next)) return view(program_, node->code);
        node = next;
    }
}

TapeView Regions::tape(dvec3 p, Cursor& cursor) const {
    if (cursor == nullptr || !cursor->contains(p)) cursor = leaf(p);
    return cursor != nullptr ? view(program_, cursor->code) : view(program_);
}

double Regions::at(dvec3 p, Cursor& cursor) const { return evaluate(tape(p, cursor), p); }

}  // namespace kiln::sdf

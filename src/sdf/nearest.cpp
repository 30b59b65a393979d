// SPDX-License-Identifier: MIT
#include "sdf/nearest.h"

#include "sdf/prune.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

namespace kiln::sdf {
namespace {

constexpr int kMostParts = 1600000;  // about a second; only surfaces that are everywhere equally near need so many
constexpr int kPatience =
    3;  // halvings, which may bring a box into a smaller region; as many until code may have become shorter
constexpr double kInfinity = std::numeric_limits<double>::infinity();

dvec3 operator+(dvec3 a, dvec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
dvec3 operator-(dvec3 a, dvec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
dvec3 operator*(dvec3 a, double s) { return {a.x * s, a.y * s, a.z * s}; }
double dot(dvec3 a, dvec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
double length(dvec3 a) { return std::sqrt(dot(a, a)); }

// A box that may hold the nearest point, and its code: a region's, or a piece of the search's own.
struct Part {
    dvec3 center, half;
    double least;  // no surface point in it is nearer
    double zeros;  // no zero of its code's operands is
    const Regions::Node* node;
    size_t first, count;
    int idle;                                                                // times that its code was pruned to no use
    int until;                                                               // halvings until it is pruned again
    bool operator<(const Part& other) const { return least > other.least; }  // the nearest on top
};

class Search {
public:
    Search(const Regions& regions, dvec3 p, double within, double tolerance)
        : regions_(regions), p_(p), tolerance_(tolerance), found_(within) {}

    Nearest run() {
        const double value = regions_.at(p_, cursor_);
        if (!(std::abs(value) < double(kEmptyTest))) return {};
        side_ = value < 0 ? -1 : 1;
        free_ = std::abs(value);
        least_ = free_;
        if (free_ > found_) return answer();
        look_around();
        if (!near_enough()) branch_and_bound();
        return answer();
    }

private:
    // Beyond this, nothing can better the answer.
    bool near_enough() const { return hit_ && found_ - least_ <= tolerance_; }
    double worth() const { return hit_ ? found_ - tolerance_ : found_; }

    Nearest answer() const {
        if (!hit_) return {.found = false, .distance = 0, .least = std::min(least_, found_), .point = {}};
        return {true, found_, std::min(least_, found_), point_};
    }

    double side_value(dvec3 q) { return side_ * regions_.at(q, cursor_); }

    // Metres from p along the unit vector u to the other side; infinity when it is not met before `limit`.
    double trace(dvec3 u, double limit) {
        const double rounding = 1e-12 * (1 + largest(p_) + std::min(limit, 1e6));
        double before = 0, t = free_;
        for (int i = 0; i < 1000; ++i) {
            if (t > limit) return kInfinity;
            const double d = side_value(p_ + u * t);
            if (d <= 0) {
                for (int k = 0; k < 60 && t - before > rounding; ++k) {
                    const double middle = 0.5 * (before + t);
                    (side_value(p_ + u * middle) > 0 ? before : t) = middle;
                }
                return t;
            }
            before = t;
            t += std::max(d, rounding);
        }
        return kInfinity;
    }

    // True when the surface along u is the nearest so far.
    bool try_towards(dvec3 u) {
        const double size = length(u);
        if (!(size > 0)) return false;
        u = u * (1 / size);
        const double t = trace(u, found_);
        if (!(t < found_) && !(t <= found_ && !hit_)) return false;
        hit_ = true;
        found_ = t;
        point_ = p_ + u * t;
        return true;
    }

    dvec3 gradient(dvec3 q) {
        const double h = 1e-6 * (1 + 0.1 * largest(q));
        const auto slope = [&](dvec3 step) { return side_value(q + step) - side_value(q - step); };
        const dvec3 g{slope({h, 0, 0}), slope({0, h, 0}), slope({0, 0, h})};
        const double size = length(g);
        return size > 0 ? g * (1 / size) : dvec3{};
    }

    // Slides the point found along the surface towards p while that helps.
    void slide() {
        for (int i = 0; i < 24; ++i) {
            const dvec3 normal = gradient(point_);
            const dvec3 back = p_ - point_;
            const dvec3 along = back - normal * dot(back, normal);
            if (length(along) <= 1e-9 * (1 + found_)) return;
            bool better = false;
            const double before = found_;
            for (double part = 1; part > 1e-3 && !better; part *= 0.35)
                better = try_towards(point_ + along * part - p_);
            if (!better || before - found_ <= 1e-3 * tolerance_) return;
        }
    }

    // A first answer, cheaply: down the gradient, else towards the scene and along the axes.
    void look_around() {
        try_towards(gradient(p_) * -1.0);
        if (!hit_) {
            try_towards(regions_.root().center - p_);
            for (const dvec3 axis : {dvec3{1, 0, 0}, dvec3{0, 1, 0}, dvec3{0, 0, 1}}) {
                try_towards(axis);
                try_towards(axis * -1.0);
            }
        }
        if (hit_) slide();
    }

    TapeView tape_of(const Part& part) const {
        const std::span<const Instruction> code = part.node != nullptr
                                                      ? std::span<const Instruction>(part.node->code)
                                                      : std::span(own_).subspan(part.first, part.count);
        return view(regions_.program(), code);
    }

    // Draws the box in around what of it lies in the ball that a better answer must come from. False when nothing does. Most boxes
    // that are left late lie across that ball's border, and only a corner of them has to be shown free.
    bool draw_in(Part& part) const {
        const double within = worth(), room = 1e-12 * (1 + largest(p_) + within);
        const dvec3 d = p_ - part.center;
        const auto gap = [](double off, double half) { return std::max(std::abs(off) - half, 0.0); };
        const dvec3 gaps{gap(d.x, part.half.x), gap(d.y, part.half.y), gap(d.z, part.half.z)};
        const double far = dot(gaps, gaps);
        if (far >= within * within) return false;
        part.least = std::max(part.least, std::sqrt(far));
        if (!std::isfinite(within)) return true;
        const auto draw = [&](double p, double own_gap, double& center, double& half) {
            const double reach = std::sqrt(within * within - (far - own_gap * own_gap)) + room;
            const double low = std::max(center - half, p - reach), high = std::min(center + half, p + reach);
            if (high - low >= 2 * half) return;
            center = 0.5 * (low + high);
            half = std::max(0.5 * (high - low), 0.0) + room;
        };
        draw(p_.x, gaps.x, part.center.x, part.half.x);
        draw(p_.y, gaps.y, part.center.y, part.half.y);
        draw(p_.z, gaps.z, part.center.z, part.half.z);
        return true;
    }

    static bool holds(const Regions::Node& node, const Part& part) {
        const dvec3 d = part.center - node.center;
        return std::abs(d.x) + part.half.x <= node.half && std::abs(d.y) + part.half.y <= node.half &&
               std::abs(d.z) + part.half.z <= node.half;
    }

    // The least code at hand that is right in the box.
    void find_code(Part& part) {
        bool whole = false;  // the region is as small as regions get
        while (part.node != nullptr && !whole) {
            const dvec3 c = part.node->center;
            const int octant =
                (part.center.x > c.x ? 1 : 0) | (part.center.y > c.y ? 2 : 0) | (part.center.z > c.z ? 4 : 0);
            const Regions::Node* child = regions_.child(*part.node, octant);
            whole = child == nullptr;
            if (whole || !holds(*child, part)) break;
            part.node = child;
            part.zeros = -1;
            part.idle = 0;
            part.until = kPatience;
        }
        if (part.until > 0 && !(whole && part.idle == 0)) {
            --part.until;
            return;
        }
        const double radius = (length(part.half) + 1e-6 * largest(part.center)) * 1.0001;
        const TapeView tape = tape_of(part);
        const size_t before = tape.code.size();
        prune(tape, {float(part.center.x), float(part.center.y), float(part.center.z)}, float(radius), kept_, scratch_);
        part.idle = kept_.size() < before ? 0 : std::min(part.idle + 1, kMostIdle);
        part.until = kPatience * part.idle;
        if (part.idle > 0) return;
        part.node = nullptr;
        part.first = own_.size();
        part.count = kept_.size();
        own_.insert(own_.end(), kept_.begin(), kept_.end());
        part.zeros = -1;
    }

    void push(Part part) {
        if (!draw_in(part)) return;
        find_code(part);
        if (part.zeros < 0) part.zeros = zero_bound(tape_of(part), p_);
        part.least = std::max(part.least, part.zeros);
        if (part.least >= worth()) return;
        const double value = side_ * evaluate(tape_of(part), part.center);
        if (value > length(part.half) + 1e-12 * (1 + largest(part.center))) return;
        if (value <= 0 && try_towards(part.center - p_)) slide();
        queue_.push(part);
    }

    // Both halves, across the longest side.
    void push_halves(const Part& part) {
        for (const double side : {-0.5, 0.5}) {
            Part half = part;
            const dvec3 h = part.half;
            const bool x = h.x >= h.y && h.x >= h.z, y = !x && h.y >= h.z;
            double& length = x ? half.half.x : y ? half.half.y : half.half.z;
            (x ? half.center.x : y ? half.center.y : half.center.z) += side * length;
            length *= 0.5;
            push(half);
        }
    }

    // The box around everything that can matter.
    void push_start() {
        const Regions::Node& root = regions_.root();
        const double around = largest(p_ - root.center);
        const auto cube = [&](dvec3 center, double half, const Regions::Node* node) {
            push({center, {half, half, half}, least_, -1, node, 0, own_.size(), 0, kPatience});
        };
        if (around + found_ <= root.half || (around < root.half && !std::isfinite(found_))) {
            cube(root.center, root.half, &root);
            return;
        }
        const std::span<const Instruction> tape = regions_.program().tape();
        own_.assign(tape.begin(), tape.end());
        cube(p_, std::isfinite(found_) ? found_ : 2 * (around + root.half), nullptr);
    }

    void branch_and_bound() {
        push_start();
        double undecided = kInfinity;  // least of the boxes that are too small to halve
        int parts = 0;
        while (!queue_.empty()) {
            const Part part = queue_.top();
            least_ = std::max(least_, std::min({part.least, undecided, found_}));
            if (near_enough() || part.least >= worth()) break;
            if (++parts > kMostParts) return;
            queue_.pop();
            if (largest(part.half) < 1e-3 * tolerance_) {
                undecided = std::min(undecided, part.least);
                continue;
            }
            push_halves(part);
        }
        least_ = std::max(least_, std::min(undecided, worth()));
    }

    const Regions& regions_;
    const dvec3 p_;
    const double tolerance_;
    double side_ = 1;
    double free_ = 0;   // no surface is nearer to p
    double least_ = 0;  // proven so far
    double found_;      // distance of point_, or how far to look
    bool hit_ = false;
    dvec3 point_;
    Regions::Cursor cursor_ = nullptr;
    std::priority_queue<Part> queue_;
    std::vector<Instruction> own_, kept_;
    PruneScratch scratch_;
};

dvec3 turned(quat q, dvec3 v) {
    const dvec3 u{double(q.x), double(q.y), double(q.z)};
    const auto cross = [](dvec3 a, dvec3 b) {
        return dvec3{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    };
    const dvec3 t = cross(u, v) * 2.0;
    return v + t * double(q.w) + cross(u, t);
}

}  // namespace

Nearest nearest_surface(const Regions& regions, dvec3 p, double within, double tolerance) {
    return Search(regions, p, within, tolerance).run();
}

bool solid_in_box(const Regions& regions, dvec3 center, vec3 half, quat rotation, double tolerance) {
    struct Part {
        dvec3 middle, half;  // in the box's frame
        double gap;          // no solid is nearer to its middle than the gap and its half diagonal together
        bool operator<(const Part& other) const { return gap > other.gap; }
    };
    Regions::Cursor cursor = nullptr;
    std::priority_queue<Part> queue;
    bool solid = false;
    const auto push = [&](dvec3 middle, dvec3 half_part) {
        const double radius = length(half_part);
        const double value = regions.at(center + turned(rotation, middle), cursor);
        solid = solid || value <= 0 || (value <= radius && radius < tolerance);
        if (value <= radius) queue.push({middle, half_part, value - radius});
    };
    push({}, {double(half.x), double(half.y), double(half.z)});
    for (int parts = 0; !solid && !queue.empty(); ++parts) {
        if (parts > kMostParts) return true;
        const Part part = queue.top();
        queue.pop();
        dvec3 h = part.half, step{};
        double& longest = h.x >= h.y && h.x >= h.z ? h.x : h.y >= h.z ? h.y : h.z;
        double& along = &longest == &h.x ? step.x : &longest == &h.y ? step.y : step.z;
        longest *= 0.5;
        along = longest;
        push(part.middle - step, h);
        push(part.middle + step, h);
    }
    return solid;
}

}  // namespace kiln::sdf

// SPDX-License-Identifier: MIT
#include "sdf/nearest.h"

#include "sdf/prune.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

namespace kiln::sdf {
namespace {

constexpr double kHalfDiagonal = 1.7320509;
constexpr int kMostCubes = 1600000;  // about a second; only surfaces that are everywhere equally near need so many
constexpr double kInfinity = std::numeric_limits<double>::infinity();

dvec3 operator+(dvec3 a, dvec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
dvec3 operator-(dvec3 a, dvec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
dvec3 operator*(dvec3 a, double s) { return {a.x * s, a.y * s, a.z * s}; }
double dot(dvec3 a, dvec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
double length(dvec3 a) { return std::sqrt(dot(a, a)); }
double largest(dvec3 p) { return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}); }

double distance_to_cube(dvec3 p, dvec3 center, double half) {
    const auto axis = [half](double d) { return std::max(std::abs(d) - half, 0.0); };
    const dvec3 d = p - center;
    return length({axis(d.x), axis(d.y), axis(d.z)});
}

// A cube that may hold the nearest point, and its code: a region's, or a piece of the search's own.
struct Cube {
    dvec3 center;
    double half;
    double least;  // no surface point in it is nearer
    const Regions::Node* node;
    size_t first, count;
    bool operator<(const Cube& other) const { return least > other.least; }  // the nearest on top
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

    TapeView tape_of(const Cube& cube) const {
        const std::span<const Instruction> code = cube.node != nullptr
                                                      ? std::span<const Instruction>(cube.node->code)
                                                      : std::span(own_).subspan(cube.first, cube.count);
        return view(regions_.program(), code);
    }

    void push(Cube cube) {
        cube.least = std::max(cube.least, distance_to_cube(p_, cube.center, cube.half));
        if (cube.least >= worth()) return;
        cube.least = std::max(cube.least, zero_bound(tape_of(cube), p_));
        if (cube.least < worth()) queue_.push(cube);
    }

    void push_child(const Cube& parent, int octant) {
        Cube cube = parent;
        cube.half = 0.5 * parent.half;
        const auto middle = [&](double c, int bit) { return c + ((octant >> bit & 1) != 0 ? cube.half : -cube.half); };
        cube.center = {middle(parent.center.x, 0), middle(parent.center.y, 1), middle(parent.center.z, 2)};
        if (distance_to_cube(p_, cube.center, cube.half) >= worth()) return;
        cube.node = parent.node != nullptr ? regions_.child(*parent.node, octant) : nullptr;
        if (cube.node == nullptr) {
            const double radius = (kHalfDiagonal * cube.half + 1e-6 * largest(cube.center)) * 1.0001;
            prune(tape_of(parent), {float(cube.center.x), float(cube.center.y), float(cube.center.z)}, float(radius),
                  kept_, scratch_);
            cube.first = own_.size();
            cube.count = kept_.size();
            own_.insert(own_.end(), kept_.begin(), kept_.end());
        }
        push(cube);
    }

    // The cube around everything that can matter.
    void push_start() {
        const Regions::Node& root = regions_.root();
        const double around = largest(p_ - root.center);
        if (around + found_ <= root.half || (around < root.half && !std::isfinite(found_))) {
            push({root.center, root.half, least_, &root, 0, 0});
            return;
        }
        const std::span<const Instruction> tape = regions_.program().tape();
        own_.assign(tape.begin(), tape.end());
        const double half = std::isfinite(found_) ? found_ : 2 * (around + root.half);
        push({p_, half, least_, nullptr, 0, own_.size()});
    }

    void branch_and_bound() {
        push_start();
        double undecided = kInfinity;  // least of the cubes that are too small to halve
        int cubes = 0;
        while (!queue_.empty()) {
            const Cube cube = queue_.top();
            least_ = std::max(least_, std::min({cube.least, undecided, found_}));
            if (near_enough() || cube.least >= worth()) break;
            if (++cubes > kMostCubes) return;
            queue_.pop();
            const double value = side_ * evaluate(tape_of(cube), cube.center);
            const double radius = kHalfDiagonal * cube.half;
            if (value > radius + 1e-12 * (1 + largest(cube.center))) continue;
            if (value <= 0) {
                if (try_towards(cube.center - p_)) slide();
            }
            if (cube.half < 1e-3 * tolerance_) {
                undecided = std::min(undecided, cube.least);
                continue;
            }
            for (int octant = 0; octant < 8; ++octant) push_child(cube, octant);
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
    std::priority_queue<Cube> queue_;
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
        if (parts > kMostCubes) return true;
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

// SPDX-License-Identifier: MIT
#include "field/reference_ray.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace kiln::field {
namespace {

struct Line {
    std::array<double, 3> origin, direction;  // texels
    std::array<double, 3> at(double t) const {
        return {origin[0] + direction[0] * t, origin[1] + direction[1] * t, origin[2] + direction[2] * t};
    }
};

// Where the line is between the planes low and high of all three axes.
bool clip(const Line& line, const std::array<double, 3>& low, const std::array<double, 3>& high, double& enter,
          double& leave) {
    for (size_t axis = 0; axis < 3; ++axis) {
        if (line.direction[axis] == 0) {
            if (line.origin[axis] < low[axis] || line.origin[axis] > high[axis]) return false;
            continue;
        }
        double a = (low[axis] - line.origin[axis]) / line.direction[axis],
               b = (high[axis] - line.origin[axis]) / line.direction[axis];
        if (a > b) std::swap(a, b);
        enter = std::max(enter, a);
        leave = std::min(leave, b);
    }
    return enter <= leave;
}

// Visits the unit cubes (of `side` texels) between enter and leave in order: fn(index, from, to) until it returns true.
template <typename Fn>
bool walk(const Line& line, double side, double enter, double leave, Fn&& fn) {
    std::array<int, 3> index;
    const std::array<double, 3> start = line.at(enter);
    for (size_t axis = 0; axis < 3; ++axis) {
        const double v = start[axis] / side;
        index[axis] = int(std::floor(v));
        // On a plane, going down: the cube below it.
        if (double(index[axis]) == v && line.direction[axis] < 0) --index[axis];
    }
    double t = enter;
    while (true) {
        double next = leave;
        size_t through = 3;
        for (size_t axis = 0; axis < 3; ++axis) {
            if (line.direction[axis] == 0) continue;
            const double plane = side * double(index[axis] + (line.direction[axis] > 0 ? 1 : 0));
            const double crossing = (plane - line.origin[axis]) / line.direction[axis];
            if (crossing < next) {
                next = crossing;
                through = axis;
            }
        }
        if (fn(index, t, std::max(t, next))) return true;
        if (through == 3) return false;
        t = std::max(t, next);
        index[through] += line.direction[through] > 0 ? 1 : -1;
    }
}

struct Voxel {
    double v[2][2][2];  // [z][y][x]
    std::array<double, 3> low;

    double at(const std::array<double, 3>& p) const {
        double w[3];
        for (size_t axis = 0; axis < 3; ++axis) w[axis] = std::clamp(p[axis] - low[axis], 0.0, 1.0);
        double sum = 0;
        for (int i = 0; i < 8; ++i) {
            const int x = i & 1, y = (i >> 1) & 1, z = i >> 2;
            sum += v[z][y][x] * (x != 0 ? w[0] : 1 - w[0]) * (y != 0 ? w[1] : 1 - w[1]) * (z != 0 ? w[2] : 1 - w[2]);
        }
        return sum;
    }
};

// The line in one voxel, cut where its cubic's derivative vanishes: from, …, to.
std::array<double, 4> cut(const Voxel& voxel, const Line& line, double from, double to, int& count) {
    count = 0;
    std::array<double, 4> cuts{};
    cuts[size_t(count++)] = from;
    const double f0 = voxel.at(line.at(from)), f1 = voxel.at(line.at(from + (to - from) / 3)),
                 f2 = voxel.at(line.at(from + 2 * (to - from) / 3)), f3 = voxel.at(line.at(to));
    // Newton's forward differences on the thirds, u = 3 s.
    const double d1 = f1 - f0, d2 = f2 - 2 * f1 + f0, d3 = f3 - 3 * f2 + 3 * f1 - f0;
    // f = f0 + u d1 + u (u − 1) d2 / 2 + u (u − 1)(u − 2) d3 / 6
    const double a = d3 / 2, b = d2 - d3, c = d1 - d2 / 2 + d3 / 3;
    double roots[2];
    int found = 0;
    if (std::fabs(a) > 1e-14) {
        const double disc = b * b - 4 * a * c;
        if (disc > 0) {
            const double q = -0.5 * (b + (b < 0 ? -1 : 1) * std::sqrt(disc));
            roots[found++] = q / a;
            if (q != 0) roots[found++] = c / q;
        }
    } else if (b != 0) {
        roots[found++] = -c / b;
    }
    if (found == 2 && roots[0] > roots[1]) std::swap(roots[0], roots[1]);
    for (int i = 0; i < found; ++i) {
        if (roots[i] > 0 && roots[i] < 3) cuts[size_t(count++)] = from + (to - from) * roots[i] / 3;
    }
    cuts[size_t(count++)] = to;
    return cuts;
}

double bisect(const Voxel& voxel, const Line& line, double low, double high) {
    for (int i = 0; i < 100; ++i) {
        const double middle = 0.5 * (low + high);
        (voxel.at(line.at(middle)) > 0 ? low : high) = middle;
    }
    return high;
}

// Speed through the lattice plane that the line is on at t.
double through_face(const Line& line, double t) {
    const std::array<double, 3> p = line.at(t);
    double nearest = 1, speed = 1;
    for (size_t axis = 0; axis < 3; ++axis) {
        const double off = std::fabs(p[axis] - std::round(p[axis]));
        if (off < nearest) nearest = off, speed = std::fabs(line.direction[axis]);
    }
    return speed;
}

}  // namespace

ReferenceHit reference_ray(const HostBricks& bricks, const TexelRay& ray, double t_max) {
    Line line;
    line.origin = {double(ray.whole.x) + double(ray.part.x), double(ray.whole.y) + double(ray.part.y),
                   double(ray.whole.z) + double(ray.part.z)};
    line.direction = {double(ray.direction.x), double(ray.direction.y), double(ray.direction.z)};
    const GridParams grid = bricks.field().grid();
    const std::array<double, 3> low{double(grid.cell_x) * 7, double(grid.cell_y) * 7, double(grid.cell_z) * 7};
    const std::array<double, 3> high{low[0] + double(grid.size_x) * 7, low[1] + double(grid.size_y) * 7,
                                     low[2] + double(grid.size_z) * 7};
    ReferenceHit hit;
    double enter = 0, leave = t_max;
    if (!clip(line, low, high, enter, leave)) return hit;

    double last = 1e30;  // value before the current piece
    bool falling = false;
    bool done = false;  // the minimum after the hit has been seen
    // One monotone piece's end.
    const auto follow = [&](double value) {
        if (falling && value >= last) {
            hit.least = std::min(hit.least, std::fabs(last));
            if (hit.state == kMarchHit) done = true;
        }
        falling = value < last;
        last = value;
    };
    walk(line, kBrickVoxels, enter, leave, [&](const std::array<int, 3>& cell, double from, double to) {
        if (cell[0] < grid.cell_x || cell[1] < grid.cell_y || cell[2] < grid.cell_z ||
            cell[0] >= grid.cell_x + grid.size_x || cell[1] >= grid.cell_y + grid.size_y ||
            cell[2] >= grid.cell_z + grid.size_z) {
            return false;
        }
        const uint32_t word = bricks.field().cell_word(cell[0], cell[1], cell[2]);
        if ((word & kCellOccupied) == 0) {
            if (hit.state == kMarchHit) return true;
            last = 1e30;
            falling = false;
            if ((word & kCellInside) == 0) return false;
            hit.state = kMarchInside;
            hit.t = from;
            return true;
        }
        return walk(line, 1, from, to, [&](const std::array<int, 3>& global, double a, double b) {
            Voxel voxel;
            ivec3 local;
            int* const of[3] = {&local.x, &local.y, &local.z};
            for (size_t axis = 0; axis < 3; ++axis) {
                *of[axis] = std::clamp(global[axis] - cell[axis] * kBrickVoxels, 0, kBrickVoxels - 1);
                voxel.low[axis] = double(cell[axis] * kBrickVoxels + *of[axis]);
            }
            for (int i = 0; i < 8; ++i) {
                const int x = i & 1, y = (i >> 1) & 1, z = i >> 2;
                voxel.v[z][y][x] = double(bricks.texel(word & kCellSlotMask, local.x + x, local.y + y, local.z + z));
            }
            int count = 0;
            const std::array<double, 4> cuts = cut(voxel, line, a, b, count);
            for (int i = 0; i < count; ++i) {
                const double value = voxel.at(line.at(cuts[size_t(i)]));
                if (i > 0 || last > 1e29)
                    follow(value);  // a voxel starts with the value that the one before ended with
                if (hit.state == kMarchMiss && value <= 0) {
                    hit.state = kMarchHit;
                    hit.t = i == 0 ? cuts[0] : bisect(voxel, line, cuts[size_t(i - 1)], cuts[size_t(i)]);
                    hit.slope =
                        i == 0 && a == enter
                            ? through_face(line, a)
                            : std::fabs(voxel.at(line.at(hit.t - 1e-5)) - voxel.at(line.at(hit.t + 1e-5))) / 2e-5;
                }
                if (hit.state == kMarchHit && (done || value < -1e-2)) return true;
            }
            return false;
        });
    });
    return hit;
}

}  // namespace kiln::field

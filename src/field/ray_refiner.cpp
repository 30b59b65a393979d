// SPDX-License-Identifier: MIT
#include "field/ray_refiner.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace kiln::field {
namespace {

constexpr int kSearchLooks = 8;       // along a stretch of a ray
constexpr int kSearchRounds = 3;      // each on a stretch some 3.5 times shorter
constexpr float kSearchMore = 0.25f;  // voxels before and behind the voxel that was passed
constexpr float kSlopeStep = 0.125f;  // voxels between the two looks that a slope is taken from
constexpr float kNearEnough = 0.02f;  // voxels: one more step from there ends within a tenth of it, slopes being known
constexpr float kFlattest = -0.02f;
constexpr int kPolishRounds = 6;
constexpr float kFurthest = 1.5f;      // voxels: a surface further away is another one
constexpr uint32_t kRemembered = 256;  // bricks

}  // namespace

RayRefiner::RayRefiner(const Field& field, const WideRays& rays, std::span<MarchHit> hits, sdf::Isa isa)
    : field_(field), rays_(rays), hits_(hits), isa_(isa) {
    targets_.reserve(hits.size());
}

void RayRefiner::look(size_t to, int ray, float t) {
    const double h = double(field_.grid().voxel_size);
    const auto metres = [&](size_t axis) {
        const double begin = double(rays_.whole[axis][ray]) + double(rays_.part[axis][ray]);
        return float((begin + double(rays_.direction[axis][ray]) * double(t)) * h);
    };
    looks_.x[to] = metres(0);
    looks_.y[to] = metres(1);
    looks_.z[to] = metres(2);
}

// All points: those that nobody asks about are of before, and as cheap.
void RayRefiner::evaluate(uint32_t slot) {
    sdf::evaluate(sdf::view(field_.program(), field_.code_of(slot)), {looks_.x, looks_.y, looks_.z, kLooks}, looks_.d,
                  isa_);
    const float voxels = 1.0f / field_.grid().voxel_size;
    for (float& d : looks_.d) d *= voxels;
}

void RayRefiner::collect(int ray, uint32_t slot, float from, float to) {
    targets_.push_back({ray, slot, -1, from, to});
}

// fn(slot, targets), at most kMost of one brick at a time.
template <int kMost, typename Fn>
void RayRefiner::each_brick(Fn&& fn) {
    // A brick that another one's place is taken by comes a second time, which costs time and changes nothing.
    std::array<int, kRemembered> last;
    last.fill(-1);
    firsts_.clear();
    for (int i = 0; i < int(targets_.size()); ++i) {
        int& before = last[targets_[size_t(i)].slot % kRemembered];
        if (before >= 0 && targets_[size_t(before)].slot == targets_[size_t(i)].slot) {
            targets_[size_t(before)].next = i;
        } else {
            firsts_.push_back(i);
        }
        before = i;
    }
    std::array<const Target*, size_t(kMost)> some;
    for (const int first : firsts_) {
        size_t n = 0;
        for (int i = first; i >= 0; i = targets_[size_t(i)].next) {
            some[n++] = &targets_[size_t(i)];
            if (n < some.size() && targets_[size_t(i)].next >= 0) continue;
            fn(targets_[size_t(first)].slot, std::span(some).first(n));
            n = 0;
        }
    }
    targets_.clear();
}

void RayRefiner::run(std::span<const NearPass> passes) {
    for (size_t i = 0; i < passes.size(); ++i) {
        const NearPass& pass = passes[i];
        if (!(pass.least < kNearPassVoxels) || (hits_[i].state != kMarchMiss && hits_[i].t < pass.to)) continue;
        const uint32_t word = field_.cell_word(pass.cell.x, pass.cell.y, pass.cell.z);
        collect(int(i), word & kCellSlotMask, std::max(pass.from - kSearchMore, 0.0f),
                std::min(pass.to + kSearchMore, rays_.t_max[i]));
    }
    each_brick<kLooks / kSearchLooks>([&](uint32_t slot, std::span<const Target*> some) { search(slot, some); });
    for (size_t i = 0; i < hits_.size(); ++i) {
        // One that starts in solid stays there.
        if (hits_[i].state == kMarchHit && hits_[i].t > 0)
            collect(int(i), uint32_t(hits_[i].slot), hits_[i].t, hits_[i].t);
    }
    each_brick<kLooks / 2>([&](uint32_t slot, std::span<const Target*> some) { polish(slot, some); });
}

// The code's value changes by no more than one moves: two looks whose values together exceed what lies between them leave no room for a
// surface. Else the next round looks closer, around the least.
void RayRefiner::search(uint32_t slot, std::span<const Target*> passes) {
    struct Stretch {
        const Target* target;
        float from, to;
    };
    std::array<Stretch, size_t(kLooks / kSearchLooks)> open;
    size_t count = 0;
    for (const Target* pass : passes) open[count++] = {pass, pass->from, pass->to};
    for (int round = 0; round < kSearchRounds && count > 0; ++round) {
        const auto at = [](const Stretch& s, int k) {
            return s.from + (s.to - s.from) * (float(k) / float(kSearchLooks - 1));
        };
        for (size_t i = 0; i < count; ++i) {
            for (int k = 0; k < kSearchLooks; ++k) {
                look(i * kSearchLooks + size_t(k), open[i].target->ray, at(open[i], k));
            }
        }
        evaluate(slot);
        size_t left = 0;
        for (size_t i = 0; i < count; ++i) {
            const Stretch stretch = open[i];
            const float* const d = looks_.d + i * kSearchLooks;
            int least = 0, solid = -1;
            for (int k = 0; k < kSearchLooks && solid < 0; ++k) {
                if (d[k] <= 0) solid = k;
                if (d[k] < d[least]) least = k;
            }
            if (solid >= 0) {
                const float before = at(stretch, std::max(solid - 1, 0)), behind = at(stretch, solid);
                const float t =
                    solid == 0 ? behind : before + (behind - before) * (d[solid - 1] / (d[solid - 1] - d[solid]));
                MarchHit& hit = hits_[size_t(stretch.target->ray)];
                const BrickRecord& record = field_.records()[slot];
                hit.state = kMarchHit;
                hit.slot = int(slot);
                hit.cell = {record.texel_x / kBrickVoxels, record.texel_y / kBrickVoxels,
                            record.texel_z / kBrickVoxels};
                place(stretch.target->ray, t);
                continue;
            }
            const int low = std::max(least - 1, 0), high = std::min(least + 1, kSearchLooks - 1);
            const float gap = (stretch.to - stretch.from) / float(kSearchLooks - 1);
            if (d[low] + d[least] > gap && d[least] + d[high] > gap) continue;
            open[left++] = {stretch.target, at(stretch, low), at(stretch, high)};
        }
        count = left;
    }
}

// By the secant of two looks.
void RayRefiner::polish(uint32_t slot, std::span<const Target*> found) {
    struct Point {
        int ray;
        float first, t, t_before, d_before;
    };
    std::array<Point, size_t(kLooks / 2)> open;
    size_t count = 0;
    for (const Target* target : found) {
        const float before = std::max(target->from - kSlopeStep, 0.0f);
        look(count, target->ray, target->from);
        look(kLooks / 2 + count, target->ray, before);
        open[count++] = {target->ray, target->from, target->from, before, 0};
    }
    for (int round = 0; round < kPolishRounds && count > 0; ++round) {
        evaluate(slot);
        size_t left = 0;
        for (size_t i = 0; i < count; ++i) {
            Point p = open[i];
            const float d = looks_.d[i];
            if (round == 0) p.d_before = looks_.d[kLooks / 2 + i];
            const float moved = p.t - p.t_before;
            const float slope = std::fabs(moved) > 1e-5f ? (d - p.d_before) / moved : -1.0f;
            const bool enters = slope < kFlattest;
            float next = p.t - std::clamp(d / slope, -kFurthest, kFurthest);
            if (!enters) {
                // Along the surface, or out of something thinner than a voxel: whose front is before.
                next = d > kNearEnough ? p.t + d : std::min(p.t, p.t_before) - std::max(std::fabs(d), kSlopeStep);
            }
            if (!(std::fabs(next - p.first) <= kFurthest)) continue;  // it stays where it was
            if (enters && std::fabs(d) <= kNearEnough) {
                place(p.ray, std::clamp(next, 0.0f, rays_.t_max[p.ray]));
            } else {
                open[left++] = {p.ray, p.first, next, p.t, d};
            }
        }
        count = left;
        for (size_t i = 0; i < count; ++i) look(i, open[i].ray, open[i].t);
    }
}

// The hit at t, in its brick.
void RayRefiner::place(int ray, float t) {
    MarchHit& hit = hits_[size_t(ray)];
    hit.t = t;
    const auto axis = [&](size_t a, int cell, int& voxel, float& p) {
        const double q = double(rays_.whole[a][ray] - cell * kBrickVoxels) + double(rays_.part[a][ray]) +
                         double(rays_.direction[a][ray]) * double(t);
        voxel = std::clamp(int(q + kBrickVoxels) - kBrickVoxels, 0, kBrickVoxels - 1);  // nothing moves as far as that
        p = float(std::clamp(q - voxel, 0.0, 1.0));
    };
    axis(0, hit.cell.x, hit.voxel.x, hit.p.x);
    axis(1, hit.cell.y, hit.voxel.y, hit.p.y);
    axis(2, hit.cell.z, hit.voxel.z, hit.p.z);
}

}  // namespace kiln::field

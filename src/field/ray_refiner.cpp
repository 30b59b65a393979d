// SPDX-License-Identifier: MIT
#include "field/ray_refiner.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace kiln::field {
namespace {

constexpr int kSearchLooks = 8;       // along a stretch of a ray
constexpr int kSearchRounds = 3;      // each on a stretch some 3.5 times shorter
constexpr float kSearchMore = 0.25f;  // voxels before and behind the voxel that was passed
constexpr int kPolishRounds = 6;
constexpr int kFew = 16;  // points that cost less than kLooks

}  // namespace

void RayRefiner::run(std::span<const WideRay> rays, std::span<MarchHit> hits, std::span<const RayNote> notes) {
    rays_ = rays, hits_ = hits, notes_ = notes;
    brick_count_ = 0;
    remembered_.fill(-1);
    for (int i = 0; i < int(hits.size()); ++i) {
        const RayNote& note = notes[size_t(i)];
        MarchHit& hit = hits[size_t(i)];
        found_[size_t(i)].pass = -1;
        for (int k = 0; k < 2; ++k) {
            const NearPass& pass = note.passes[k];
            if (!(pass.least < kNearPassVoxels)) break;
            if (hit.state != kMarchMiss && hit.t < pass.to) continue;
            int& first = bricks_[size_t(brick_at(pass.cell))].passed_by;
            next_passed_[size_t(2 * i + k)] = int16_t(first);
            first = 2 * i + k;
        }
        if (hit.state == kMarchHit) {
            const int at = brick_at(hit.cell);
            hit.slot = at;    // until slots are known
            if (hit.t > 0) {  // one that starts in solid stays there
                int& first = bricks_[size_t(at)].hit_by;
                next_hit_[size_t(i)] = int16_t(first);
                first = i;
            }
        }
    }
    // What is far from the processor is asked for, of all bricks, before any of it is needed.
    const std::span bricks = std::span(bricks_).first(size_t(brick_count_));
    for (Brick& brick : bricks) {
        brick.code = field_.code_of(brick.slot);
        __builtin_prefetch(brick.code.data());
        __builtin_prefetch(brick.code.data() + 8);
    }
    for (MarchHit& hit : hits) {
        if (hit.state == kMarchHit) hit.slot = int(bricks[size_t(hit.slot)].slot);
    }
    for (Brick& brick : bricks) search(brick);
    for (Brick& brick : bricks) polish(brick);
}

// A brick whose place another one takes comes a second time, which costs time and changes nothing.
int RayRefiner::brick_at(ivec3 cell) {
    if (brick_count_ > 0 && bricks_[size_t(last_)].cell == cell) return last_;  // as most rays
    const uint32_t hash = uint32_t(cell.x) + uint32_t(cell.y) * 19u + uint32_t(cell.z) * 101u;
    int16_t& place = remembered_[hash % kRemembered];
    if (place >= 0 && bricks_[size_t(place)].cell == cell) return last_ = place;
    place = int16_t(brick_count_++);
    const uint32_t slot = field_.cell_word(cell.x, cell.y, cell.z) & kCellSlotMask;
    __builtin_prefetch(&field_.records()[slot]);
    bricks_[size_t(place)] = {cell, slot, {}, -1, -1};
    return last_ = place;
}

// Where a ray is, voxels from the brick's first texel.
std::array<float, 3> RayRefiner::in_brick(const Brick& brick, int ray, float t) const {
    const GridParams& g = field_.grid();
    const WideRay& r = rays_[size_t(ray)];
    const auto axis = [&](size_t a, int cell) {
        return float(double(r.whole[a] - cell * kBrickVoxels) + double(r.part[a]) + double(r.direction[a]) * double(t));
    };
    return {axis(0, brick.cell.x - g.cell_x), axis(1, brick.cell.y - g.cell_y), axis(2, brick.cell.z - g.cell_z)};
}

// Sixteen points or all: those that nobody asks about are of before, and as cheap.
void RayRefiner::evaluate(const Brick& brick, int count) {
    sdf::evaluate(sdf::view(field_.program(), brick.code),
                  {looks_.x.data(), looks_.y.data(), looks_.z.data(), count <= kFew ? kFew : kLooks}, looks_.d.data(),
                  isa_);
}

// The code's value changes by no more than one moves: two looks whose values together exceed what lies between them leave no room for a
// surface. Else the next round looks closer, around the least.
void RayRefiner::search(const Brick& brick) {
    struct Stretch {
        int ray, pass;
        float from, to;
        std::array<float, 3> begin;  // where the ray is at t_begin
        float t_begin;
    };
    constexpr int kMost = kLooks / kSearchLooks;
    std::array<Stretch, size_t(kMost)> open;
    const float h = field_.grid().voxel_size, voxels = 1.0f / h;
    const std::array<float, 3> base{float(brick.cell.x * kBrickVoxels), float(brick.cell.y * kBrickVoxels),
                                    float(brick.cell.z * kBrickVoxels)};
    for (int next = brick.passed_by; next >= 0;) {
        int count = 0;
        for (; next >= 0 && count < kMost; next = next_passed_[size_t(next)]) {
            const int ray = next / 2;
            const NearPass& pass = notes_[size_t(ray)].passes[next % 2];
            const float from = std::max(pass.from - kSearchMore, 0.0f);
            open[size_t(count++)] = {
                ray, next, from, std::min(pass.to + kSearchMore, rays_[size_t(ray)].t_max), in_brick(brick, ray, from),
                from};
        }
        for (int round = 0; round < kSearchRounds && count > 0; ++round) {
            for (int i = 0; i < count; ++i) {
                const Stretch& s = open[size_t(i)];
                const float gap = (s.to - s.from) / float(kSearchLooks - 1);
                const auto axis = [&](size_t a, std::array<float, kLooks>& out) {
                    const float along = rays_[size_t(s.ray)].direction[a], begin = s.begin[a],
                                first = s.from - s.t_begin;
                    for (int k = 0; k < kSearchLooks; ++k)
                        out[size_t(i * kSearchLooks + k)] = (base[a] + (begin + along * (first + gap * float(k)))) * h;
                };
                axis(0, looks_.x), axis(1, looks_.y), axis(2, looks_.z);
            }
            evaluate(brick, count * kSearchLooks);
            int left = 0;
            for (int i = 0; i < count; ++i) {
                const Stretch s = open[size_t(i)];
                const float gap = (s.to - s.from) / float(kSearchLooks - 1);
                const auto at = [&](size_t k) { return s.from + gap * float(k); };
                std::array<float, kSearchLooks> d;
                for (int k = 0; k < kSearchLooks; ++k) d[size_t(k)] = looks_.d[size_t(i * kSearchLooks + k)] * voxels;
                size_t least = 0, solid = kSearchLooks;
                for (size_t k = kSearchLooks; k-- > 0;) {
                    if (d[k] <= 0) solid = k;
                    if (d[k] <= d[least]) least = k;
                }
                if (solid < kSearchLooks) {
                    const float slope = solid == 0 ? -1.0f : (d[solid] - d[solid - 1]) / gap;
                    const float t = solid == 0 ? at(0) : at(solid) - d[solid] / slope;
                    MarchHit& hit = hits_[size_t(s.ray)];
                    if (found_[size_t(s.ray)].pass >= 0 && hit.t <= t) continue;  // by its other pass, and before
                    hit.state = kMarchHit;
                    hit.t = t;
                    hit.slot = int(brick.slot);
                    hit.cell = brick.cell;
                    std::array<float, 3> there;
                    for (size_t a = 0; a < 3; ++a)
                        there[a] = s.begin[a] + rays_[size_t(s.ray)].direction[a] * (t - s.t_begin);
                    for (size_t a = 0; a < 3; ++a) {
                        const float voxel = std::clamp(std::floor(there[a]), 0.0f, float(kBrickVoxels - 1));
                        (a == 0 ? hit.voxel.x : a == 1 ? hit.voxel.y : hit.voxel.z) = int(voxel);
                        (a == 0 ? hit.p.x : a == 1 ? hit.p.y : hit.p.z) = std::clamp(there[a] - voxel, 0.0f, 1.0f);
                    }
                    found_[size_t(s.ray)] = {s.pass, slope, there};
                    continue;
                }
                const size_t low = least > 0 ? least - 1 : 0, high = std::min<size_t>(least + 1, kSearchLooks - 1);
                if (d[low] + d[least] > gap && d[least] + d[high] > gap) continue;
                open[size_t(left++)] = {s.ray, s.pass, at(low), at(high), s.begin, s.t_begin};
            }
            count = left;
        }
    }
}

void RayRefiner::polish(const Brick& brick) {
    RayPolish& lanes = polish_;
    int count = 0;
    const auto add = [&](int ray, float x, float y, float z, float slope) {
        const int i = count++;
        polished_[size_t(i)] = ray;
        lanes.first[0][i] = x, lanes.first[1][i] = y, lanes.first[2][i] = z;
        for (int axis = 0; axis < 3; ++axis) lanes.along[axis][i] = rays_[size_t(ray)].direction[axis];
        lanes.slope[i] = slope;
        if (count == RayPolish::kMost) polish_all(brick, std::exchange(count, 0));
    };
    for (int ray = brick.hit_by; ray >= 0; ray = next_hit_[size_t(ray)]) {
        if (found_[size_t(ray)].pass >= 0) continue;  // somewhere else, before
        const MarchHit& hit = hits_[size_t(ray)];
        add(ray, float(hit.voxel.x) + hit.p.x, float(hit.voxel.y) + hit.p.y, float(hit.voxel.z) + hit.p.z,
            notes_[size_t(ray)].slope);
    }
    for (int pass = brick.passed_by; pass >= 0; pass = next_passed_[size_t(pass)]) {
        const int ray = pass / 2;
        const Found& found = found_[size_t(ray)];
        if (found.pass == pass) add(ray, found.in_brick[0], found.in_brick[1], found.in_brick[2], found.slope);
    }
    if (count > 0) polish_all(brick, count);
}

// The first `count` of polish_, whose rays are polished_.
void RayRefiner::polish_all(const Brick& brick, int count) {
    RayPolish& lanes = polish_;
    lanes.voxel_size = field_.grid().voxel_size;
    lanes.base[0] = float(brick.cell.x * kBrickVoxels);
    lanes.base[1] = float(brick.cell.y * kBrickVoxels);
    lanes.base[2] = float(brick.cell.z * kBrickVoxels);
    lanes.round = 0;
    const int padded = (count + kFew - 1) / kFew * kFew;
    for (int i = 0; i < padded; ++i) {
        lanes.t[i] = 0, lanes.t_before[i] = -RayPolish::kStepBack, lanes.d_before[i] = 0;
        lanes.state[i] = i < count ? RayPolish::kOpen : RayPolish::kIdle;
    }
    for (int open = count; open > 0 && lanes.round < kPolishRounds;) {
        wide_polish_looks(lanes, padded, looks_.x.data(), looks_.y.data(), looks_.z.data(), isa_);
        evaluate(brick, padded);
        open = wide_polish_steps(lanes, padded, looks_.d.data(), isa_);
    }
    wide_polish_places(lanes, padded, isa_);
    for (int i = 0; i < count; ++i) {
        if (lanes.state[i] != RayPolish::kDone) continue;
        const int ray = polished_[size_t(i)];
        MarchHit& hit = hits_[size_t(ray)];
        hit.t = std::clamp(hit.t + lanes.t[i], 0.0f, rays_[size_t(ray)].t_max);
        hit.voxel = {lanes.voxel[0][i], lanes.voxel[1][i], lanes.voxel[2][i]};
        hit.p = {lanes.p[0][i], lanes.p[1][i], lanes.p[2][i]};
    }
}

}  // namespace kiln::field

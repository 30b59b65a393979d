// SPDX-License-Identifier: MIT
#include "render/particle_bins.h"

#include "render/passes/cluster.gpu.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace kiln::render {

namespace {

struct Place {
    uint32_t level = 0;
    int x0 = 0, y0 = 0, x1 = -1, y1 = -1;  // bins, both ends included
};

// Where a ball of `radius` at p (from the eye) may be seen: along each axis of the picture, between the two planes through the eye that
// touch it.
struct Range {
    float first, last;
};
Range tangents(float across, float ahead, float radius) {
    const float square = across * across + ahead * ahead - radius * radius;
    // The eye is in the ball, or the ball reaches behind it.
    if (square <= 0 || ahead <= radius) return {-INFINITY, INFINITY};
    const float root = std::sqrt(square);
    const float a = (across * root - ahead * radius) / (ahead * root + across * radius),
                b = (across * root + ahead * radius) / (ahead * root - across * radius);
    return {std::min(a, b), std::max(a, b)};
}

}  // namespace

ParticleBins particle_bins(std::span<const Particle> particles, const shade::CameraParams& camera, int left, int top,
                           int width, int height) {
    ParticleBins out;
    const vec3 eye{camera.eye.x, camera.eye.y, camera.eye.z}, right{camera.right.x, camera.right.y, camera.right.z},
        up{camera.up.x, camera.up.y, camera.up.z}, forward{camera.forward.x, camera.forward.y, camera.forward.z};
    struct Key {
        float distance;
        uint32_t index;
    };
    std::vector<Key> order;
    order.reserve(particles.size());
    for (uint32_t i = 0; i < particles.size(); ++i) {
        const Particle& p = particles[i];
        const vec3 at = p.position - eye;
        const float square = dot(at, at);
        if (!(square < 1e18f) || !(p.radius > 0) || !(p.opacity > 0) || dot(at, normalize(forward)) <= -p.radius)
            continue;
        order.push_back({square, i});
    }
    const auto record_of = [&](const Particle& p) {
        const vec3 at = p.position - eye, moved = p.before - p.position;
        return ParticleRecord{at.x,
                              at.y,
                              at.z,
                              p.radius,
                              p.color.x,
                              p.color.y,
                              p.color.z,
                              std::min(p.opacity, 1.0f),
                              p.emissive.x,
                              p.emissive.y,
                              p.emissive.z,
                              moved.x,
                              moved.y,
                              moved.z,
                              0,
                              0};
    };
    std::sort(order.begin(), order.end(), [&](const Key& a, const Key& b) {
        if (a.distance != b.distance) return a.distance < b.distance;
        const ParticleRecord x = record_of(particles[a.index]), y = record_of(particles[b.index]);
        return std::memcmp(&x, &y, sizeof x) < 0;
    });

    uint32_t bins = 0;
    for (size_t level = 0; level < size_t(kParticleLevels); ++level) {
        const int side = kParticleBin << (2 * level);
        out.first_level[level] = bins;
        out.across[level] = uint32_t((width + side - 1) / side);
        bins += out.across[level] * uint32_t((height + side - 1) / side);
    }
    // x of a point on the picture's plane is right's multiple; both axes have their own length.
    const float wide = length(right), high = length(up), straight = length(forward);
    const float per_x = 0.5f / (wide * camera.right.w), per_y = 0.5f / (high * camera.up.w);
    std::vector<Place> places;
    places.reserve(order.size());
    out.records.reserve(order.size());
    std::vector<uint32_t> counts(bins, 0);
    const auto each_bin = [&](const Place& p, const auto& visit) {
        for (int y = p.y0; y <= p.y1; ++y)
            for (int x = p.x0; x <= p.x1; ++x)
                visit(out.first_level[p.level] + uint32_t(y) * out.across[p.level] + uint32_t(x));
    };
    for (const Key& key : order) {
        const Particle& p = particles[key.index];
        const vec3 at = p.position - eye;
        const float ahead = dot(at, forward) / straight;
        // Jitter bends `forward` a little out of the square with right and up; a share more of the radius makes up for it.
        const float radius = p.radius * 1.01f;
        const Range x = tangents(dot(at, right) / wide, ahead, radius), y = tangents(dot(at, up) / high, ahead, radius);
        const float middle_x = 0.5f / camera.right.w, middle_y = 0.5f / camera.up.w;
        const auto pixel = [](float v, int most) { return int(std::clamp(v, -1.0f, float(most) + 1)); };
        const int x0 = pixel(middle_x + x.first * per_x - float(left) - 1.5f, width),
                  x1 = pixel(middle_x + x.last * per_x - float(left) + 1.5f, width),
                  y0 = pixel(middle_y - y.last * per_y - float(top) - 1.5f, height),
                  y1 = pixel(middle_y - y.first * per_y - float(top) + 1.5f, height);
        if (x1 < 0 || y1 < 0 || x0 >= width || y0 >= height) continue;
        Place place;
        for (;; ++place.level) {
            const int side = kParticleBin << (2 * place.level);
            place.x0 = std::max(x0, 0) / side, place.x1 = std::min(x1, width - 1) / side;
            place.y0 = std::max(y0, 0) / side, place.y1 = std::min(y1, height - 1) / side;
            if (place.level + 1 == uint32_t(kParticleLevels)) break;
            if (place.x1 - place.x0 < 3 && place.y1 - place.y0 < 3) break;
        }
        each_bin(place, [&](uint32_t bin) { ++counts[bin]; });
        places.push_back(place);
        out.records.push_back(record_of(p));
    }
    out.ends.resize(bins);
    uint32_t sum = 0;
    for (uint32_t bin = 0; bin < bins; ++bin) out.ends[bin] = std::exchange(sum, sum + counts[bin]);  // where it begins
    out.numbers.resize(sum);
    for (uint32_t i = 0; i < places.size(); ++i)
        each_bin(places[i], [&](uint32_t bin) { out.numbers[out.ends[bin]++] = i; });
    return out;
}

ParticleSun particle_sun(std::span<const ParticleRecord> records, const FrameParams& frame, uint32_t light) {
    ParticleSun out{frame, {}, {}};
    FrameParams& p = out.frame;
    const int across = int(std::ceil(std::sqrt(double(std::max<size_t>(records.size(), 1)))));
    const int down = (int(records.size()) + across - 1) / across;
    p.tile_x = p.tile_y = 0;
    p.tile_width = p.width = across;
    p.tile_height = p.height = std::max(down, 1);
    p.flags |= kFrameRays;
    const double h = double(frame.grid.voxel_size);
    const double eye[3] = {frame.eye_x + double(frame.eye_part_x), frame.eye_y + double(frame.eye_part_y),
                           frame.eye_z + double(frame.eye_part_z)};
    out.rays.resize(size_t(p.tile_width) * size_t(p.tile_height), FrameRay{});
    for (size_t i = 0; i < records.size(); ++i) {
        const double at[3] = {eye[0] + double(records[i].x) / h, eye[1] + double(records[i].y) / h,
                              eye[2] + double(records[i].z) / h};
        int whole[3];
        float part[3];
        for (int k = 0; k < 3; ++k) {
            const double floor = std::floor(std::clamp(at[k], -2e9, 2e9));
            whole[k] = int(floor);
            part[k] = float(std::clamp(at[k], -2e9, 2e9) - floor);
        }
        out.rays[i] = {whole[0], whole[1], whole[2], 0, part[0], part[1], part[2], 0, 0, 1, 0, 0};
    }
    const auto tiles = [](int pixels) { return size_t((pixels + kClusterSide - 1) / kClusterSide); };
    const size_t words = (frame.light_count + 31) / 32;
    out.masks.resize(tiles(p.tile_width) * tiles(p.tile_height) * words);
    for (size_t word = light / 32; word < out.masks.size(); word += words) out.masks[word] = 1u << (light % 32);
    return out;
}

}  // namespace kiln::render

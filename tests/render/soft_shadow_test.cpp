// SPDX-License-Identifier: MIT

#include "render/lib/shadow_march.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

using namespace kiln::render::shade;
using kiln::vec3;

namespace {

constexpr float kKnown = 1e30f;                       // fields that tell every distance
constexpr float kSoftHeight = 5, kSoftRadius = 0.5f;  // a horizontal disc above the origin of the plane y = 0

float box_distance(vec3 p, vec3 lo, vec3 hi) {
    const vec3 q{std::fabs(p.x - 0.5f * (lo.x + hi.x)) - 0.5f * (hi.x - lo.x),
                 std::fabs(p.y - 0.5f * (lo.y + hi.y)) - 0.5f * (hi.y - lo.y),
                 std::fabs(p.z - 0.5f * (lo.z + hi.z)) - 0.5f * (hi.z - lo.z)};
    return length(max(q, vec3{0, 0, 0})) + std::min(std::max(q.x, std::max(q.y, q.z)), 0.0f);
}

// A plate over x < 0 at height h, `thickness` upwards, over the ground.
auto half_plane(float h, float thickness) {
    return [=](vec3 p) { return std::min(p.y, box_distance(p, {-1000, h, -1000}, {0, h + thickness, 1000})); };
}

// A block over x < 0 whose edge is at height h and whose side leans away from the light at 45 degrees, over the ground.
auto leaning_block(float h) {
    return [=](vec3 p) {
        const float x = p.x, y = p.y - h;
        const float bottom = x < 0 ? std::fabs(y) : std::hypot(x, y);
        const float along = std::max(0.0f, (y - x) * std::numbers::sqrt2_v<float> / 2);  // on the side, from the edge
        const float side =
            std::hypot(x + along * std::numbers::sqrt2_v<float> / 2, y - along * std::numbers::sqrt2_v<float> / 2);
        const float d = std::min(bottom, side);
        return std::min(p.y, y > 0 && x + y < 0 ? -d : d);
    };
}

// Visible fraction from (x, 0, 0) of the disc around (0, kSoftHeight, 0), as the renderer asks for it.
template <typename Field>
float visible_from(const Field& field, float x) {
    const vec3 to_light{-x, kSoftHeight, 0};
    const float distance = length(to_light);
    SoftShadow shadow{field};
    return shadow.shadow_visible({x, 0, 0}, normalize(to_light), kSoftRadius / distance,
                                 {1e-3f, distance, 1e-4f, kKnown, 256});
}

// Where along x the fraction is f.
template <typename Field>
double place_of(const Field& field, float f, float reach) {
    float lo = -reach, hi = reach;
    for (int i = 0; i < 40; ++i) {
        const float mid = 0.5f * (lo + hi);
        (visible_from(field, mid) < f ? lo : hi) = mid;
    }
    return 0.5 * (lo + hi);
}

}  // namespace

// Gate G14: offsets of the edge across the disc, in its radii. Thin plates and thick blocks hide alike.
TEST(SoftShadow, HalfPlaneHidesItsShareOfTheDisc) {
    const double expected[][2] = {{-0.5, 0.19550}, {-0.25, 0.34252}, {-0.1, 0.43644},
                                  {0, 0.5},        {0.25, 0.65748},  {0.5, 0.80450}};
    for (const auto& [offset, visible] : expected) {
        EXPECT_NEAR(SoftShadow{leaning_block(1)}.disc_visible(float(offset)), visible, 1e-5);
        for (const float h : {0.5f, 1.0f, 2.5f}) {
            // The ray to the light's centre passes the edge's height at x (1 - h/D); a disc radius is R h / D there.
            const float x = float(offset) * kSoftRadius * h / (kSoftHeight - h);
            EXPECT_NEAR(visible_from(leaning_block(h), x), visible, 0.02)
                << "block, edge at " << offset << ", height " << h;
            for (const float thickness : {0.02f, 0.005f}) {
                EXPECT_NEAR(visible_from(half_plane(h, thickness), x), visible, 0.02)
                    << "plate of " << thickness << " m, edge at " << offset << ", height " << h;
            }
        }
    }
}

TEST(SoftShadow, PenumbraIsAsWideAsTheLightMakesIt) {
    // The fraction runs from 0 to 1 over 2 R h / (D - h); 5 % and 95 % are at x = -+0.8052 radii of it.
    double lo = 0, hi = 1;
    for (int i = 0; i < 60; ++i) {
        const double mid = 0.5 * (lo + hi);
        (0.5 + (mid * std::sqrt(1 - mid * mid) + std::asin(mid)) / std::numbers::pi < 0.95 ? lo : hi) = mid;
    }
    for (const float h : {1.0f, 2.5f}) {
        const double whole = 2 * kSoftRadius * h / (kSoftHeight - h);
        const auto field = leaning_block(h);
        const double width = (place_of(field, 0.95f, float(whole)) - place_of(field, 0.05f, float(whole))) / lo;
        EXPECT_NEAR(width, whole, 0.05 * whole) << "edge at height " << h;
    }
}

TEST(SoftShadow, ThinWallsHideEverythingBehindThem) {
    for (const float thickness : {0.1f, 0.02f, 0.005f}) {
        for (const float tilt_deg : {0.0f, 20.0f, 45.0f, 70.0f}) {
            const float a = tilt_deg * std::numbers::pi_v<float> / 180;
            const vec3 n{std::sin(a), std::cos(a), 0};
            const auto wall = [=](vec3 p) {
                return std::min(p.y, std::fabs(dot(n, p - vec3{0, 2, 0})) - 0.5f * thickness);
            };
            for (float x = -0.4f; x <= 0.4f; x += 0.037f) {
                EXPECT_LE(visible_from(wall, x), 0.01f)
                    << thickness << " m thick, tilted by " << tilt_deg << ", at " << x;
            }
        }
    }
}

TEST(SoftShadow, UnoccludedPlaneDoesNotShadowItself) {
    const auto plane = [](vec3 p) { return p.y; };
    for (float degrees = 0; degrees <= 89; degrees += 0.5f) {
        const float a = degrees * std::numbers::pi_v<float> / 180;
        for (const float tan_radius : {0.0f, 0.0046f, 0.0087f}) {
            const float offset = 0.01f;  // the start is one voxel off the surface
            SoftShadow shadow{plane};
            const float seen = shadow.shadow_visible({0, offset, 0}, {std::sin(a), std::cos(a), 0}, tan_radius,
                                                     {offset, 100, 1e-4f, kKnown, 256});
            EXPECT_GE(seen, 0.99f) << degrees << " degrees, disc " << tan_radius;
        }
    }
}

// Hard shadows are discs of no size: 1 or 0, and the edge is where the ray to the light's centre passes it.
TEST(SoftShadow, HardShadowEndsAtTheProjectedEdge) {
    const auto field = half_plane(1, 0.02f);
    for (float x = -0.5f; x <= 0.5f; x += 0.01f) {
        if (std::fabs(x) < 0.004f) continue;
        const vec3 to_light{-x, kSoftHeight, 0};
        SoftShadow shadow{field};
        const float seen =
            shadow.shadow_visible({x, 0, 0}, normalize(to_light), 0, {1e-3f, length(to_light), 1e-4f, kKnown, 256});
        EXPECT_EQ(seen, x > 0 ? 1.0f : 0.0f) << x;
    }
}

TEST(SoftShadow, VisibilityGrowsTowardsTheLight) {
    for (const float thickness : {0.02f, 0.3f, 3.0f}) {
        float before = 0;
        for (float x = -0.2f; x <= 3; x += 0.002f) {
            const float now = visible_from(half_plane(1, thickness), x);
            EXPECT_GE(now, before - 0.03f) << x << " under a plate of " << thickness;
            before = now;
        }
        EXPECT_EQ(before, 1.0f);
    }
}

// A strip hides what is between its edges: seen from below, 0.04 m at height 2 are +-0.05 radii of the disc.
TEST(SoftShadow, AWireHidesAStrip) {
    const float h = 2, half_width = 0.02f;
    const auto wire = [=](vec3 p) {
        return std::min(p.y, box_distance(p, {-half_width, h, -100}, {half_width, h + 0.002f, 100}));
    };
    SoftShadow shadow{wire};
    for (float x = -0.5f; x <= 0.5f; x += 0.01f) {
        const float middle = x * (1 - h / kSoftHeight), cone = kSoftRadius * h / kSoftHeight;
        const double hidden =
            shadow.disc_visible((middle + half_width) / cone) - shadow.disc_visible((middle - half_width) / cone);
        EXPECT_NEAR(visible_from(wire, x), 1 - hidden, 0.02) << x;
    }
}

TEST(SoftShadow, BandsNarrowerThanTheConeDoNotNarrowThePenumbra) {
    const double expected[][2] = {{-1, 0},          {-0.9, 0.0187},  {-0.75, 0.0721}, {-0.5, 0.19550},
                                  {-0.25, 0.34252}, {-0.1, 0.43644}, {0, 0.5},        {0.25, 0.65748},
                                  {0.5, 0.80450},   {0.75, 0.9279},  {0.9, 0.9813},   {1, 1}};
    for (const float h : {1.0f, 2.5f, 4.0f}) {
        for (const float share : {0.95f, 0.8f, 0.5f, 0.25f, 0.12f}) {  // of the cone's radius where the edge is
            const float band = share * kSoftRadius * h / kSoftHeight;
            for (const auto& [offset, visible] : expected) {
                const float x = float(offset) * kSoftRadius * h / (kSoftHeight - h);
                const vec3 to_light{-x, kSoftHeight, 0};
                const float distance = length(to_light);
                const auto seen = [&](const auto& field) {
                    SoftShadow shadow{field, band};
                    return shadow.shadow_visible({x, 0, 0}, normalize(to_light), kSoftRadius / distance,
                                                 {1e-3f, distance, 1e-4f, band, 512});
                };
                const double most = std::fabs(offset) > 0.7 ? 0.035 : 0.02;  // of the rim the last 3 % may go unseen
                EXPECT_NEAR(seen(leaning_block(h)), visible, most)
                    << "block, edge at " << offset << ", height " << h << ", band " << share;
                EXPECT_NEAR(seen(half_plane(h, 0.01f)), visible, most)
                    << "plate, edge at " << offset << ", height " << h << ", band " << share;
            }
        }
    }
}

// Far inside a shadow one ray proves that all of the disc is covered; a thin wall takes one ray and six to the rim.
TEST(SoftShadow, DeepShadowsTakeOneRay) {
    int samples = 0;
    SoftShadow shadow{[&](vec3 p) {
        ++samples;
        return std::min(p.y, box_distance(p, {-50, 1, -50}, {50, 9, 50}));
    }};
    EXPECT_EQ(shadow.shadow_visible({0, 0, 0}, {0, 1, 0}, 0.1f, {1e-2f, 100, 1e-3f, kKnown, 256}), 0);
    EXPECT_LE(samples, 40);
}

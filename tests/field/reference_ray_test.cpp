// SPDX-License-Identifier: MIT
// Starts threads.
// Gate G1 on the CPU: the march's own text (march.gpu.h and cubic.gpu.h, the same that the shader compiles) against the reference.

#include "field/reference_ray.h"
#include "twenty_worlds.h"
#include "rounds.h"

#include <cmath>

namespace kiln::field {
namespace {

struct Tally {
    int rays = 0, hits = 0, tangent = 0, mismatches = 0, far = 0;
    int along = 0;  // tangent because they run along planes of the lattice, and so of boxes
    double worst = 0;
    int grazing = 0;  // within kAcross of the surface, though farther than 1e-4 along the ray
};

// Voxels across the surface: rounding of values, and twice the overlap of brick faces.
constexpr double kAcross = 2.5e-5;

// Rays of all kinds: from outside, from within, parallel to axes, along texel planes and edges, through texels.
TexelRay random_ray(worlds::Random& r, const GridParams& g, bool& special) {
    const auto inside = [&](int first, int size) { return float(first * 7) + r.in(0, float(size * 7)); };
    vec3 target{inside(g.cell_x, g.size_x), inside(g.cell_y, g.size_y), inside(g.cell_z, g.size_z)};
    vec3 d = r.direction();
    const int kind = r.below(10);
    special = kind <= 4;
    if (kind == 0) d = vec3{r.below(2) == 0 ? 1.0f : -1.0f, 0, 0};
    if (kind == 1) d = vec3{0, r.below(2) == 0 ? 1.0f : -1.0f, 0};
    if (kind == 2) d = normalize(vec3{0, r.in(-1, 1), r.in(-1, 1)});
    if (kind == 3) d = normalize(d + vec3{0, 1e4f, 0});
    if (kind <= 4) {
        const int snap = r.below(4);  // along planes and edges of the lattice
        if (snap >= 1) target.x = std::round(target.x);
        if (snap >= 2) target.z = std::round(target.z);
        if (snap >= 3) target.y = std::round(target.y);
    }
    const float away = kind == 5 ? 0.0f : float(r.below(2) == 0 ? 100 : 400) + r.in(0, 50);
    const vec3 from{target.x - d.x * away, target.y - d.y * away, target.z - d.z * away};
    const ivec3 whole{int(std::floor(from.x)), int(std::floor(from.y)), int(std::floor(from.z))};
    return texel_ray(whole, {from.x - float(whole.x), from.y - float(whole.y), from.z - float(whole.z)}, d);
}

// Is the ray within kAcross of an outer face of the grid? Where a world is cut off there, it may leave before it hits.
bool gone_at(const HostBricks& bricks, const TexelRay& ray, double t) {
    const GridParams g = bricks.field().grid();
    const auto at = [&](int whole, float part, float d, int first, int size) {
        const double p = double(whole) + double(part) + double(d) * t;
        return std::fabs(p - 7.0 * first) < kAcross || std::fabs(p - 7.0 * (first + size)) < kAcross;
    };
    return at(ray.whole.x, ray.part.x, ray.direction.x, g.cell_x, g.size_x) ||
           at(ray.whole.y, ray.part.y, ray.direction.y, g.cell_y, g.size_y) ||
           at(ray.whole.z, ray.part.z, ray.direction.z, g.cell_z, g.size_z);
}

Tally compare(const HostBricks& bricks, uint32_t seed, int rays) {
    Tally tally;
    worlds::Random r(seed);
    for (int i = 0; i < rays; ++i) {
        bool special = false;
        const TexelRay ray = random_ray(r, bricks.field().grid(), special);
        const ReferenceHit expected = reference_ray(bricks, ray, 1000);
        const MarchHit got = bricks.march(ray, 0, 1000);
        ++tally.rays;
        if (expected.least < 1e-4) {
            (special ? tally.along : tally.tangent) += 1;
            continue;
        }
        tally.hits += expected.state == kMarchHit;
        const double off = std::fabs(double(got.t) - expected.t);
        const bool agree = got.state == expected.state;
        if (!agree && (gone_at(bricks, ray, double(got.t)) || gone_at(bricks, ray, expected.t))) {
            (special ? tally.along : tally.grazing) += 1;
        } else if (!agree) {
            ++tally.mismatches;
            if (tally.mismatches <= 5) {
                ADD_FAILURE() << "ray " << i << ": state " << got.state << " at " << got.t << ", reference "
                              << expected.state << " at " << expected.t << ", least " << expected.least << ", origin "
                              << ray.whole.x << "+" << ray.part.x << " " << ray.whole.y << "+" << ray.part.y << " "
                              << ray.whole.z << "+" << ray.part.z << " direction " << ray.direction.x << " "
                              << ray.direction.y << " " << ray.direction.z;
            }
        } else if (got.state != kMarchMiss) {
            if (off > 1e-4 && off * expected.slope < kAcross) {
                (special ? tally.along : tally.grazing) += 1;
                continue;
            }
            tally.worst = std::max(tally.worst, off);
            if (off > 1e-4) {
                ++tally.far;
                if (tally.far <= 5) {
                    ADD_FAILURE() << "ray " << i << ": t " << got.t << ", reference " << expected.t << " (" << off
                                  << " off), least " << expected.least << ", slot " << got.slot << " cell "
                                  << got.cell.x << " " << got.cell.y << " " << got.cell.z << " voxel " << got.voxel.x
                                  << " " << got.voxel.y << " " << got.voxel.z << " p " << got.p.x << " " << got.p.y
                                  << " " << got.p.z << ", direction " << ray.direction.x << " " << ray.direction.y
                                  << " " << ray.direction.z;
                }
            }
        }
    }
    return tally;
}

// Gate G1 asks 10^5 rays of each of twenty scenes; the short form shoots a part of them.
void expect_agreement(int rays_half, int rays_snorm8) {
    uint32_t seed = 1;
    int tangent = 0, rays = 0;
    for (worlds::World world : worlds::twenty()) {
        for (const DistanceFormat format : {DistanceFormat::Half, DistanceFormat::Snorm8}) {
            world.options.format = format;
            const HostBricks bricks = HostBricks::bake(world.field());
            const Tally tally = compare(bricks, seed++, format == DistanceFormat::Half ? rays_half : rays_snorm8);
            EXPECT_EQ(tally.mismatches, 0) << world.name;
            EXPECT_EQ(tally.far, 0) << world.name << ": worst " << tally.worst;
            EXPECT_GT(tally.hits, tally.rays / 50) << world.name;
            tangent += tally.tangent + tally.grazing;
            rays += tally.rays;
            testing::Test::RecordProperty(
                world.name + (format == DistanceFormat::Half ? " half worst voxels" : " snorm8 worst voxels"),
                std::to_string(tally.worst));
        }
    }
    EXPECT_LE(tangent, rays / 10000) << "rays left out as tangent or grazing, of " << rays;
    testing::Test::RecordProperty("tangent", tangent);
}

TEST(ReferenceRay, MarchAgreesWithBisectionOnEveryWorld) { expect_agreement(rounds(12000), rounds(3000)); }

TEST(ReferenceRaySlow, MarchAgreesWithBisectionOnAHundredThousandRaysOfEachWorld) { expect_agreement(100000, 20000); }

// A ray of one voxel's cubic: every pattern of signs and degeneracy.
TEST(ReferenceRay, CubicFindsTheFirstRootOrNone) {
    worlds::Random r(3);
    int roots = 0;
    for (int i = 0; i < rounds(200000); ++i) {
        Cubic c{r.in(0, 1), r.in(-1, 1), r.in(-1, 1), r.in(-1, 1)};
        const int kind = r.below(6);
        if (kind == 0) c.b3 = c.b2 = c.b1;                                                        // flat end
        if (kind == 1) c = {c.b0, c.b0 + (c.b3 - c.b0) / 3, c.b0 + (c.b3 - c.b0) * 2 / 3, c.b3};  // a straight line
        if (kind == 2) c.b3 = c.b0 - 3 * (c.b1 - c.b2);                                           // a parabola
        if (kind == 3) c.b1 = c.b0 * 1e-6f;
        const auto at = [&](double s) {
            const double q = 1 - s;
            return double(c.b0) * q * q * q + 3 * double(c.b1) * q * q * s + 3 * double(c.b2) * q * s * s +
                   double(c.b3) * s * s * s;
        };
        // A double root can hide between samples; how far below 0 it dips then is bounded by the spacing.
        constexpr int kSteps = 512;
        double expected = kNoRoot, least = at(0), before = 0;
        for (int k = 1; k <= kSteps && expected > 1; ++k) {
            const double s = double(k) / kSteps;
            least = std::min(least, at(s));
            if (at(s) <= 0) {
                double low = before, high = s;
                for (int b = 0; b < 60; ++b) (at(0.5 * (low + high)) > 0 ? low : high) = 0.5 * (low + high);
                expected = high;
            }
            before = s;
        }
        const double got = double(cubic_first_root(c));
        if (expected > 1) {
            if (got <= 1) {
                EXPECT_LT(least, 1e-4) << "a root at " << got << " of " << c.b0 << " " << c.b1 << " " << c.b2 << " "
                                       << c.b3;
                EXPECT_NEAR(at(got), 0, 1e-6);
            }
            continue;
        }
        ++roots;
        ASSERT_LE(got, 1) << "root " << expected << " of " << c.b0 << " " << c.b1 << " " << c.b2 << " " << c.b3
                          << " not found";
        ASSERT_LT(std::fabs(at(got)), 2e-6) << got << " is no root; " << expected << " is";
        ASSERT_LT(got, expected + 1e-3);
    }
    EXPECT_GT(roots, rounds(50000));
}

TEST(ReferenceRay, CubicIsTheTrilinearValueAlongTheSegment) {
    worlds::Random r(4);
    for (int i = 0; i < 10000; ++i) {
        const Corners c{r.in(-1, 1), r.in(-1, 1), r.in(-1, 1), r.in(-1, 1),
                        r.in(-1, 1), r.in(-1, 1), r.in(-1, 1), r.in(-1, 1)};
        const vec3 p{r.in(0, 1), r.in(0, 1), r.in(0, 1)}, q{r.in(0, 1), r.in(0, 1), r.in(0, 1)};
        const Cubic cubic = cubic_along(c, p, q);
        const float s = r.in(0, 1);
        ASSERT_NEAR(cubic_value(cubic, s), trilinear_value(c, p + (q - p) * s), 1e-6f);
        ASSERT_NEAR(cubic_slope(cubic, s), (cubic_value(cubic, s + 1e-3f) - cubic_value(cubic, s - 1e-3f)) / 2e-3f,
                    2e-3f);
    }
}

// Jumps choose which voxels are solved, never what they answer.
TEST(ReferenceRay, HitsAreTheSameWithAndWithoutJumps) {
    for (const worlds::World& world : worlds::all()) {
        const HostBricks bricks = HostBricks::bake(world.field());
        worlds::Random r(9);
        uint64_t cells_with = 0, cells_without = 0;
        for (int i = 0; i < 20000; ++i) {
            bool special = false;
            const TexelRay ray = random_ray(r, bricks.field().grid(), special);
            const MarchHit with = bricks.march(ray, 0, 1000, true), without = bricks.march(ray, 0, 1000, false);
            cells_with += uint64_t(with.cells);
            cells_without += uint64_t(without.cells);
            ASSERT_EQ(with.state, without.state) << world.name << " ray " << i;
            ASSERT_EQ(with.slot, without.slot) << world.name << " ray " << i;
            ASSERT_EQ(with.t, without.t) << world.name << " ray " << i;
            ASSERT_TRUE(with.voxel == without.voxel && with.p == without.p) << world.name << " ray " << i;
        }
        EXPECT_LT(cells_with, cells_without) << world.name;
    }
}

// Rays all but parallel to the borders between bricks cross them over hundreds of voxels of t: where one brick says the ray has
// left, the next must say it has come.
TEST(ReferenceRay, RaysThatGlideAlongBrickBordersFindNoGap) {
    worlds::World world{"plane", {worlds::edit(Plane{})}, {.voxel_size = 0.05f, .bounds = {{-2, -2, -2}, {2, 2, 2}}}};
    world.edits[0].node.transform.rotation = axis_angle(normalize(vec3{1, 0, 0.2f}), 0.5f);
    const HostBricks bricks = HostBricks::bake(world.field());
    worlds::Random r(12);
    int hits = 0;
    for (int i = 0; i < 20000; ++i) {
        const float drift = std::ldexp(r.in(-1, 1), -4 - r.below(20));
        const vec3 d =
            normalize(i % 2 == 0 ? vec3{drift, -1, 0.3f * r.in(-1, 1)} : vec3{drift, -1, drift * r.in(-1, 1)});
        const float away = r.in(20, 200);
        const vec3 target{7.0f * float(r.below(7) - 3), 0, r.in(-15, 15)};
        const vec3 from{target.x - d.x * away * r.in(0.9f, 1.1f), target.y - d.y * away, target.z - d.z * away};
        const ivec3 whole{int(std::floor(from.x)), int(std::floor(from.y)), int(std::floor(from.z))};
        const TexelRay ray =
            texel_ray(whole, {from.x - float(whole.x), from.y - float(whole.y), from.z - float(whole.z)}, d);
        const ReferenceHit expected = reference_ray(bricks, ray, 1000);
        const MarchHit got = bricks.march(ray, 0, 1000);
        ASSERT_EQ(got.state, expected.state) << "ray " << i;
        if (expected.state != kMarchHit) continue;
        ASSERT_NEAR(double(got.t), expected.t, 1e-4) << "ray " << i;
        ++hits;
    }
    EXPECT_GT(hits, 10000);
}

// The whole and fractional parts of an origin are one ray, however far away it starts.
TEST(ReferenceRay, ARayIsAsExactFromFarAway) {
    const HostBricks bricks = HostBricks::bake(worlds::sphere_of(10).field());
    worlds::Random r(10);
    for (int i = 0; i < 2000; ++i) {
        const vec3 d = r.direction();
        const vec3 target{r.in(-12, 12), r.in(-12, 12), r.in(-12, 12)};
        const double away = 3000;
        TexelRay ray;
        {
            const double o[3] = {double(target.x) - double(d.x) * away, double(target.y) - double(d.y) * away,
                                 double(target.z) - double(d.z) * away};
            const ivec3 whole{int(std::floor(o[0])), int(std::floor(o[1])), int(std::floor(o[2]))};
            ray = texel_ray(whole, {float(o[0] - whole.x), float(o[1] - whole.y), float(o[2] - whole.z)}, d);
        }
        const ReferenceHit expected = reference_ray(bricks, ray, 1e4);
        const MarchHit got = bricks.march(ray, 0, 1e4f);
        if (expected.least < 1e-4) continue;
        ASSERT_EQ(got.state, expected.state);
        if (got.state == kMarchHit) {
            ASSERT_NEAR(double(got.t), expected.t, 1.3e-4);  // half a unit in the last place of t
        }
    }
}

}  // namespace
}  // namespace kiln::field

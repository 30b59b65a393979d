// SPDX-License-Identifier: MIT
// Starts threads.
// What the baked texels say, against the judge: the world's list walked in double precision, sharing nothing with the tape.

#include "field/host_bricks.h"

#include "field/reference_ray.h"
#include "sdf/eval.h"
#include "twenty_worlds.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace kiln::field {
namespace {

constexpr double kTrilinearError = 0.8661;

double quantum(DistanceFormat format, double d_voxels) {
    if (format == DistanceFormat::Snorm8) return 4.0 / 127;
    return std::max(std::ldexp(1.0, std::ilogb(std::max(std::fabs(d_voxels), 1e-4)) - 10), 6.2e-5);
}

sdf::Judge judge_of(const worlds::World& world) {
    auto judge = sdf::Judge::create(world.source());
    EXPECT_TRUE(judge);
    return *judge;
}

void each_brick(const Field& field, const std::function<void(const BrickRecord&, uint32_t)>& fn) {
    for (const uint32_t slot : field.slots()) fn(field.records()[slot], slot);
}

double clamped(double d) { return std::min(std::max(d, -4.0), 4.0); }

class EachFormat : public testing::TestWithParam<DistanceFormat> {};
INSTANTIATE_TEST_SUITE_P(HostBricks, EachFormat, testing::Values(DistanceFormat::Half, DistanceFormat::Snorm8),
                         [](const auto& p) {
                             return std::string(p.param == DistanceFormat::Half ? "Half" : "Snorm8");
                         });

// Gate G6 at texels, and the error of the bake. Signs and zeros are those of the float evaluation, which may differ from the judge's
// within its own rounding only.
TEST_P(EachFormat, TexelsAreTheJudgesWithinAQuantum) {
    for (worlds::World world : worlds::all()) {
        world.options.format = GetParam();
        const HostBricks bricks = HostBricks::bake(world.field());
        const sdf::Judge judge = judge_of(world);
        const double h = double(world.options.voxel_size);
        each_brick(bricks.field(), [&](const BrickRecord& r, uint32_t slot) {
            if (slot % 5 != 0) return;  // the judge is slow
            for (int k = 0; k < 8; ++k) {
                for (int j = 0; j < 8; ++j) {
                    for (int i = 0; i < 8; ++i) {
                        const double exact = judge.distance({double(float(r.texel_x + i) * world.options.voxel_size),
                                                             double(float(r.texel_y + j) * world.options.voxel_size),
                                                             double(float(r.texel_z + k) * world.options.voxel_size)}) /
                                             h;
                        const double stored = double(bricks.texel(slot, i, j, k));
                        const double step = quantum(GetParam(), clamped(exact));
                        ASSERT_NEAR(stored, clamped(exact), step + 1e-4) << world.name;
                        ASSERT_LE(std::fabs(stored), std::fabs(exact) + step + 1e-4) << world.name;
                        if (std::fabs(exact) > 1e-4) {
                            ASSERT_EQ(stored < 0, exact < 0) << world.name << ": " << stored << " for " << exact;
                        }
                        if (stored == 0) {
                            ASSERT_LT(std::fabs(exact), 1e-4) << world.name << ": the zero set grew";
                        }
                    }
                }
            }
        });
    }
}

// Gate G6 between texels.
void expect_lower_bounds(const std::vector<worlds::World>& all, DistanceFormat format, int samples) {
    for (worlds::World world : all) {
        world.options.format = format;
        const HostBricks bricks = HostBricks::bake(world.field());
        const sdf::Judge judge = judge_of(world);
        const double h = double(world.options.voxel_size);
        worlds::Random r(8);
        std::vector<uint32_t> slots;
        each_brick(bricks.field(), [&](const BrickRecord&, uint32_t slot) { slots.push_back(slot); });
        for (int i = 0; i < samples; ++i) {
            const uint32_t slot = slots[size_t(r.below(int(slots.size())))];
            const BrickRecord& record = bricks.field().records()[slot];
            const ivec3 voxel{r.below(7), r.below(7), r.below(7)};
            const vec3 p{r.in(0, 1), r.in(0, 1), r.in(0, 1)};
            const double value = double(trilinear_value(bricks.corners(slot, voxel), p));
            const double exact = judge.distance({(double(record.texel_x + voxel.x) + double(p.x)) * h,
                                                 (double(record.texel_y + voxel.y) + double(p.y)) * h,
                                                 (double(record.texel_z + voxel.z) + double(p.z)) * h}) /
                                 h;
            ASSERT_LE(std::fabs(value) - kTrilinearError, std::fabs(exact) + quantum(format, 4)) << world.name;
        }
    }
}

TEST_P(EachFormat, TrilinearValuesLessTheirErrorAreLowerBounds) {
    expect_lower_bounds(worlds::all(), GetParam(), 8000);
}

TEST(HostBricksSlow, TrilinearValuesLessTheirErrorAreLowerBoundsInAMillionSamples) {
    expect_lower_bounds(worlds::twenty(), DistanceFormat::Half, 50000);
}

// Gate G2.
TEST(HostBricks, ASphereIsOffByAQuarterOverItsRadius) {
    for (const float radius : {2.0f, 3.0f, 4.0f, 6.0f, 8.0f, 12.0f, 16.0f, 24.0f, 32.0f}) {
        worlds::Random r{uint32_t(radius)};
        double worst = 0;
        for (int n = 0; n < 4; ++n) {
            const worlds::World world = worlds::sphere_of(radius, {r.in(-1, 1), r.in(-1, 1), r.in(-1, 1)});
            const vec3 center = world.edits[0].node.transform.position;
            const double h = double(world.options.voxel_size);
            const HostBricks bricks = HostBricks::bake(world.field());
            for (int i = 0; i < 3000; ++i) {
                const vec3 d = r.direction();
                // The surface along a ray through the centre is as far off as the geometry there.
                const double away = (double(radius) + 3) * h;
                const HostBricks::Hit hit =
                    bricks.cast({double(center.x) - double(d.x) * away, double(center.y) - double(d.y) * away,
                                 double(center.z) - double(d.z) * away},
                                d, 1e3);
                ASSERT_EQ(hit.state, kMarchHit) << "radius " << radius;
                worst = std::max(worst, std::fabs(away - hit.t - double(radius) * h) / h);
            }
        }
        EXPECT_LE(worst, 1.1 * 0.25 / double(radius) + 0.5 * std::ldexp(1.0, -10)) << "radius " << radius << " voxels";
        EXPECT_GE(worst, 0.5 * 0.25 / double(radius)) << "radius " << radius << " voxels: too good to be measured";
    }
}

// docs/architecture.md, Measuring: a cell of 7 voxels is met, to a voxel beyond, by (7 |n|_1 + 2) / 343 of a surface's area.
TEST(HostBricks, ASurfaceHasAsManyBricksAsItsDirectionAsksFor) {
    double plane = 0;
    constexpr int kHeights = 28;
    for (int i = 0; i < kHeights; ++i) {
        worlds::World world{"plane",
                            {worlds::edit(Plane{}, {0, 0.00125f + 0.0025f * float(i), 0})},
                            {.voxel_size = 0.01f, .bounds = {{-0.69f, -0.3f, -0.69f}, {0.69f, 0.3f, 0.69f}}}};
        plane += double(world.field()->slots().size()) / kHeights;
    }
    EXPECT_NEAR(plane / (140 * 140), (7 * 1 + 2) / 343.0, 0.02 * 9 / 343.0) << "|n|_1 is 1";
    double ball = 0;
    worlds::Random r(3);
    constexpr double kRadius = 60;
    constexpr int kBalls = 4;
    for (int i = 0; i < kBalls; ++i)
        ball += double(worlds::sphere_of(float(kRadius), r.point(1)).field()->slots().size()) / kBalls;
    constexpr double kPi = 3.141592653589793;
    EXPECT_NEAR(ball / (4 * kPi * kRadius * kRadius), (7 * 1.5 + 2) / 343, 0.02 * 12.5 / 343)
        << "|n|_1 is 1.5 on average";
}

TEST_P(EachFormat, NeighboursAgreeOnSharedTexelsBitForBit) {
    for (worlds::World world : worlds::all()) {
        world.options.format = GetParam();
        const HostBricks bricks = HostBricks::bake(world.field());
        const Field& field = bricks.field();
        int shared = 0;
        each_brick(field, [&](const BrickRecord& r, uint32_t slot) {
            for (int n = 1; n < 8; ++n) {
                const ivec3 to{n & 1, (n >> 1) & 1, n >> 2};
                const uint32_t word = field.cell_word(r.texel_x / 7 + to.x, r.texel_y / 7 + to.y, r.texel_z / 7 + to.z);
                if ((word & kCellOccupied) == 0) continue;
                ++shared;
                for (int k = to.z * 7; k < 8; ++k) {
                    for (int j = to.y * 7; j < 8; ++j) {
                        for (int i = to.x * 7; i < 8; ++i) {
                            ASSERT_EQ(bricks.texel(slot, i, j, k),
                                      bricks.texel(word & kCellSlotMask, i - 7 * to.x, j - 7 * to.y, k - 7 * to.z))
                                << world.name << " texel " << i << " " << j << " " << k;
                        }
                    }
                }
            }
        });
        EXPECT_GT(shared, 20) << world.name;
    }
}

// Gate G3: a surface that crosses brick borders everywhere has no hole and no kink.
TEST(HostBricks, APlaneAcrossAllBordersHasNoHole) {
    worlds::World world{"plane", {worlds::edit(Plane{})}, {.voxel_size = 0.05f, .bounds = {{-2, -2, -2}, {2, 2, 2}}}};
    world.edits[0].node.transform.rotation = axis_angle(normalize(vec3{1, 0.2f, 0.4f}), 0.63f);
    const vec3 up = rotate(world.edits[0].node.transform.rotation, {0, 1, 0});
    const HostBricks bricks = HostBricks::bake(world.field());
    worlds::Random r(2);
    for (int i = 0; i < 20000; ++i) {
        vec3 p{r.in(-1, 1), r.in(-1, 1), r.in(-1, 1)};
        if (i % 2 == 0) p.x = float(r.below(7) - 3) * 0.35f;  // straight through the borders of bricks
        p = p - up * dot(p, up);
        vec3 d = r.direction();
        if (dot(d, up) > 0) d = -d;
        if (dot(d, up) > -0.05f) continue;
        const HostBricks::Hit hit = bricks.cast({double(p.x - d.x), double(p.y - d.y), double(p.z - d.z)}, d, 10);
        ASSERT_EQ(hit.state, kMarchHit) << i;
        ASSERT_NEAR(hit.t, 1, 0.05 * 2e-3 / std::fabs(double(dot(d, up)))) << i;
        const double degrees = std::acos(std::min(1.0, double(dot(hit.surface.normal, up)))) * 57.29578;
        ASSERT_LT(degrees, 0.1) << i;
    }
}

TEST(HostBricks, NormalsOfASphereAreWithinTheirGates) {
    struct Row {
        float radius;
        double dual;
    };
    for (const Row row : {Row{8, 0.6}, Row{32, 0.1}}) {
        const worlds::World world = worlds::sphere_of(row.radius);
        const vec3 center = world.edits[0].node.transform.position;
        const HostBricks bricks = HostBricks::bake(world.field());
        worlds::Random r(3);
        double worst[3] = {0, 0, 0};
        for (int i = 0; i < 5000; ++i) {
            const vec3 d = r.direction();
            const double away = double((row.radius + 3) * world.options.voxel_size);
            for (const NormalKind kind : {NormalKind::Dual, NormalKind::Central, NormalKind::Tetrahedral}) {
                const HostBricks::Hit hit =
                    bricks.cast({double(center.x) - double(d.x) * away, double(center.y) - double(d.y) * away,
                                 double(center.z) - double(d.z) * away},
                                d, 10, kind);
                ASSERT_EQ(hit.state, kMarchHit);
                const double degrees = std::acos(std::min(1.0, -double(dot(hit.surface.normal, d)))) * 57.29578;
                worst[size_t(kind)] = std::max(worst[size_t(kind)], degrees);
            }
        }
        RecordProperty("radius " + std::to_string(int(row.radius)), "dual " + std::to_string(worst[0]) + " central " +
                                                                        std::to_string(worst[1]) + " tetrahedral " +
                                                                        std::to_string(worst[2]));
        EXPECT_LT(worst[0], row.dual) << "radius " << row.radius;
        EXPECT_LT(worst[1], 4 * row.dual) << "radius " << row.radius;
        EXPECT_LT(worst[2], 10 * row.dual) << "radius " << row.radius;
        EXPECT_LE(worst[0], worst[2]);
    }
}

// The 27-texel filter inside a brick and the sum over eight voxels are one function: two ways to it give one gradient.
TEST(HostBricks, DualNormalsAreContinuousAcrossVoxelsAndBricks) {
    const HostBricks bricks = HostBricks::bake(worlds::blends().field());
    worlds::Random r(4);
    int looked = 0;
    each_brick(bricks.field(), [&](const BrickRecord& record, uint32_t slot) {
        const ivec3 cell{record.texel_x / 7, record.texel_y / 7, record.texel_z / 7};
        for (int i = 0; i < 20; ++i) {
            vec3 p{r.in(0.5f, 6.5f), r.in(0.5f, 6.5f), r.in(0.5f, 6.5f)};
            float* const axis[3] = {&p.x, &p.y, &p.z};
            float& c = *axis[size_t(r.below(3))];
            c = std::round(c * 2) * 0.5f;  // a face between voxels, or a middle, where the eight voxels change
            const float at = std::min(std::max(c, 0.5f), 6.5f);
            c = at - 1e-4f;
            const vec3 a = bricks.gradient(slot, cell, p, NormalKind::Dual);
            c = at + 1e-4f;
            const vec3 b = bricks.gradient(slot, cell, p, NormalKind::Dual);
            if (at == 0.5f || at == 6.5f) continue;  // there a neighbour without a brick may come in
            ASSERT_LT(length(a - b), 2e-3f) << "at " << at;
            ++looked;
        }
        // Across a face that two bricks share, seen from each.
        const uint32_t word = bricks.field().cell_word(cell.x + 1, cell.y, cell.z);
        bool all = (word & kCellOccupied) != 0;
        for (int n = 0; n < 27 && all; ++n) {
            for (int more = 0; more < 2; ++more) {
                all = all && (bricks.field().cell_word(cell.x + more, cell.y + n / 3 % 3 - 1, cell.z + n / 9 - 1) &
                              kCellOccupied) != 0;
            }
        }
        if (!all) return;
        for (int i = 0; i < 20; ++i) {
            const float y = r.in(0, 7), z = r.in(0, 7);
            const vec3 a = bricks.gradient(slot, cell, {7, y, z}, NormalKind::Dual);
            const vec3 b =
                bricks.gradient(word & kCellSlotMask, {cell.x + 1, cell.y, cell.z}, {0, y, z}, NormalKind::Dual);
            ASSERT_LT(length(a - b), 1e-5f);
            ++looked;
        }
    });
    EXPECT_GT(looked, 1000);
}

TEST(HostBricks, SameBytesForAnyNumberOfWorkers) {
    worlds::World world = worlds::jumble();
    const std::shared_ptr<const Field> field = world.field();
    const uint64_t one = HostBricks::bake(field, 1).hash();
    for (const int workers : {2, 3, 8})
        EXPECT_EQ(HostBricks::bake(field, workers).hash(), one) << workers << " workers";
    world.edits.back().node.transform.position.x += 0.3f;
    world.edits.back().op = Op::Union;
    EXPECT_NE(HostBricks::bake(world.field()).hash(), one);
}

TEST(HostBricks, SamplesAreTrilinearNearTheSurfaceAndExactElsewhere) {
    const worlds::World world = worlds::blends();
    const HostBricks bricks = HostBricks::bake(world.field());
    const sdf::Judge judge = judge_of(world);
    worlds::Random r(6);
    int from_bricks = 0;
    for (int i = 0; i < 4000; ++i) {
        const vec3 p = r.point(i % 8 == 0 ? 3.0f : 1.0f);  // also outside the grid
        const dvec3 at{double(p.x), double(p.y), double(p.z)};
        const HostBricks::Sample sample = bricks.sample(at);
        const double exact = judge.distance(at);
        const double h = double(world.options.voxel_size);
        if (!sample.from_brick) {
            ASSERT_NEAR(sample.distance, exact, 1e-5);
            continue;
        }
        ++from_bricks;
        ASSERT_NEAR(sample.distance, exact, h * kTrilinearError);
        ASSERT_LT(std::fabs(sample.distance), 4 * h);
        ASSERT_NEAR(length(sample.normal), 1, 1e-5);
    }
    EXPECT_GT(from_bricks, 100);
}

// Along the seam of a smooth union the share of each side goes through one half, as the kernel's weight says.
TEST(HostBricks, MaterialsOfABlendAreTheKernelsWeights) {
    worlds::World world{"two", {}, {.voxel_size = 0.04f, .bounds = {{-1.5f, -1, -1}, {1.5f, 1, 1}}}};
    world.edits.push_back(worlds::of_material(worlds::edit(Sphere{.radius = 0.5f}, {-0.4f, 0, 0}), 3));
    world.edits.push_back(worlds::of_material(worlds::edit(Sphere{.radius = 0.5f}, {0.4f, 0, 0}, Op::Union, 0.4f), 1));
    const HostBricks bricks = HostBricks::bake(world.field());
    const uint16_t left = uint16_t(sdf::material_number({3, 0})), right = uint16_t(sdf::material_number({1, 0}));
    int mixed = 0;
    for (float x = -0.8f; x < 0.8f; x += 0.013f) {
        const HostBricks::Hit hit = bricks.cast({double(x), 2, 0.01}, {0, -1, 0}, 10);
        ASSERT_EQ(hit.state, kMarchHit);
        const double y = 2 - hit.t;
        const auto share_of_right = [&](uint16_t m0, uint16_t m1, float share) {
            return (m0 == right ? 1.0 - double(share) : 0.0) + (m1 == right ? double(share) : 0.0) -
                   (m0 == m1 ? (m0 == right ? double(share) : 0.0) : 0.0);
        };
        // The kernel's weight at the hit: h / 2 for the farther operand, h = max(k - |a - b|, 0) / k.
        const double a = std::hypot(double(x) + 0.4, y, 0.01) - 0.5, b = std::hypot(double(x) - 0.4, y, 0.01) - 0.5;
        const double hh = std::max(double(0.4f) - std::fabs(a - b), 0.0) / double(0.4f);
        const double expected = b < a ? 1 - 0.5 * hh : 0.5 * hh;
        ASSERT_TRUE(hit.surface.material0 == left || hit.surface.material0 == right);
        const double got = share_of_right(hit.surface.material0, hit.surface.material1, hit.surface.share);
        EXPECT_NEAR(got, expected, 0.02) << "at x " << x;
        mixed += hit.surface.share > 0.05f;
    }
    EXPECT_GT(mixed, 10);
}

TEST(HostBricks, APaletteKeepsTheSixteenHeaviestAndCountsTheRest) {
    worlds::World world{"many", {}, {.voxel_size = 0.05f, .bounds = {{-1, -1, -1}, {1, 1, 1}}}};
    for (int i = 0; i < 25; ++i) {
        world.edits.push_back(
            worlds::of_material(worlds::edit(Sphere{.radius = 0.02f + 0.0008f * float(i)},
                                             {0.03f + 0.06f * float(i % 5), 0.03f + 0.06f * float(i / 5), 0.15f}),
                                uint32_t(i)));
    }
    const HostBricks bricks = HostBricks::bake(world.field());
    const uint32_t word = bricks.field().cell_word(0, 0, 0);
    ASSERT_NE(word & kCellOccupied, 0u);
    EXPECT_GE(bricks.dropped_materials(), 9u);
    const BrickContent& content = bricks.content(word & kCellSlotMask);
    ASSERT_TRUE(content.materials);
    const auto& palette = content.materials->palette;
    for (size_t i = 1; i < 16; ++i) EXPECT_LT(palette[i - 1], palette[i]);
    EXPECT_LT(palette[15], sdf::kNoMaterial);
    // A texel whose material is kept still names it.
    EXPECT_EQ(content.dropped(), 9u);
    int named = 0;
    std::vector<int> texels_of(64, 0);  // hard unions: a texel has one material
    for (int i = 0; i < 512; ++i) {
        const float p[3] = {float(i & 7) * 0.05f, float(i >> 3 & 7) * 0.05f, float(i >> 6) * 0.05f};
        float value;
        sdf::MaterialMix mix;
        sdf::evaluate_materials(sdf::view(bricks.field().program()), {&p[0], &p[1], &p[2], 1}, &value, &mix);
        if (std::fabs(value / 0.05f) >= 4) {
            EXPECT_EQ(content.word(size_t(i)), 0);
            continue;
        }
        ++texels_of[mix.id0];
        for (size_t slot = 0; slot < 16; ++slot) {
            if (palette[slot] != mix.id0) continue;
            EXPECT_EQ(material_slot0(content.word(size_t(i))), uint32_t(slot));
            ++named;
        }
    }
    EXPECT_GT(named, 100);
    int lightest_kept = 512, heaviest_left = 0;
    for (int id = 0; id < 64; ++id) {
        const bool kept = std::find(palette.begin(), palette.end(), uint32_t(id)) != palette.end();
        if (kept) lightest_kept = std::min(lightest_kept, texels_of[size_t(id)]);
        if (!kept) heaviest_left = std::max(heaviest_left, texels_of[size_t(id)]);
    }
    EXPECT_GE(lightest_kept, heaviest_left);
    EXPECT_GT(heaviest_left, 0);
}

TEST(HostBricks, FarEditsChangeNotOneBitOfABrick) {
    worlds::World world = worlds::blends();
    const HostBricks before = HostBricks::bake(world.field());
    world.edits.push_back(worlds::of_material(worlds::edit(Sphere{.radius = 0.05f}, {1.2f, 1.2f, 1.2f}), 9));
    HostBricks after = HostBricks::bake(world.field());
    int same = 0;
    each_brick(before.field(), [&](const BrickRecord& r, uint32_t slot) {
        const uint32_t word = after.field().cell_word(r.texel_x / 7, r.texel_y / 7, r.texel_z / 7);
        ASSERT_NE(word & kCellOccupied, 0u);
        for (size_t i = 0; i < 512; ++i) {
            const BrickContent &was = before.content(slot), &is = after.content(word & kCellSlotMask);
            ASSERT_EQ(was.word(i), is.word(i));
            ASSERT_EQ(was.half->codes[i], is.half->codes[i]);
        }
        ++same;
    });
    EXPECT_GT(same, 50);
}

TEST(HostBricks, ACameraInSolidSaysSo) {
    const worlds::World world = worlds::sphere_of(40);
    const HostBricks bricks = HostBricks::bake(world.field());
    EXPECT_EQ(bricks.cast({0, 0, 0}, {1, 0, 0}, 10).state, kMarchInside);
    EXPECT_EQ(bricks.cast({0, 0, 0}, {1, 0, 0}, 10).t, 0);
    // In a brick just under the surface it is a hit at once.
    const HostBricks::Hit hit = bricks.cast({double(39.8f * 0.05f), 0, 0}, {0, 1, 0}, 10);
    EXPECT_EQ(hit.state, kMarchHit);
    EXPECT_EQ(hit.t, 0);
}

}  // namespace
}  // namespace kiln::field

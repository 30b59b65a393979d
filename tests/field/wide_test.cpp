// SPDX-License-Identifier: MIT
// Starts threads.
// Wide loops against one at a time: the same bits, from every instruction set, in both formats, for points and rays of all kinds.
#include "field/wide.h"

#include "field/host_bricks.h"
#include "field/worlds.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

namespace kiln::field {
namespace {

using worlds::edit;

HostBricks bricks_of(DistanceFormat format, std::span<const Edit> edits) {
    FieldOptions options;
    options.voxel_size = 0.03f;
    options.bounds = {{-1.2f, -1, -1}, {1, 1.1f, 1}};
    options.format = format;
    return HostBricks::bake(
        *Field::build(std::make_shared<const sdf::Program>(*sdf::compile({edits, {}, {}})), options));
}

// Balls, a thin wall, a cut, a solid whose middle has no bricks.
std::vector<Edit> mixed() {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> at(-0.9f, 0.9f), size(0.05f, 0.2f);
    std::vector<Edit> out{edit(Sphere{.radius = 0.6f}, {0.2f, 0, 0}),
                          edit(Box{.half_extents = {0.01f, 0.7f, 0.7f}}, {-0.8f, 0, 0})};
    for (int i = 0; i < 25; ++i)
        out.push_back(edit(Sphere{.radius = size(random)}, {at(random), at(random), at(random)},
                           i % 4 == 3 ? Op::Subtract : Op::Union, i % 3 == 0 ? 0.1f : 0.0f));
    return out;
}

std::vector<sdf::Isa> isas() {
    std::vector<sdf::Isa> out;
    for (const sdf::Isa isa : {sdf::Isa::Scalar, sdf::Isa::Sse4, sdf::Isa::Avx2, sdf::Isa::Avx512})
        if (sdf::has_isa(isa)) out.push_back(isa);
    return out;
}

struct Cloud {
    std::vector<float> x, y, z;
    void add(float a, float b, float c) {
        x.push_back(a);
        y.push_back(b);
        z.push_back(c);
    }
    sdf::Points points() const { return {x.data(), y.data(), z.data(), int(x.size())}; }
};

Cloud cloud() {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> in(-1.4f, 1.4f);
    Cloud out;
    for (int i = 0; i < 20011; ++i) out.add(in(random), in(random), in(random));    // not a multiple of any width
    for (int i = -40; i < 40; ++i) out.add(float(i) * 0.03f, float(i) * 0.21f, 0);  // on texels and on brick faces
    for (int i = 0; i < 30000; ++i) {  // in the order of space, so that neighbours share cells and slices
        const int x = i % 50, y = i / 50 % 20, z = i / 1000;
        out.add(float(x) * 0.03f - 0.8f, float(y) * 0.031f - 0.6f, float(z) * 0.033f - 0.5f);
    }
    for (int i = 0; i < 3000; ++i) out.add(0.2f + 0.001f * float(i % 10), float(i / 10) * 0.004f - 0.6f, 0.1f);
    const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
    for (const float far : {inf, -inf, nan, 1e30f, -1e30f, 1e9f})
        out.add(far, 0, 0), out.add(0, far, 0), out.add(0, 0, far);
    return out;
}

class WideInEachFormat : public testing::TestWithParam<DistanceFormat> {};

TEST_P(WideInEachFormat, DistancesAreThoseOfOnePointAtATimeOnEveryInstructionSet) {
    const HostBricks bricks = bricks_of(GetParam(), mixed());
    const Cloud c = cloud();
    for (const sdf::Isa isa : isas()) {
        std::vector<float> out(c.x.size(), -77);
        bricks.distances(c.points(), out.data(), isa);
        for (size_t i = 0; i < out.size(); ++i) {
            const float one = bricks.distance({c.x[i], c.y[i], c.z[i]}, sdf::Isa::Scalar);
            const float same = bricks.distance({c.x[i], c.y[i], c.z[i]}, isa);
            ASSERT_EQ(std::bit_cast<uint32_t>(one), std::bit_cast<uint32_t>(same)) << "isa " << int(isa);
            ASSERT_EQ(std::bit_cast<uint32_t>(out[i]), std::bit_cast<uint32_t>(one))
                << "isa " << int(isa) << " at " << c.x[i] << " " << c.y[i] << " " << c.z[i];
        }
    }
}

// Blocks of neighbours whose packets (16, 8 or 4 of them) go from cell to cell at any lane, into empty cells and out of the grid.
Cloud packets_across_cells() {
    constexpr float h = 0.03f, cell = 7 * h;
    std::mt19937 random(5);
    std::uniform_real_distribution<float> inside(0.01f, 0.99f);
    Cloud out;
    const auto point_in = [&](int x, int y, int z) {
        out.add((float(x) + inside(random)) * cell, (float(y) + inside(random)) * cell,
                (float(z) + inside(random)) * cell);
    };
    for (int i = 0; i < 12000; ++i) {
        const int cells = 1 + i % 5, base[3] = {int(random() % 12) - 6, int(random() % 12) - 6, int(random() % 12) - 6};
        int at[5][3];
        for (auto& one : at) {
            for (int axis = 0; axis < 3; ++axis) one[axis] = base[axis] + int(random() % 2);
        }
        int ends[5];
        for (int& end : ends) end = int(random() % 17);
        const bool mixed = i % 7 == 0;
        for (int lane = 0; lane < 16; ++lane) {
            int one = 0;
            while (one < cells - 1 && (mixed ? random() % 2 == 0 : lane >= ends[one])) ++one;
            point_in(at[one][0], at[one][1], at[one][2]);
        }
    }
    for (int i = 0; i < 4000; ++i) {  // on texels, also on those of faces, and on either zero
        const int x = i % 20 - 10, y = i / 20 % 20 - 10, z = i / 400 - 5;
        out.add(x == 0 ? -0.0f : float(x) * h, y == 0 ? -0.0f : float(y) * h, z == 0 ? -0.0f : float(z) * h);
    }
    return out;
}

TEST_P(WideInEachFormat, PacketsThatCrossCellsAtAnyLaneAnswerAsOnePointAtATime) {
    const HostBricks bricks = bricks_of(GetParam(), mixed());
    const Cloud c = packets_across_cells();
    std::vector<float> one(c.x.size());
    int negative = 0, unknown = 0;
    for (size_t i = 0; i < one.size(); ++i) {
        one[i] = bricks.distance({c.x[i], c.y[i], c.z[i]}, sdf::Isa::Scalar);
        negative += one[i] < 0;
        unknown += one[i] == 0;
    }
    EXPECT_GT(negative, 10000);
    EXPECT_GT(unknown, 1000);
    for (const sdf::Isa isa : isas()) {
        std::vector<float> out(c.x.size(), -77);
        bricks.distances(c.points(), out.data(), isa);
        for (size_t i = 0; i < out.size(); ++i)
            ASSERT_EQ(std::bit_cast<uint32_t>(out[i]), std::bit_cast<uint32_t>(one[i]))
                << "isa " << int(isa) << " point " << i << ", lane " << i % 16 << ": " << c.x[i] << " " << c.y[i] << " "
                << c.z[i];
    }
}

TEST_P(WideInEachFormat, DistancesAreTheBricksWhereOneIsAndABoundElsewhere) {
    const HostBricks bricks = bricks_of(GetParam(), mixed());
    const Cloud c = cloud();
    int in_bricks = 0, empty = 0, far = 0;
    for (size_t i = 0; i < c.x.size(); ++i) {
        if (!std::isfinite(c.x[i] + c.y[i] + c.z[i]) || std::abs(c.x[i] + c.y[i] + c.z[i]) > 100) continue;
        const dvec3 p{double(c.x[i]), double(c.y[i]), double(c.z[i])};
        const double d = double(bricks.distance({c.x[i], c.y[i], c.z[i]}));
        const HostBricks::Sample sample = bricks.sample(p);
        if (sample.from_brick) {
            EXPECT_NEAR(d, sample.distance, 1e-5);
            ++in_bricks;
            continue;
        }
        // Nothing but the exact value is known there: a bound, on the right side.
        EXPECT_LE(std::abs(d), std::abs(sample.distance) + 0.87 * 0.03);
        EXPECT_TRUE(d == 0 || std::abs(sample.distance) <= 0.03 || (d < 0) == (sample.distance < 0)) << d;
        ++empty;
        far += std::abs(d) > 0.3;
    }
    EXPECT_GT(in_bricks, 1500);
    EXPECT_GT(empty, 2000);
    EXPECT_GT(far, 50);
}

std::vector<Ray> all_kinds_of_rays() {
    std::mt19937 random(7);
    std::normal_distribution<float> gauss;
    std::uniform_real_distribution<float> in(-1.3f, 1.3f), far(0, 3);
    std::vector<Ray> out;
    for (int i = 0; i < 6003; ++i) {
        Ray ray;
        ray.direction = normalize(vec3{gauss(random), gauss(random), gauss(random)});
        ray.origin = {in(random), in(random), in(random)};
        if (i % 3 == 0) ray.origin = ray.direction * -4.0f + ray.origin * 0.5f;
        if (i % 7 == 0) ray.t_max = far(random);
        if (i % 11 == 0) ray.direction.x = 0, ray.direction = normalize(ray.direction);
        if (i % 13 == 0) ray.direction = {0, i % 2 == 0 ? 1.0f : -1.0f, 0};
        if (i % 17 == 0) ray.origin = {0.21f * float(i % 9 - 4), 0.03f * float(i % 5), 0.21f};  // on planes of texels
        out.push_back(ray);
    }
    return out;
}

TEST_P(WideInEachFormat, RaysHaveTheBitsOfTheScalarMarchOnEveryInstructionSet) {
    const HostBricks bricks = bricks_of(GetParam(), mixed());
    const std::vector<Ray> rays = all_kinds_of_rays();
    const float h = bricks.field().grid().voxel_size;
    std::array<int, 3> states{};
    std::vector<MarchHit> wide(rays.size());
    for (const sdf::Isa isa : isas()) {
        bricks.march(rays, wide.data(), isa);
        for (size_t i = 0; i < rays.size(); ++i) {
            const Ray& r = rays[i];
            const MarchHit one =
                bricks.march(texel_ray_of({double(r.origin.x), double(r.origin.y), double(r.origin.z)}, r.direction, h),
                             0, float(std::min(double(r.t_max) / double(h), double(kFarVoxels))));
            ASSERT_EQ(wide[i].state, one.state) << "isa " << int(isa) << " ray " << i;
            ASSERT_EQ(std::bit_cast<uint32_t>(wide[i].t), std::bit_cast<uint32_t>(one.t))
                << "isa " << int(isa) << " ray " << i;
            ASSERT_EQ(wide[i].cell, one.cell) << i;
            if (one.state == kMarchHit) {
                ASSERT_EQ(wide[i].slot, one.slot) << i;
                ASSERT_EQ(wide[i].voxel, one.voxel) << i;
                ASSERT_EQ(wide[i].p, one.p) << i;
            }
            ++states[size_t(one.state)];
        }
    }
    for (const int count : states) EXPECT_GT(count, 25 * int(isas().size()));
}

// Through edges and corners of voxels, bricks and boxes, where which plane is crossed first is a tie; and from lattice points within bricks.
std::vector<Ray> rays_through_the_lattice() {
    std::mt19937 random(17);
    const float h = 0.03f;
    std::vector<Ray> out;
    for (int i = 0; i < 30000; ++i) {
        const auto side = [&] { return float(int(random() % 5) - 2) * 0.5f; };
        vec3 d{side(), side(), side()};
        if (i % 3 == 0) d = {d.x < 0 ? -1.0f : 1.0f, d.y < 0 ? -1.0f : 1.0f, d.z < 0 ? -1.0f : 1.0f};
        if (dot(d, d) == 0) d.x = 1;
        const float nudge = i % 4 == 0 ? 1e-6f : 0.0f;
        const auto texel = [&] { return float(int(random() % 61) - 30) + nudge * float(int(random() % 5) - 2); };
        const vec3 to{texel() * h, texel() * h, texel() * h};
        const float steps = i % 2 == 0 ? 0.0f : float(random() % 60) * h;
        out.push_back({.origin = to - d * steps, .direction = normalize(d)});
    }
    return out;
}

TEST_P(WideInEachFormat, RaysThroughEdgesAndCornersHaveTheBitsOfTheScalarMarch) {
    const HostBricks bricks = bricks_of(GetParam(), mixed());
    const std::vector<Ray> rays = rays_through_the_lattice();
    const float h = bricks.field().grid().voxel_size;
    std::vector<MarchHit> one(rays.size()), wide(rays.size());
    int hits = 0;
    for (size_t i = 0; i < rays.size(); ++i) {
        const vec3& o = rays[i].origin;
        one[i] =
            bricks.march(texel_ray_of({double(o.x), double(o.y), double(o.z)}, rays[i].direction, h), 0, kFarVoxels);
        hits += one[i].state == kMarchHit;
    }
    EXPECT_GT(hits, 3000);
    for (const sdf::Isa isa : isas()) {
        bricks.march(rays, wide.data(), isa);
        for (size_t i = 0; i < rays.size(); ++i) {
            ASSERT_EQ(wide[i].state, one[i].state) << "isa " << int(isa) << " ray " << i;
            ASSERT_EQ(std::bit_cast<uint32_t>(wide[i].t), std::bit_cast<uint32_t>(one[i].t)) << "ray " << i;
            ASSERT_EQ(wide[i].slot, one[i].slot) << "ray " << i;
            ASSERT_EQ(wide[i].voxel, one[i].voxel) << "ray " << i;
            ASSERT_EQ(wide[i].p, one[i].p) << "ray " << i;
        }
    }
}

TEST_P(WideInEachFormat, ARefinedRayHasTheSameBitsAloneAndAmongOthersOnEveryInstructionSet) {
    const HostBricks bricks = bricks_of(GetParam(), mixed());
    const std::vector<Ray> rays = all_kinds_of_rays();
    std::vector<MarchHit> plain(rays.size()), alone(rays.size()), among(rays.size());
    bricks.march(rays, plain.data());
    for (size_t i = 0; i < rays.size(); ++i)
        bricks.march_refined(std::span(rays).subspan(i, 1), &alone[i], sdf::Isa::Scalar);
    int moved = 0, found = 0;
    for (const sdf::Isa isa : isas()) {
        bricks.march_refined(rays, among.data(), isa);
        for (size_t i = 0; i < rays.size(); ++i) {
            ASSERT_EQ(among[i].state, alone[i].state) << "isa " << int(isa) << " ray " << i;
            ASSERT_EQ(std::bit_cast<uint32_t>(among[i].t), std::bit_cast<uint32_t>(alone[i].t)) << "ray " << i;
            ASSERT_EQ(among[i].slot, alone[i].slot) << "ray " << i;
            ASSERT_EQ(among[i].voxel, alone[i].voxel) << "ray " << i;
            ASSERT_EQ(among[i].p, alone[i].p) << "ray " << i;
            moved += among[i].t != plain[i].t;
            found += among[i].state == kMarchHit && plain[i].state == kMarchMiss;
        }
    }
    EXPECT_GT(moved, 1000);
    EXPECT_GT(found, 0);
}

// Where a refined ray arrives, the edits have their surface; what was passed for the texels' sake alone is found.
TEST_P(WideInEachFormat, RefinedRaysEndOnTheEditsSurface) {
    const HostBricks bricks = bricks_of(GetParam(), mixed());
    const std::vector<Ray> rays = all_kinds_of_rays();
    const float h = bricks.field().grid().voxel_size;
    std::vector<MarchHit> hits(rays.size());
    bricks.march_refined(rays, hits.data());
    int on = 0, off = 0;
    for (size_t i = 0; i < rays.size(); ++i) {
        if (hits[i].state != kMarchHit || hits[i].t == 0) continue;
        const double t = double(hits[i].t) * double(h);
        const auto at = [&](float o, float d) { return double(o) + double(d) * t; };
        const dvec3 p{at(rays[i].origin.x, rays[i].direction.x), at(rays[i].origin.y, rays[i].direction.y),
                      at(rays[i].origin.z, rays[i].direction.z)};
        ++(std::abs(sdf::evaluate(sdf::view(bricks.field().program()), p)) <= 2e-3 * double(h) ? on : off);
        // The place in the brick is the place on the ray.
        const vec3 q{float(hits[i].cell.x * 7 + hits[i].voxel.x) + hits[i].p.x,
                     float(hits[i].cell.y * 7 + hits[i].voxel.y) + hits[i].p.y,
                     float(hits[i].cell.z * 7 + hits[i].voxel.z) + hits[i].p.z};
        EXPECT_LE(length(q * h - vec3{float(p.x), float(p.y), float(p.z)}), 1.6f * h) << i;
    }
    EXPECT_GT(on, 1000);
    EXPECT_LE(off, on / 20);  // grazing; and texels of eight bits are off by 1/64 voxel before
}

TEST_P(WideInEachFormat, RaysFollowABrickThatWasBakedAgain) {
    std::vector<Edit> edits = mixed();
    HostBricks bricks = bricks_of(GetParam(), edits);
    const std::vector<Ray> rays = all_kinds_of_rays();
    std::vector<MarchHit> before(rays.size()), after(rays.size()), anew(rays.size());
    bricks.march(rays, before.data());
    const HostBricks old = bricks;
    edits.push_back(edit(Sphere{.radius = 0.3f}, {0.5f, 0.1f, 0}, Op::Subtract));
    sdf::Program program = bricks.field().program();
    const RowChange change{kNoRow, *sdf::insert(program, edits.back(), {}, {}, sdf::order_at(edits.size()), 0)};
    ASSERT_TRUE(bricks.update(std::make_shared<const sdf::Program>(program), std::span(&change, 1)));
    bricks.march(rays, after.data());
    bricks_of(GetParam(), edits).march(rays, anew.data());
    int changed = 0;
    for (size_t i = 0; i < rays.size(); ++i) {
        EXPECT_EQ(after[i].state, anew[i].state);
        EXPECT_EQ(after[i].t, anew[i].t);
        changed += after[i].t != before[i].t;
    }
    EXPECT_GT(changed, 50);
    old.march(rays, after.data());  // the copy still is what it was
    for (size_t i = 0; i < rays.size(); ++i) EXPECT_EQ(after[i].t, before[i].t);
}

// Tables are made from those of the last state that was asked, whoever still holds it.
TEST_P(WideInEachFormat, AnswersFollowEditsWhoeverAskedBetween) {
    std::mt19937 random(11);
    std::uniform_real_distribution<float> at(-0.8f, 0.8f), size(0.02f, 0.15f);
    std::vector<Edit> edits = mixed();
    HostBricks bricks = bricks_of(GetParam(), edits);
    const Cloud c = cloud();
    const std::vector<Ray> rays = all_kinds_of_rays();
    struct Kept {
        HostBricks bricks;
        std::vector<float> distances;
    };
    std::vector<Kept> kept;
    std::vector<uint32_t> rows;
    std::vector<float> now(c.x.size()), anew(c.x.size());
    std::vector<MarchHit> hits(rays.size()), hits_anew(rays.size());
    for (int round = 0; round < 24; ++round) {
        sdf::Program program = bricks.field().program();
        RowChange change;
        if (round % 5 == 4) {  // the last edit goes again
            program.remove(rows.back());
            change.removed = rows.back();
            rows.pop_back();
            edits.pop_back();
        } else {
            edits.push_back(edit(Sphere{.radius = size(random)}, {at(random), at(random), at(random)},
                                 round % 2 == 0 ? Op::Subtract : Op::Union));
            change.inserted = *sdf::insert(program, edits.back(), {}, {}, sdf::order_at(edits.size()), 0);
            rows.push_back(change.inserted);
        }
        ASSERT_TRUE(bricks.update(std::make_shared<const sdf::Program>(program), std::span(&change, 1)));
        if (round % 3 == 1) continue;  // nobody asks
        bricks.distances(c.points(), now.data());
        bricks.march(rays, hits.data());
        const HostBricks fresh = HostBricks::bake(bricks.shared_field());
        fresh.distances(c.points(), anew.data());
        fresh.march(rays, hits_anew.data());
        for (size_t i = 0; i < now.size(); ++i)
            ASSERT_EQ(std::bit_cast<uint32_t>(now[i]), std::bit_cast<uint32_t>(anew[i])) << "round " << round;
        for (size_t i = 0; i < rays.size(); ++i) {
            ASSERT_EQ(hits[i].state, hits_anew[i].state) << "round " << round << " ray " << i;
            ASSERT_EQ(hits[i].t, hits_anew[i].t) << "round " << round << " ray " << i;
            ASSERT_EQ(hits[i].slot, hits_anew[i].slot) << "round " << round << " ray " << i;
        }
        if (round % 4 == 0) kept.push_back({bricks, now});
    }
    ASSERT_GT(kept.size(), 3u);
    for (const Kept& one : kept) {  // copies still answer for what they were
        one.bricks.distances(c.points(), now.data());
        EXPECT_EQ(now, one.distances);
    }
}

TEST(Wide, NoBricksAtAllAreNoTrouble) {
    const HostBricks bricks = bricks_of(DistanceFormat::Half, {});
    const Cloud c = cloud();
    const std::vector<Ray> rays = all_kinds_of_rays();
    for (const sdf::Isa isa : isas()) {
        std::vector<float> out(c.x.size());
        bricks.distances(c.points(), out.data(), isa);
        for (const float d : out) EXPECT_GE(d, 0);
        std::vector<MarchHit> hits(rays.size());
        bricks.march(rays, hits.data(), isa);
        for (const MarchHit& hit : hits) EXPECT_EQ(hit.state, kMarchMiss);
    }
}

INSTANTIATE_TEST_SUITE_P(Formats, WideInEachFormat, testing::Values(DistanceFormat::Half, DistanceFormat::Snorm8));

}  // namespace
}  // namespace kiln::field

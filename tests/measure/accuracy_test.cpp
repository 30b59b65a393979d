// SPDX-License-Identifier: MIT
// Starts threads.
// How true the bricks' answers are on the published scene, against the exact edits: what the scene says of the engine, not of the machine.
#include "measure/recipes.h"

#include "field/mesh_facts.h"
#include "field/meshing.h"
#include "field/self_crossings.h"
#include "scene/exact.h"
#include "sdf/eval.h"
#include "sdf/program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace kiln::measure {
namespace {

struct Baked {
    std::shared_ptr<const sdf::Program> program;
    field::HostBricks bricks;
};

Baked baked(int kind, uint32_t seed = 5, field::DistanceFormat format = field::DistanceFormat::Half) {
    const std::vector<Edit> edits = recipe(kind, seed, 1000);
    Baked out;
    out.program = std::make_shared<const sdf::Program>(*sdf::compile({edits, {}, {}}));
    field::FieldOptions options;
    options.voxel_size = 2.0f / 256;
    options.bounds = {{-1, -1, -1}, {1, 1, 1}};
    options.format = format;
    out.bricks = field::HostBricks::bake(*field::Field::build(out.program, options));
    return out;
}

class EachKind : public testing::TestWithParam<int> {};

// Two pixels or less from where a picture's depth jumps.
std::vector<bool> outlines(const std::vector<RayHit>& picture, int width, int height, double jump) {
    constexpr int kNear = 2;
    const auto at = [&](int x, int y) -> const RayHit& { return picture[size_t(y) * size_t(width) + size_t(x)]; };
    std::vector<bool> out(picture.size());
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            for (int v = std::max(y - kNear, 0); v <= std::min(y + kNear, height - 1); ++v) {
                for (int u = std::max(x - kNear, 0); u <= std::min(x + kNear, width - 1); ++u) {
                    const RayHit &a = at(x, y), &b = at(u, v);
                    if (a.hit != b.hit || (a.hit && std::abs(double(a.t) - double(b.t)) > jump))
                        out[size_t(y) * size_t(width) + size_t(x)] = true;
                }
            }
        }
    }
    return out;
}

void expect_exact_rays(int kind, uint32_t seed, int width, int height) {
    const Baked b = baked(kind, seed);
    const double voxel = 2.0 / 256;
    const std::vector<Ray> rays = picture_rays(width, height);
    std::vector<field::MarchHit> hits(rays.size());
    b.bricks.march_refined(rays, hits.data());
    std::vector<RayHit> truth(rays.size());
    scene::ExactField(*b.program).cast(rays, truth.data());
    const std::vector<bool> outline = outlines(truth, width, height, 4 * voxel);
    int false_hits = 0, false_misses = 0;
    std::vector<double> errors, errors_within;
    for (size_t i = 0; i < rays.size(); ++i) {
        const bool hit = hits[i].state == field::kMarchHit;
        false_hits += hit && !truth[i].hit;
        false_misses += !hit && truth[i].hit;
        if (!hit || !truth[i].hit) continue;
        errors.push_back(std::abs(double(hits[i].t) - double(truth[i].t) / voxel));
        if (!outline[i]) errors_within.push_back(errors.back());
    }
    std::sort(errors.begin(), errors.end());
    std::sort(errors_within.begin(), errors_within.end());
    ASSERT_GT(errors.size(), rays.size() / 10);
    ASSERT_GT(errors_within.size(), errors.size() / 20);
    const double p99 = errors_within[errors_within.size() * 99 / 100];
    std::printf(
        "kind %d seed %u: %d false hits, %d false misses of %zu rays; error median %.5f voxel, p99 within outlines "
        "%.4f of "
        "%zu\n",
        kind, seed, false_hits, false_misses, rays.size(), errors[errors.size() / 2], p99, errors_within.size());
    EXPECT_LE(false_hits, 1e-4 * double(rays.size()));
    EXPECT_LE(false_misses, 5e-4 * double(rays.size()));
    EXPECT_LE(errors[errors.size() / 2], 0.02);
    EXPECT_LE(p99, 0.1);
}

TEST_P(EachKind, RefinedRaysHitWhatTheExactEditsShow) { expect_exact_rays(GetParam(), 5, 320, 180); }

class EachKindSlow : public testing::TestWithParam<int> {};

TEST_P(EachKindSlow, RefinedRaysHitWhatTheExactEditsShow) {
    for (const uint32_t seed : {5u, 6u, 7u}) expect_exact_rays(GetParam(), seed, 640, 360);
}

TEST_P(EachKindSlow, MeshesAreClosedNearTheSurfaceAndNeverCrossThemselves) {
    for (const uint32_t seed : {5u, 6u, 7u}) {
        const Baked b = baked(GetParam(), seed);
        const field::MeshBricks bricks(b.bricks);
        const float voxel = bricks.voxel_size();
        const scene::ExactField exact(*b.program);
        for (const bool sharp : {false, true}) {
            field::Mesh mesh;
            if (sharp)
                field::mesh_sharp(bricks, field::exact_of(b.bricks, bricks), mesh);
            else
                field::mesh_smooth(bricks, mesh);
            const field::MeshFacts facts = field::mesh_facts(mesh.positions.span(), mesh.triangles.span());
            EXPECT_GT(facts.triangles, 900000u);
            EXPECT_EQ(facts.open_edges, 0u);
            EXPECT_EQ(facts.non_manifold_edges, 0u);
            EXPECT_EQ(facts.vertices, mesh.vertex_count());
            const auto crossings =
                field::meshes::SelfCrossings(mesh.positions.span(), mesh.triangles.span()).count(voxel);
            EXPECT_EQ(crossings.apart + crossings.at_vertex, 0u) << "seed " << seed << (sharp ? " sharp" : " smooth");
            std::vector<float> off(mesh.vertex_count());
            exact.distance(mesh.positions.span(), off.data());
            double most = 0, squares = 0;
            for (const float d : off) {
                most = std::max(most, std::abs(double(d)) / voxel);
                squares += double(d) * double(d) / (voxel * voxel);
            }
            const double rms = std::sqrt(squares / double(off.size()));
            std::printf("kind %d seed %u %s: %zu triangles, %zu late vertices, off by %.4f rms, %.4f at most\n",
                        GetParam(), seed, sharp ? "sharp" : "smooth", size_t(facts.triangles), mesh.late_bricks.size(),
                        rms, most);
            if (!sharp) continue;
            EXPECT_LE(rms, 0.025);
            EXPECT_LE(most, 0.5);
        }
    }
}

// Squared distance from p to a triangle: to its plane where the foot lies in it, else to its sides.
double squared_distance(vec3 p, vec3 a, vec3 b, vec3 c) {
    const auto to_side = [&](vec3 from, vec3 to) {
        const vec3 along = to - from;
        const float size = dot(along, along);
        const float t = size > 0 ? std::clamp(dot(p - from, along) / size, 0.0f, 1.0f) : 0.0f;
        const vec3 off = p - (from + along * t);
        return double(dot(off, off));
    };
    const vec3 n = cross(b - a, c - a);
    const auto left_of = [&](vec3 from, vec3 to) { return dot(cross(to - from, p - from), n) >= 0; };
    if (left_of(a, b) && left_of(b, c) && left_of(c, a) && dot(n, n) > 0) {
        const double height = double(dot(p - a, n));
        return height * height / double(dot(n, n));
    }
    return std::min({to_side(a, b), to_side(b, c), to_side(c, a)});
}

// Whether what lies along the surface's normal at a surface point, air outwards or solid inwards, ends before `limit` metres.
bool thin_at(const scene::ExactField& exact, vec3 surface, double limit) {
    const vec3 normal = exact.sample(surface).normal;
    for (const double side : {1.0, -1.0}) {
        for (double t = 0.01 * limit; t < limit;) {
            const double along = side * t;
            const double d = side * exact.distance({double(surface.x) + along * double(normal.x),
                                                    double(surface.y) + along * double(normal.y),
                                                    double(surface.z) + along * double(normal.z)});
            if (d <= 0) return true;
            t += std::max(d, 1e-3 * limit);
        }
    }
    return false;
}

// A gap or a wall there narrower than a voxel. At the bottom of a groove a point has the normals of both its flanks and thus none: points
// of the surface a tenth of a voxel away are asked too, which find it where the flanks make less than a right angle.
bool narrower_than_voxel(const scene::ExactField& exact, vec3 surface, float voxel) {
    if (thin_at(exact, surface, double(voxel))) return true;
    for (const vec3 axis : {vec3{1, 0, 0}, vec3{0, 1, 0}, vec3{0, 0, 1}}) {
        for (const float by : {0.1f * voxel, -0.1f * voxel}) {
            const NearestPoint beside = exact.nearest(surface + axis * by, voxel);
            if (beside.found && thin_at(exact, beside.position, double(voxel))) return true;
        }
    }
    return false;
}

// Symmetric Hausdorff distance at four samples a voxel, in boxes of fourteen voxels. Where things crowd there are gaps and walls that no texel
// lies in, since they are narrower than texels are apart: no mesh of the texels' signs has them. A sample that is far from the mesh must
// lie on one.
TEST_P(EachKindSlow, SharpMeshAndSurfaceAreWithinSixTenthsOfAVoxelOfEachOther) {
    constexpr float kVoxel = 2.0f / 256, kHalf = 7 * kVoxel, kStep = kVoxel / 4, kReach = 2 * kVoxel;
    const Baked b = baked(GetParam());
    const scene::ExactField exact(*b.program);
    const field::MeshBricks bricks(b.bricks);
    field::Mesh mesh;
    field::mesh_sharp(bricks, field::exact_of(b.bricks, bricks), mesh);
    double to_surface = 0, to_mesh = 0;
    size_t samples = 0, points = 0, narrow = 0, lost = 0;
    for (uint32_t box = 0; box < 6; ++box) {
        const auto c = [&](uint32_t axis) { return -0.5f + uniform(17, box, axis); };
        const vec3 center{c(0), c(1), c(2)};
        const auto within = [&](vec3 p, float half) {
            const vec3 d = p - center;
            return std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)}) <= half;
        };
        std::vector<std::array<vec3, 3>> near;
        std::vector<vec3> asked;
        for (size_t t = 0; t < mesh.triangle_count(); ++t) {
            const auto corner = [&](size_t i) { return mesh.positions[mesh.triangles[3 * t + i]]; };
            if (!within(corner(0), kHalf + kReach + 2 * kVoxel)) continue;
            near.push_back({corner(0), corner(1), corner(2)});
            if (!within(corner(0), kHalf)) continue;
            const vec3 u = corner(1) - corner(0), v = corner(2) - corner(0);
            const int steps = std::max(1, int(std::ceil(std::max(length(u), length(v)) / kStep)));
            for (int i = 0; i <= steps; ++i)
                for (int k = 0; i + k <= steps; ++k)
                    asked.push_back(corner(0) + u * (float(i) / float(steps)) + v * (float(k) / float(steps)));
        }
        std::vector<NearestPoint> answers(asked.size());
        exact.nearest(asked, kReach, answers.data());
        for (const NearestPoint& n : answers) {
            EXPECT_TRUE(n.found);
            to_surface = std::max(to_surface, double(std::abs(n.distance)) / double(kVoxel));
        }
        samples += asked.size();

        asked.clear();
        const int side = int(2 * kHalf / kStep);
        for (int i = 0; i < side * side * side; ++i) {
            const auto at = [&](int n) { return (float(n) + 0.5f) * kStep - kHalf; };
            const vec3 p = center + vec3{at(i % side), at(i / side % side), at(i / side / side)};
            if (std::abs(exact.distance({double(p.x), double(p.y), double(p.z)})) < double(kStep)) asked.push_back(p);
        }
        answers.resize(asked.size());
        exact.nearest(asked, kReach, answers.data());
        for (const NearestPoint& n : answers) {
            if (!n.found) continue;
            double least = 1e9;
            for (const auto& [p, q, r] : near) {
                const vec3 low = min(min(p, q), r), high = max(max(p, q), r), at = n.position;
                const vec3 gap = max(max(low - at, at - high), vec3{});
                if (double(dot(gap, gap)) < least) least = std::min(least, squared_distance(at, p, q, r));
            }
            const double off = std::sqrt(least) / double(kVoxel);
            if (off <= 0.6) {
                to_mesh = std::max(to_mesh, off);
                continue;
            }
            ++(narrower_than_voxel(exact, n.position, kVoxel) ? narrow : lost);
        }
        points += asked.size();
    }
    std::printf(
        "kind %d: mesh to surface %.4f voxel of %zu samples, surface to mesh %.4f of %zu but %zu on gaps and walls "
        "narrower than a voxel\n",
        GetParam(), to_surface, samples, to_mesh, points, narrow);
    EXPECT_GT(samples, 20000u);
    EXPECT_GT(points, 20000u);
    EXPECT_LE(to_surface, 0.6);
    EXPECT_LE(to_mesh, 0.6);
    EXPECT_EQ(lost, 0u);
    EXPECT_LE(narrow, GetParam() == 2 ? points / 40 : 0u);
}

// What a texel is off by has two sources, told apart: the value in single precision, and the code that stores it. Halves are 2^-9 apart
// between 2 and 4 voxels, so a code is off by 2^-10 at most. Eight bits are 4/127 apart, half of which is less than 1/64; but a value that
// is not 0 never becomes 0, so one below half a step is off by up to a whole one.
TEST_P(EachKindSlow, TexelsAreTheExactDistanceInAFloatRoundedOnce) {
    using field::DistanceFormat;
    for (const DistanceFormat format : {DistanceFormat::Half, DistanceFormat::Snorm8}) {
        const Baked b = baked(GetParam(), 5, format);
        const scene::ExactField exact(*b.program);
        const float voxel = b.bricks.field().grid().voxel_size;
        double code = 0, code_at_zero = 0, value = 0;
        size_t count = 0;
        const auto slots = b.bricks.field().slots();
        for (size_t s = 0; s < slots.size(); s += 23) {
            const field::BrickRecord& r = b.bricks.field().records()[slots[s]];
            std::vector<float> x(512), y(512), z(512), d(512);
            for (size_t i = 0; i < 512; ++i) {
                x[i] = float(r.texel_x + int(i & 7)) * voxel;
                y[i] = float(r.texel_y + int(i >> 3 & 7)) * voxel;
                z[i] = float(r.texel_z + int(i >> 6)) * voxel;
            }
            sdf::evaluate(sdf::view(*b.program), {x.data(), y.data(), z.data(), 512}, d.data());
            for (size_t i = 0; i < 512; ++i) {
                const double brute = double(d[i] * (1 / voxel));
                if (std::abs(brute) > 4) continue;
                ++count;
                const double stored = double(b.bricks.texel(slots[s], int(i & 7), int(i >> 3 & 7), int(i >> 6)));
                double& most = std::abs(brute) < 2.0 / 127 ? code_at_zero : code;
                most = std::max(most, std::abs(stored - brute));
                const double truth = exact.distance({double(x[i]), double(y[i]), double(z[i])}) / double(voxel);
                value = std::max(value, std::abs(brute - truth));
                EXPECT_EQ(stored <= 0, brute <= 0);
            }
        }
        const bool half = format == DistanceFormat::Half;
        std::printf("kind %d, %s: codes off by %.7f voxel at most, %.7f within 2/127 of 0; values by %.2e; of %zu\n",
                    GetParam(), half ? "16 bits" : "8 bits", code, code_at_zero, value, count);
        EXPECT_GT(count, 100000u);
        EXPECT_LE(code, half ? 0x1p-10 : 2.001 / 127);
        EXPECT_LE(code_at_zero, half ? 0x1p-10 : 4.001 / 127);
        EXPECT_LE(value, 1e-5);
    }
}

// Of the exact edits near the surface: with hard operations the field is a distance but for creases; blends flatten it and never steepen it.
TEST_P(EachKindSlow, GradientsNearTheSurfaceAreOneWhereOperationsAreHardAndNeverMore) {
    constexpr double kVoxel = 2.0 / 256, kBy = 1e-3 * kVoxel;
    for (const float blend : {0.0f, kSmoothRadius, 2 * kSmoothRadius}) {
        std::vector<Edit> edits = recipe(GetParam(), 5, 1000);
        for (Edit& e : edits) e.blend_radius = blend;
        const auto program = sdf::compile({edits, {}, {}});
        ASSERT_TRUE(program);
        const scene::ExactField exact(*program);
        size_t band = 0, near_one = 0, steep = 0;
        for (const vec3 at : random_points(200000)) {
            const dvec3 p{double(at.x), double(at.y), double(at.z)};
            if (std::abs(exact.distance(p)) > 3 * kVoxel) continue;
            const auto slope = [&](double x, double y, double z) {
                return (exact.distance({p.x + x, p.y + y, p.z + z}) - exact.distance({p.x - x, p.y - y, p.z - z})) /
                       (2 * kBy);
            };
            const double size = std::hypot(slope(kBy, 0, 0), slope(0, kBy, 0), slope(0, 0, kBy));
            ++band;
            near_one += std::abs(size - 1) <= 0.05;
            steep += size > 1.01;
        }
        const double share = double(near_one) / double(band);
        std::printf("kind %d blend %.1f voxels: %.2f %% of %zu gradients within 5 %% of 1\n", GetParam(),
                    double(blend) / kVoxel, 100 * share, band);
        EXPECT_GT(band, 10000u);
        EXPECT_EQ(steep, 0u);
        if (blend == 0) {
            EXPECT_GE(share, 0.99);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Kinds, EachKindSlow, testing::Values(0, 1, 2));

INSTANTIATE_TEST_SUITE_P(Kinds, EachKind, testing::Values(0, 1, 2));

}  // namespace
}  // namespace kiln::measure

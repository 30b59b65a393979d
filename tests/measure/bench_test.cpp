// SPDX-License-Identifier: MIT
// Starts threads.
// Benchmarks do the work they say: the scenes are those of the recipe, and every row's result is the slow way's.
#include "measure/bench_run.h"
#include "measure/letters.h"
#include "measure/recipes.h"
#include "measure/slow.h"
#include "measure/slow_mesh.h"
#include "physics/physics.h"

#include "sdf/eval.h"
#include "sdf/expression.h"
#include "sdf/program.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace kiln::measure {
namespace {

using testing::HasSubstr;

double distance_at(const std::vector<Edit>& edits, dvec3 p) {
    return sdf::evaluate(sdf::view(*sdf::compile({edits, {}, {}})), p);
}

TEST(Recipes, AreThePublishedScenes) {
    EXPECT_NEAR(double(uniform(5, 0, 0)), 0.31134617, 1e-8);
    const std::vector<Edit> pebbles = recipe(0, 5, 1000);
    const vec3 c = pebbles[0].node.transform.position;
    EXPECT_NEAR(double(c.x), -0.339577, 1e-6);
    EXPECT_NEAR(double(c.y), -0.136894, 1e-6);
    EXPECT_NEAR(double(c.z), -0.454261, 1e-6);
    int spheres = 0, cuts = 0;
    for (const Edit& e : pebbles) spheres += e.node.shape.kind == uint16_t(ShapeKind::Sphere);
    EXPECT_EQ(spheres, 512);
    EXPECT_NEAR(distance_at(pebbles, {0, 0, 0}), -0.018778, 1e-6);
    EXPECT_NEAR(distance_at(pebbles, {0.3, -0.2, 0.5}), 0.024931, 1e-6);
    for (const Edit& e : recipe(1, 5, 1000)) cuts += e.op == Op::Subtract;
    EXPECT_EQ(cuts, 300);
    EXPECT_NEAR(distance_at(recipe(2, 5, 1000), {0, 0, 0}), -0.006656, 1e-6);
    EXPECT_NEAR(distance_at(recipe(2, 5, 1000), {0.3, -0.2, 0.5}), -0.007597, 1e-6);
    EXPECT_NEAR(distance_at(recipe(0, 5, 100), {0, 0, 0}), 0.133487, 1e-6);
}

TEST(Recipes, TheLettersAreAsManyOperationsAsThePublicModel) {
    const std::string text = letters_model(224, true, 5);
    EXPECT_EQ(std::ranges::count(text, '\n'), 1 + 7866);  // a comment before them
    EXPECT_TRUE(sdf::read_vm(text));
}

BenchOptions small(std::vector<int> kinds) {
    BenchOptions o;
    o.kinds = std::move(kinds);
    o.seed = 11;
    o.count = 60;
    o.resolution = 48;
    o.runs = 1;
    o.threads = 1;
    return o;
}

TEST(Bench, ThePictureOfAFormulaIsBesideBruteForce) {
    const std::vector<std::string> names{"expression"};
    const auto report = run_bench(names, small({0}));
    ASSERT_TRUE(report) << report.error().message;
    ASSERT_EQ(report->rows.size(), 1u);
    EXPECT_EQ(report->rows[0].unit, "ms");
    EXPECT_THAT(report->rows[0].peer, HasSubstr("every operation"));
    EXPECT_FALSE(report->rows[0].checksum.empty());
}

TEST(Bench, EveryRowOfEveryKindEqualsTheSlowWay) {
    const std::vector<std::string> field{"field"};
    const auto report = run_bench(field, small({0, 1, 2}));
    ASSERT_TRUE(report) << report.error().message;
    size_t rows = 0;
    for (const BenchInfo& info : bench_list())
        if (info.name == "field") rows = info.rows.size();
    EXPECT_EQ(report->rows.size(), 3 * rows);
    for (const BenchRow& row : report->rows) {
        EXPECT_GT(row.value, 0) << row.name;
        EXPECT_EQ(row.checksum.size(), 16u) << row.name;
        EXPECT_EQ(row.threads, 1) << row.name;
        EXPECT_FALSE(row.unit.empty()) << row.name;
        const bool bakes = row.name == "bake" || row.name.starts_with("edit.") || row.name == "undo";
        EXPECT_EQ(row.texels > 0, bakes && !row.name.starts_with("edit.among")) << row.name;
        EXPECT_EQ(row.texels, uint64_t(row.bricks * 512 + 0.5)) << row.name;
        EXPECT_EQ(std::isfinite(row.ratio), !row.peer.empty()) << row.name;
    }
}

TEST(Bench, ASceneFromAFileIsAskedWhatARecipeIs) {
    BenchOptions options = small({0});
    options.scene = "orbit";
    const std::vector<std::string> rows{"field/bake", "field/mesh.smooth", "field/mesh.sharp", "field/memory.8_bit"};
    const auto report = run_bench(rows, options);
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_EQ(report->rows.size(), 4u);
    for (const BenchRow& row : report->rows) {
        EXPECT_EQ(row.scene, "orbit");
        EXPECT_GT(row.count, 20u);
        EXPECT_GT(row.value, 0) << row.name;
        EXPECT_TRUE(row.peer.empty()) << row.name;
        EXPECT_EQ(row.name == "bake", row.texels > 0);
    }
    for (const std::string name : {"field/edit.add", "field/undo", "expression"}) {
        const auto refused = run_bench(std::vector<std::string>{name}, options);
        ASSERT_FALSE(refused) << name;
        EXPECT_EQ(refused.error().kind, ErrorKind::Usage);
        EXPECT_THAT(refused.error().message, HasSubstr("--scene"));
    }
    options.scene = "nowhere.kiln.json";
    const auto missing = run_bench({}, options);
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().kind, ErrorKind::Input);
}

TEST(Bench, WhatTheJournalRowsDidReadsBackAsItWas) {
    const std::vector<std::string> journal{"journal"};
    const auto report = run_bench(journal, small({0}));
    ASSERT_TRUE(report) << report.error().message;
    ASSERT_EQ(report->rows.size(), 3u);
    for (const BenchRow& row : report->rows) {
        EXPECT_GT(row.value, 0) << row.name;
        EXPECT_EQ(row.checksum.size(), 16u) << row.name;
    }
}

TEST(Bench, FlyingDiggingAndMovingLeaveWhatABuildFromNothingHolds) {
    // Flights take seconds: these two rows are the quick ones. Counts are checked as they fly.
    const std::vector<std::string> rows{"world/dig", "world/move.1000"};
    const auto report = run_bench(rows, small({0}));
    ASSERT_TRUE(report) << report.error().message;
    ASSERT_EQ(report->rows.size(), 6u);
    for (const BenchRow& row : report->rows) {
        EXPECT_GT(row.value, 0) << row.name;
        EXPECT_EQ(row.checksum.size(), 16u) << row.name;
    }
}

TEST(BenchSlow, FlightsMakeNoCellThatDidNotEnterAndEndAsTheyShould) {
    const std::vector<std::string> rows{"world/fly", "world/fast", "world/teleport", "world/arrive"};
    const auto report = run_bench(rows, small({0}));
    ASSERT_TRUE(report) << report.error().message;
    ASSERT_EQ(report->rows.size(), 16u);
    EXPECT_GT(report->rows.back().ratio, 1.2) << "what is seen is not made first";
}

void edits_of_scenes_equal_a_rebuild(std::span<const std::string> scenes) {
    std::vector<std::string> rows;
    for (const std::string& scene : scenes) {
        for (const char* what : {"cut", "add", "smooth", "move", "remove"})
            rows.push_back("edits/" + scene + "." + what);
    }
    const auto report = run_bench(rows, small({0}));
    ASSERT_TRUE(report) << report.error().message;
    ASSERT_EQ(report->rows.size(), rows.size());
    std::set<std::string> checksums;
    for (size_t i = 0; i < rows.size(); ++i) {
        const BenchRow& row = report->rows[i];
        EXPECT_EQ("edits/" + row.name, rows[i]);
        EXPECT_EQ(row.scene, scenes[i / 5]);
        EXPECT_GT(row.value, 0) << row.name;
        EXPECT_EQ(row.unit, "µs");
        EXPECT_EQ(row.checksum.size(), 16u) << row.name;
        checksums.insert(row.checksum);
    }
    EXPECT_EQ(checksums.size(), rows.size()) << "two changes left the same bricks";
}

TEST(Bench, EditsOfASceneEndInWhatABuildFromNothingHolds) {
    edits_of_scenes_equal_a_rebuild(std::vector<std::string>{"workbench"});
}

TEST(BenchSlow, EditsOfLargeScenesEndInWhatABuildFromNothingHolds) {
    edits_of_scenes_equal_a_rebuild(std::vector<std::string>{"archipelago", "quarry"});
}

TEST(Bench, AChecksumFollowsTheSceneAndNothingElse) {
    const std::vector<std::string> bake{"field/bake"};
    const auto checksum = [&](const BenchOptions& o) { return run_bench(bake, o)->rows.at(0).checksum; };
    const BenchOptions one = small({0});
    BenchOptions other = one, threads = one;
    other.seed = 12;
    threads.threads = 2;
    EXPECT_EQ(checksum(one), checksum(one));
    EXPECT_EQ(checksum(one), checksum(threads));
    EXPECT_NE(checksum(one), checksum(other));
}

TEST(Bench, AResultThatIsNotTheSlowWaysEndsTheRun) {
    BenchRun run(BenchOptions{}, {}, {}, 1);
    BenchRow row;
    row.name = "bake";
    run.add_checked(row, 1, 1);
    EXPECT_FALSE(run.fault());
    run.add_checked(row, 1, 2);
    ASSERT_TRUE(run.fault());
    EXPECT_THAT(run.fault()->message, HasSubstr("bake"));
}

TEST(Bench, TheSlowWaySeesOneTexelThatDiffers) {
    const std::vector<Edit> edits = recipe(0, 5, 30);
    std::vector<Edit> moved = edits;
    moved[7].node.transform.position.x += 1e-4f;
    field::FieldOptions options;
    options.voxel_size = 2.0f / 48;
    options.bounds = {{-1, -1, -1}, {1, 1, 1}};
    const auto program = std::make_shared<const sdf::Program>(*sdf::compile({edits, {}, {}}));
    const field::HostBricks bricks = field::HostBricks::bake(*field::Field::build(program, options));
    for (const uint64_t stride : {1u, 7u}) {
        const Stored slow = brute_force(*program, bricks.field(), stride);
        EXPECT_EQ(stored(bricks, stride).checksum, slow.checksum);
        EXPECT_GT(slow.band_voxels, slow.bricks);
    }
    EXPECT_NE(brute_force(*sdf::compile({moved, {}, {}}), bricks.field()).checksum, stored(bricks).checksum);
}

TEST(Bench, TheSlowMeshSeesOneCornerThatMoved) {
    field::FieldOptions options;
    options.voxel_size = 2.0f / 48;
    options.bounds = {{-1, -1, -1}, {1, 1, 1}};
    const auto program = std::make_shared<const sdf::Program>(*sdf::compile({recipe(1, 5, 60), {}, {}}));
    const field::HostBricks host = field::HostBricks::bake(*field::Field::build(program, options));
    const field::MeshBricks bricks(host);
    field::Mesh smooth, sharp, slow_way;
    field::mesh_smooth(bricks, smooth);
    EXPECT_EQ(checksum_of_triangles(smooth), smooth_mesh_by_voxel(host));
    const auto edges = [&] {
        return checksum_of_edges(smooth.positions.span(), smooth.triangles.span(), options.voxel_size);
    };
    const uint64_t named = edges_by_voxel(host, {{-2, -2, -2}, {2, 2, 2}});
    EXPECT_EQ(edges(), named);
    EXPECT_NE(edges(), edges_by_voxel(host, {{-2, -2, -2}, {2, 0.5f, 2}}));
    smooth.positions[7].y = std::nextafter(smooth.positions[7].y, 2.0f);
    EXPECT_NE(checksum_of_triangles(smooth), smooth_mesh_by_voxel(host));
    smooth.positions[7].x += options.voxel_size;
    EXPECT_NE(edges(), named);
    field::mesh_sharp(bricks, field::exact_of(host, bricks), sharp);
    field::mesh_sharp(bricks, every_edit(host, bricks, 1), slow_way);
    EXPECT_EQ(checksum_of_bytes(sharp), checksum_of_bytes(slow_way));
    std::swap(sharp.triangles[3], sharp.triangles[4]);
    EXPECT_NE(checksum_of_bytes(sharp), checksum_of_bytes(slow_way));
}

TEST(Bench, SettledGroundIsMeshedAsOneMeshOfTheWholeWouldBe) {
    const std::vector<std::string> rows{"physics/mesh.region", "physics/mesh.collider"};
    const auto report = run_bench(rows, small({0}));
    ASSERT_TRUE(report) << report.error().message;
    size_t engines = 0;
    for (const physics::Backend& engine : physics::backends()) engines += engine.why_not.empty();
    ASSERT_EQ(report->rows.size(), 1 + engines);
    EXPECT_EQ(report->rows[0].name, "mesh.region");
    for (const BenchRow& row : report->rows) {
        EXPECT_EQ(row.unit, "Mtri/s") << row.name;
        EXPECT_GT(row.value, 0) << row.name;
        EXPECT_EQ(row.checksum, report->rows[0].checksum) << row.name;
        EXPECT_EQ(row.peer.empty(), row.name == "mesh.region") << row.name;
    }
}

TEST(BenchFrameGpu, EveryPassOfEverySizeIsARowAndPicturesAreTheSame) {
    const std::vector<std::string> rows{"frame/workbench"};
    BenchOptions o = small({0});
    o.runs = 1;
    o.sizes = {{48, 27}, {24, 16}};
    const auto report = run_bench(rows, o);
    ASSERT_TRUE(report) << report.error().message;
    if (report->rows.empty()) GTEST_SKIP() << "no Vulkan device";
    for (const char* name : {"frame/workbench/48x27/mesh shadow", "frame/workbench/48x27/all",
                             "frame/workbench/24x16/mesh shadow", "frame/workbench/24x16/all"})
        EXPECT_EQ(std::ranges::count(report->rows, name, &BenchRow::name), 1) << name;
    for (const BenchRow& row : report->rows) {
        EXPECT_GE(row.value, 0) << row.name;
        EXPECT_EQ(row.unit, "ms");
        EXPECT_EQ(row.checksum.size(), 16u) << row.name;
    }
}

TEST(BenchGpu, TheDevicesBakeIsBesideTheCpusAndHasItsTexels) {
    const std::vector<std::string> rows{"gpu/bake"};
    const auto report = run_bench(rows, small({0, 2}));
    ASSERT_TRUE(report) << report.error().message;
    if (report->rows.empty()) GTEST_SKIP() << "no Vulkan device";
    ASSERT_EQ(report->rows.size(), 2u);
    for (const BenchRow& row : report->rows) {
        EXPECT_THAT(row.name, testing::MatchesRegex("gpu.bake/.+")) << "the device's name";
        EXPECT_GT(row.value, 0);
        EXPECT_GT(row.peer_value, 0);
        EXPECT_GT(row.texels, 0u);
        EXPECT_EQ(row.checksum.size(), 16u);
    }
}

TEST(Bench, WrongWordsAreToldWithTheMend) {
    const std::vector<std::string> unknown{"feild"};
    const auto report = run_bench(unknown, small({0}));
    ASSERT_FALSE(report);
    EXPECT_EQ(report.error().kind, ErrorKind::Usage);
    EXPECT_THAT(report.error().message, HasSubstr("did you mean \"field\"?"));
    const std::vector<std::string> far_off{"weather"};
    const auto none_near = run_bench(far_off, small({0}));
    ASSERT_FALSE(none_near);
    EXPECT_THAT(none_near.error().message, HasSubstr("--list"));
    EXPECT_FALSE(run_bench({}, small({3})));
    BenchOptions none = small({0});
    none.count = 0;
    EXPECT_FALSE(run_bench({}, none));
    BenchOptions flat = small({0});
    flat.sizes = {{480, 0}};
    EXPECT_FALSE(run_bench({}, flat));
}

}  // namespace
}  // namespace kiln::measure

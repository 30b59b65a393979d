// SPDX-License-Identifier: MIT
// Starts threads.
// Bodies and dynamic edits: seen and asked where they are, as the scene says they are seen, and moved without baking.
#include "scene/box_cover.h"
#include "field/brick_set.h"
#include "field/clipmap.h"
#include "field/field.h"
#include "field/host_bricks.h"
#include "simulated.h"

#include <kiln/world.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace kiln {
namespace {

using scene::parsed;

uint64_t bricks_of(const World& world) {
    auto frame = world.frame();
    EXPECT_TRUE(frame) << (frame ? "" : frame.error().message);
    return field::HostBricks::bake(frame->field).hash();
}

EditId id_of(const World& world, std::string_view name) {
    const auto id = world.find_edit(name);
    EXPECT_TRUE(id) << name;
    return id.value_or(EditId{});
}

const char* const kField =
    R"("format": 1, "field": {"voxel_size": 0.05, "bounds": {"min": [-3, -2, -3], "max": [3, 3, 3]}})";

TEST(Movers, BodiesLeaveTheListAndAreSeenWhereTheyStartAsHardUnions) {
    const std::string edits = R"("edits": [
        {"id": "ground", "shape": "sphere", "radius": 1.2, "position": [0, -1, 0]},
        {"id": "rock", "shape": "sphere", "radius": 0.5, "position": [0, 0.5, 0], "blend_radius": 0.3},
        {"id": "hole", "shape": "box", "half_extents": [0.2, 2, 0.2], "op": "subtract", "position": [0, 0.6, 0.3]},
        {"id": "cut", "shape": "sphere", "radius": 0.7, "position": [0.8, 0, 0], "op": "subtract", "blend_radius": 0.1}])";
    const World world =
        parsed(std::string("{") + kField + "," + edits + R"(, "bodies": [{"id": "b", "edits": ["rock", "hole"]}]})");
    const World ground = parsed(std::string("{") + kField + R"(, "edits": [
        {"id": "ground", "shape": "sphere", "radius": 1.2, "position": [0, -1, 0]},
        {"id": "cut", "shape": "sphere", "radius": 0.7, "position": [0.8, 0, 0], "op": "subtract", "blend_radius": 0.1}]})");
    const World body = parsed(std::string("{") + kField + R"(, "edits": [
        {"id": "rock", "shape": "sphere", "radius": 0.5, "position": [0, 0.5, 0]},
        {"id": "hole", "shape": "box", "half_extents": [0.2, 2, 0.2], "op": "subtract", "position": [0, 0.6, 0.3]}]})");
    std::mt19937 random(4);
    std::uniform_real_distribution<float> in(-2, 2);
    for (int i = 0; i < 2000; ++i) {
        const vec3 p{in(random), in(random), in(random)};
        EXPECT_NEAR(world.distance(p), std::min(ground.distance(p), body.distance(p)), 2e-6f);
    }
    EXPECT_EQ(bricks_of(world), bricks_of(ground)) << "the field is that of the world alone";
    auto frame = world.frame();
    ASSERT_TRUE(frame);
    ASSERT_EQ(frame->instances.size(), 1u);
    EXPECT_EQ(frame->instances[0].pose.position, (vec3{0, 0.5f, 0}));
    // Whose surface a ray meets.
    const RayHit above = world.cast({.origin = {0, 3, -0.2f}, .direction = {0, -1, 0}});
    ASSERT_TRUE(above.hit);
    EXPECT_EQ(above.edit, id_of(world, "rock"));
    const RayHit in_hole = world.cast({.origin = {0, 0.5f, 0.3f}, .direction = {0, 0, -1}});
    ASSERT_TRUE(in_hole.hit);
    EXPECT_EQ(in_hole.edit, id_of(world, "hole"));
    EXPECT_TRUE(world.view().overlaps_sphere({0, 0.95f, -0.2f}, 0.1f));
    EXPECT_TRUE(world.mesh({.cell = 0.1f}));
    // From its bricks, too.
    const FieldSample near = world.sample({0.02f, 0.3f, -0.47f}, FieldSource::Bricks);
    EXPECT_NEAR(near.distance, world.distance({0.02f, 0.3f, -0.47f}), 0.01f);
}

std::string random_edits(uint32_t seed, bool dynamic) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> in(-1.5f, 1.5f), size(0.15f, 0.5f), any(0, 1);
    std::string out = R"("materials": {"m": {}}, "edits": [{"id": "g", "shape": "plane", "position": [0, -1, 0]})";
    for (int i = 0; i < 14; ++i) {
        char text[400];
        const bool hard = any(random) < 0.7f;
        const float kind = any(random);
        const char* const op = kind < 0.75f ? "union" : kind < 0.9f ? "subtract" : "paint";
        std::snprintf(
            text, sizeof text,
            R"(, {"id": "e%d", "shape": "box", "half_extents": [%.3f, %.3f, %.3f], "position": [%.3f, %.3f, %.3f],
                         "rotation": [0, %.4f, 0, %.4f], "op": "%s", "blend_radius": %.2f, "material": "m"%s})",
            i, double(size(random)), double(size(random)), double(size(random)), double(in(random)), double(in(random)),
            double(in(random)), std::sin(double(i)), std::cos(double(i)), op, hard ? 0.0 : 0.2,
            dynamic && i % 2 == 0 ? R"(, "dynamic": true)" : "");
        out += text;
    }
    return out + "]";
}

TEST(Movers, DynamicIsAHintThatNeverChangesAnAnswer) {
    int apart = 0, within = 0;
    for (uint32_t seed = 1; seed <= 12; ++seed) {
        const World still = parsed(std::string("{") + kField + "," + random_edits(seed, false) + "}");
        const World world = parsed(std::string("{") + kField + "," + random_edits(seed, true) + "}");
        auto frame = world.frame();
        ASSERT_TRUE(frame);
        apart += int(frame->instances.size());
        within += 7 - int(frame->instances.size());
        std::mt19937 random(seed);
        std::uniform_real_distribution<float> in(-2, 2);
        for (int i = 0; i < 1500; ++i) {
            const vec3 p{in(random), in(random), in(random)};
            const float expected = still.distance(p);
            EXPECT_NEAR(world.distance(p), expected, 3e-6f) << "seed " << seed;
        }
        for (int i = 0; i < 200; ++i) {
            const Ray ray{.origin = {in(random), 2.5f, in(random)}, .direction = normalize({in(random)*0.2f, -1, 0})};
            const RayHit a = still.cast(ray), b = world.cast(ray);
            ASSERT_EQ(a.hit, b.hit);
            EXPECT_NEAR(a.t, b.t, 1e-4f);
        }
    }
    EXPECT_GT(apart, 15);
    EXPECT_GT(within, 15);
}

const char* const kLump =
    R"({"id": "lump", "shape": "box", "half_extents": [0.3, 0.2, 0.4], "position": [0, 0.5, 0], "dynamic": true)";

TEST(Movers, MovingOneThatStandsApartBakesNothing) {
    World world = parsed(std::string("{") + kField +
                         R"(, "edits": [{"id": "g", "shape": "plane", "position": [0, -1, 0]}, )" + kLump + "}]}");
    auto before = world.frame();
    ASSERT_TRUE(before);
    ASSERT_EQ(before->instances.size(), 1u);
    const EditId lump = id_of(world, "lump");
    EXPECT_EQ(world.pose(lump)->position, (vec3{0, 0.5f, 0}));
    EXPECT_FALSE(world.pose(id_of(world, "g")));
    const float start = world.distance({1, 1.5f, 0});
    const Pose there{{1, 1.5f, 0}, axis_angle({0, 0, 1}, 0.5f)};
    ASSERT_TRUE(world.move(lump, there));
    EXPECT_LT(world.distance({1, 1.5f, 0}), -0.15f);
    EXPECT_GT(start, 0.5f);
    EXPECT_GT(world.distance({0, 0.5f, 0}), 0.5f) << "it is not where it was";
    auto after = world.frame();
    ASSERT_TRUE(after);
    EXPECT_EQ(after->field, before->field);
    EXPECT_EQ(after->instances[0].bricks, before->instances[0].bricks);
    EXPECT_EQ(after->instances[0].pose, there);
    EXPECT_EQ(after->instances[0].before, before->instances[0].pose);
    auto still = world.frame();
    EXPECT_EQ(still->instances[0].before, there);
    // The scene knows nothing of it, and changing the edit puts it back.
    EXPECT_NE(world.to_json().find("0.5, 0]"), std::string::npos);
    Edit larger = *world.find(lump);
    larger.node.transform.scale = {1.5f, 1.5f, 1.5f};
    ASSERT_TRUE(world.change(lump, larger));
    EXPECT_EQ(world.pose(lump)->position, (vec3{0, 0.5f, 0}));
    EXPECT_LT(world.distance({0, 0.5f, 0}), -0.25f);
    EXPECT_EQ(world.frame()->field, before->field);
    ASSERT_TRUE(world.remove(lump));
    EXPECT_TRUE(world.frame()->instances.empty());
    EXPECT_GT(world.distance({0, 0.5f, 0}), 1);
}

TEST(Movers, OneThatBlendsRebakesWhereItWasAndWhereItIs) {
    World world = parsed(std::string("{") + kField + R"(, "edits": [
        {"id": "g", "shape": "sphere", "radius": 1.2, "position": [0, -1, 0]}, )" +
                         kLump + R"(, "blend_radius": 0.3}]})");
    EXPECT_TRUE(world.frame()->instances.empty());
    const EditId lump = id_of(world, "lump");
    const Pose there{{0.8f, 0, 0.1f}, axis_angle(normalize(vec3{1, 1, 0}), 0.7f)};
    ASSERT_TRUE(world.move(lump, there));
    World same = parsed(world.to_json());
    Edit moved = *same.find(id_of(same, "lump"));
    moved.node.transform.position = there.position;
    moved.node.transform.rotation = there.rotation;
    moved.dynamic = false;
    ASSERT_TRUE(same.change(id_of(same, "lump"), moved));
    EXPECT_EQ(bricks_of(world), bricks_of(same));
    EXPECT_EQ(world.distance({0.7f, 0.2f, 0.1f}), same.distance({0.7f, 0.2f, 0.1f}));
}

TEST(Movers, StandApartOnlyWhileNothingLaterChangesThem) {
    World world = parsed(std::string("{") + kField +
                         R"(, "edits": [{"id": "g", "shape": "plane", "position": [0, -1, 0]}, )" + kLump + "}]}");
    const auto count = [&] { return world.frame()->instances.size(); };
    EXPECT_EQ(count(), 1u);
    Edit cut;
    cut.node.shape = Sphere{.radius = 0.3f};
    cut.node.transform.position = {1.5f, 0.5f, 0};
    cut.op = Op::Subtract;
    cut.name = "cut";
    world.history();
    const auto id = world.add(cut);
    ASSERT_TRUE(id);
    EXPECT_EQ(count(), 1u) << "the cut is elsewhere";
    // Into the cut: it is the cut's then, and the picture is that of the list.
    const EditId lump = id_of(world, "lump");
    ASSERT_TRUE(world.move(lump, {{1.4f, 0.5f, 0}, {}}));
    EXPECT_EQ(count(), 0u);
    EXPECT_GT(world.distance({1.5f, 0.5f, 0}), 0.25f);
    World list = parsed(world.to_json());
    Edit moved = *list.find(id_of(list, "lump"));
    moved.node.transform.position = {1.4f, 0.5f, 0};
    moved.dynamic = false;
    ASSERT_TRUE(list.change(id_of(list, "lump"), moved));
    EXPECT_EQ(bricks_of(world), bricks_of(list));
    ASSERT_TRUE(world.history().undo()) << "the cut goes";
    EXPECT_EQ(count(), 1u);
    EXPECT_LT(world.distance({1.5f, 0.5f, 0}), -0.15f);
    ASSERT_TRUE(world.history().redo());
    EXPECT_EQ(count(), 0u);
    EXPECT_EQ(bricks_of(world), bricks_of(list));
    // Before it in the list, the cut cannot reach it.
    ASSERT_TRUE(world.reorder(*id, lump));
    EXPECT_EQ(count(), 1u);
    // All rows compiled anew: it stays where it was moved to.
    ASSERT_TRUE(world.history().forget());
    EXPECT_EQ(world.pose(lump)->position, (vec3{1.4f, 0.5f, 0}));
    EXPECT_LT(world.distance({1.4f, 0.5f, 0}), -0.15f);
}

TEST(Movers, EqualObjectsShareOneSetAndDifferByMaterial) {
    const World world =
        parsed(std::string("{") + kField + R"(, "materials": {"red": {"base_color": [1, 0, 0]}, "blue": {}},
        "objects": {"nut": {"op": "subtract", "children": [{"shape": "box", "half_extents": [0.3, 0.1, 0.3]}, {"shape": "cylinder", "half_height": 1, "radius": 0.1}]}},
        "edits": [{"id": "a", "object": "nut", "position": [1, 0, 0], "material": "red", "dynamic": true},
                  {"id": "b", "object": "nut", "position": [-1, 0, 0], "rotation": [0, 0, 1, 0], "material": "blue", "dynamic": true},
                  {"id": "c", "object": "nut", "position": [0, 1, 0], "scale": 2, "dynamic": true}]})");
    auto frame = world.frame();
    ASSERT_TRUE(frame);
    ASSERT_EQ(frame->instances.size(), 3u);
    EXPECT_EQ(frame->instances[0].bricks, frame->instances[1].bricks);
    EXPECT_NE(frame->instances[0].bricks, frame->instances[2].bricks);
    EXPECT_EQ(frame->instances[0].material, 1u);
    EXPECT_EQ(frame->instances[1].material, 2u);
    EXPECT_EQ(frame->instances[2].material, 0u);
    EXPECT_LE(frame->instances[0].bricks->voxel_size(), 0.2f / 32 * 1.0001f);
    EXPECT_EQ(world.material_name(world.sample({1.2f, 0, 0}).material), "red");
    EXPECT_EQ(world.material_name(world.sample({1.2f, 0, 0}, FieldSource::Bricks).material), "red");
}

TEST(Movers, LinesFollowThem) {
    World world = parsed(std::string("{") + kField + R"(, "edits": [
        {"id": "g", "shape": "plane", "position": [0, -1, 0], "outline": {}},
        {"id": "a", "shape": "sphere", "radius": 0.3, "position": [1, 0, 0]},
        {"id": "b", "shape": "box", "half_extents": [0.2, 0.2, 0.2], "position": [1.2, 0, 0], "outline": {"width_px": 5}},
        {"id": "c", "shape": "sphere", "radius": 0.4, "position": [-1, 0, 0], "dynamic": true, "outline": {"width_px": 7}}],
        "bodies": [{"id": "body", "edits": ["a", "b"]}]})");
    for (const vec3 to : {vec3{-1, 0, 0}, vec3{-1.5f, 0.7f, 0.3f}}) {
        ASSERT_TRUE(world.move(id_of(world, "c"), {to, {}}));
        ASSERT_TRUE(world.move(id_of(world, "a"), {{-to.x, to.y, 0}, axis_angle({0, 1, 0}, 0.4f)}));
        auto frame = world.frame();
        ASSERT_TRUE(frame);
        ASSERT_EQ(frame->instances.size(), 2u);
        ASSERT_EQ(frame->outlines.size(), 3u);
        for (const EditOutline& o : frame->outlines) {
            if (o.outline.width_px == 3) {
                EXPECT_EQ(o.instance, UINT32_MAX) << "the ground";
                continue;
            }
            ASSERT_LT(o.instance, 2u);
            const Instance& i = frame->instances[o.instance];
            ASSERT_LT(o.row, i.bricks->program().edits.size());
            const bool is_c = o.outline.width_px == 7;
            EXPECT_EQ(i.pose.position.x, is_c ? to.x : -to.x);
            // The row is the edit's: a box beside the first, or the ball itself.
            const Box3 solid = i.bricks->program().edits[o.row].bounds;
            EXPECT_NEAR(solid.center().x, is_c ? 0.0f : 0.2f, 1e-5f);
            EXPECT_NEAR(solid.half_extents().x, is_c ? 0.4f : 0.2f, 1e-5f);
        }
    }
    // A cut that touches it: it is an edit of the field, outlined there.
    Edit cut;
    cut.node.shape = Sphere{.radius = 0.3f};
    cut.node.transform.position = {-1.5f, 0.7f, 0.6f};
    cut.op = Op::Subtract;
    ASSERT_TRUE(world.add(cut));
    auto frame = world.frame();
    ASSERT_TRUE(frame);
    for (const EditOutline& o : frame->outlines) EXPECT_EQ(o.instance == UINT32_MAX, o.outline.width_px != 5);
}

TEST(Movers, AFrameSaysWhatOfItsFieldMovedSinceTheOneBefore) {
    World world = parsed(std::string("{") + kField + R"(, "edits": [
        {"id": "g", "shape": "sphere", "radius": 1.2, "position": [0, -1, 0]},
        {"id": "d", "shape": "sphere", "radius": 0.4, "position": [0, 0.3, 0], "dynamic": true, "blend_radius": 0.3},
        {"id": "e", "shape": "box", "half_extents": [0.2, 0.2, 0.2], "position": [2, 0, 0]}]})");
    const auto frame = [&] { return *world.frame(); };
    EXPECT_TRUE(frame().moved.empty());
    EXPECT_TRUE(frame().changed.empty());
    const Pose to{{0.1f, 0.4f, 0}, axis_angle({0, 0, 1}, 0.2f)};
    ASSERT_TRUE(world.move(id_of(world, "d"), to));
    Frame f = frame();
    ASSERT_EQ(f.moved.size(), 1u);
    EXPECT_TRUE(f.changed.empty());
    EXPECT_EQ(f.moved[0].before.position, (vec3{0, 0.3f, 0}));
    EXPECT_EQ(f.moved[0].now.position, to.position);
    EXPECT_NEAR(f.field->program().edits[f.moved[0].row].bounds.center().x, 0.1f, 1e-5f) << "its row as it is now";
    EXPECT_TRUE(frame().moved.empty()) << "it stands";
    // By a change, twice between two frames: from where the last frame had it. Its measures may change too.
    Edit e = *world.find(id_of(world, "e"));
    for (const float x : {2.1f, 2.3f}) {
        e.node.transform.position.x = x;
        e.node.transform.scale = {1, 2, 1};
        e.node.shape = Box{.half_extents = {0.2f, 0.25f, 0.2f}};
        ASSERT_TRUE(world.change(id_of(world, "e"), e));
    }
    f = frame();
    ASSERT_EQ(f.moved.size(), 1u);
    EXPECT_EQ(f.moved[0].before.position.x, 2);
    EXPECT_EQ(f.moved[0].before.scale.y, 1);
    EXPECT_EQ(f.moved[0].now.position.x, 2.3f);
    EXPECT_EQ(f.moved[0].now.scale.y, 2);
    // Another thing: nothing of it was anywhere.
    e.node.shape = Sphere{.radius = 0.3f};
    ASSERT_TRUE(world.change(id_of(world, "e"), e));
    f = frame();
    EXPECT_TRUE(f.moved.empty());
    ASSERT_EQ(f.changed.size(), 1u);
    EXPECT_LE(f.changed[0].min.x, 2.0f);
    EXPECT_GE(f.changed[0].max.x, 2.6f);
    // Came and went.
    ASSERT_TRUE(world.remove(id_of(world, "e")));
    EXPECT_EQ(frame().changed.size(), 1u);
    Edit added;
    added.node.shape = Sphere{.radius = 0.1f};
    const auto id = world.add(added);
    ASSERT_TRUE(id);
    EXPECT_EQ(frame().changed.size(), 1u);
    EXPECT_TRUE(frame().changed.empty());
    // Within one frame: nothing was seen of it.
    const auto other = world.add(added);
    ASSERT_TRUE(other);
    ASSERT_TRUE(world.remove(*other));
    EXPECT_TRUE(frame().changed.empty());
    // Other measures at the same place.
    e = *world.find(id_of(world, "g"));
    e.node.shape = Sphere{.radius = 1.1f};
    ASSERT_TRUE(world.change(id_of(world, "g"), e));
    f = frame();
    EXPECT_TRUE(f.moved.empty());
    ASSERT_EQ(f.changed.size(), 1u);
    EXPECT_LE(f.changed[0].min.y, -2.2f);
}

// More than are told one by one: a few boxes that have them all, and are no larger than they must be.
TEST(Movers, ManyChangesAreCoveredByFewBoxes) {
    World world = parsed(std::string("{") + kField + R"(, "edits": [
        {"id": "g", "shape": "sphere", "radius": 1.2, "position": [0, -1, 0]}]})");
    (void)*world.frame();
    std::vector<Box3> places;
    for (int i = 0; i < 1000; ++i) {
        Edit added;
        added.node.shape = Sphere{.radius = 0.1f};
        // Eight heaps far from each other.
        added.node.transform.position = {float(20 * (i & 1)) + 0.001f * float(i), float(20 * (i >> 1 & 1)),
                                         float(20 * (i >> 2 & 1))};
        ASSERT_TRUE(world.add(added));
        const vec3 p = added.node.transform.position;
        places.push_back({p - vec3{0.1f, 0.1f, 0.1f}, p + vec3{0.1f, 0.1f, 0.1f}});
    }
    const Frame f = *world.frame();
    EXPECT_LE(f.changed.size(), scene::BoxCover::kMost);
    for (const Box3& place : places)
        EXPECT_TRUE(
            std::any_of(f.changed.begin(), f.changed.end(), [&](const Box3& b) { return box_union(b, place) == b; }));
    for (const Box3& b : f.changed) EXPECT_LT(length(b.max - b.min), 5) << "far from all heaps history stays";
    EXPECT_TRUE(world.frame()->changed.empty());
}

TEST(Movers, WhatStandsApartAndBecomesAnotherThingHasNoHistoryWhereItWasAndIs) {
    World world = parsed(std::string("{") + kField + R"(, "edits": [
        {"id": "g", "shape": "box", "half_extents": [3, 0.2, 3], "position": [0, -1, 0]},
        {"id": "d", "shape": "sphere", "radius": 0.4, "position": [0, 1, 0], "dynamic": true}]})");
    (void)*world.frame();
    ASSERT_TRUE(world.move(id_of(world, "d"), Pose{{2, 1, 0}, {}}));
    EXPECT_TRUE(world.frame()->changed.empty()) << "moving has motion";
    Edit e = *world.find(id_of(world, "d"));
    e.node.shape = Sphere{.radius = 0.5f};
    ASSERT_TRUE(world.change(id_of(world, "d"), e));
    const Frame f = *world.frame();
    ASSERT_EQ(f.instances.size(), 1u);
    ASSERT_EQ(f.changed.size(), 1u);
    for (const Pose& pose : {Pose{{2, 1, 0}, {}}, f.instances[0].pose}) {
        const vec3 p = pose.position;
        EXPECT_TRUE(box_union(f.changed[0], Box3{p, p}) == f.changed[0]) << p.x;
    }
    EXPECT_LT(f.changed[0].max.x, 3);
    EXPECT_TRUE(world.frame()->changed.empty());
}

// A brush stroke of more edits than once made a field begin anew, in a larger world.
TEST(Movers, UndoingALongStrokeMakesWhatItReachedAndNoMore) {
    World world;
    world.field_settings.voxel_size = 0.25f;
    world.field_settings.bounds = Box3{{-20, -3, -20}, {20, 3, 20}};
    for (int i = 0; i < 1600; ++i) {
        Edit e;
        e.node.shape = Sphere{.radius = 0.4f};
        e.node.transform.position = {-19.5f + float(i % 40), 0, -19.5f + float(i / 40)};
        ASSERT_TRUE(world.add(e));
    }
    world.history();
    ASSERT_TRUE(world.frame());
    world.history().begin_group("stroke");
    for (int i = 0; i < 300; ++i) {
        Edit e;
        e.node.shape = Sphere{.radius = 0.3f};
        e.node.transform.position = {-10 + 0.02f * float(i), 1, 2};
        ASSERT_TRUE(world.add(e));
    }
    ASSERT_TRUE(world.history().end_group());
    const auto with = world.frame()->field;
    EXPECT_NE(with->parent_revision(), 0u) << "built anew";
    ASSERT_TRUE(world.history().undo());
    const auto without = world.frame()->field;
    EXPECT_EQ(without->parent_revision(), with->revision());
    int other = 0;
    const size_t pages = std::min(with->records().pages(), without->records().pages());
    for (size_t page = 0; page < pages; ++page) other += !with->records().same_page(without->records(), page);
    EXPECT_LT(other, int(pages) / 2) << "of " << pages;
}

TEST(Movers, OfLevelsToo) {
    World world = parsed(
        std::string(
            R"({"format": 1, "field": {"voxel_size": 0.05, "levels": 3, "cells": 32}, "edits": [{"id": "g", "shape": "plane", "position": [0, -1, 0]}, )") +
        kLump + "}]}");
    auto frame = world.frame(Camera{.position = {0, 1, 2}});
    ASSERT_TRUE(frame);
    ASSERT_EQ(frame->instances.size(), 1u);
    const uint32_t bricks = frame->levels->bricks();
    ASSERT_TRUE(world.move(id_of(world, "lump"), {{0.5f, 0.5f, 0}, {}}));
    frame = world.frame(Camera{.position = {0, 1, 2}});
    EXPECT_EQ(frame->levels->bricks(), bricks);
    for (int level = 0; level < 3; ++level) EXPECT_EQ(frame->levels->counts(level).baked, 0u);
    // A cut that touches it: it goes into the levels, at its pose.
    Edit cut;
    cut.node.shape = Sphere{.radius = 0.3f};
    cut.node.transform.position = {0.7f, 0.5f, 0};
    cut.op = Op::Subtract;
    ASSERT_TRUE(world.add(cut));
    frame = world.frame(Camera{.position = {0, 1, 2}});
    EXPECT_TRUE(frame->instances.empty());
    EXPECT_GT(frame->levels->bricks(), bricks);
    const auto hit = frame->levels->cast({0.3, 3, 0}, {0, -1, 0}, 10);
    EXPECT_NEAR(hit.t, 3 - 0.7, 0.02);
}

TEST(Movers, RefusesWhatCannotBeMoved) {
    World world = parsed(std::string("{") + kField + R"(, "edits": [{"id": "g", "shape": "plane"}, )" + kLump + "}]}");
    EXPECT_FALSE(world.move({}, {}));
    const auto still = world.move(id_of(world, "g"), {});
    ASSERT_FALSE(still);
    EXPECT_NE(still.error().message.find("dynamic"), std::string::npos);
    EXPECT_FALSE(world.move(id_of(world, "lump"), {{NAN, 0, 0}, {}}));
    EXPECT_FALSE(world.move(id_of(world, "lump"), {{0, 0, 0}, {0, 0, 0, 0.5f}}));
    EXPECT_EQ(world.pose(id_of(world, "lump"))->position, (vec3{0, 0.5f, 0}));
}

}  // namespace
}  // namespace kiln

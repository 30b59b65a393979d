// SPDX-License-Identifier: MIT
// Starts threads.
#include "scene/world_impl.h"

#include "field/clipmap.h"
#include "field/field.h"
#include "field/host_bricks.h"
#include "random_changes.h"
#include "scene_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <malloc.h>

namespace kiln {
namespace {

using scene::RandomChanges;

Edit ball_at(float radius, vec3 at = {}) {
    Edit e;
    e.node.shape = Sphere{.radius = radius};
    e.node.transform.position = at;
    return e;
}

// Everything that a world shows of itself: the scene's text, the ids in order, and the texels of all bricks.
struct Shown {
    std::string text;
    std::vector<EditId> ids;
    uint64_t field = 0;
    friend bool operator==(const Shown&, const Shown&) = default;
};

uint64_t field_hash(const World& world) {
    const auto frame = world.frame();
    if (!frame) return 0;
    const auto host = field::HostBricks::build(frame->field->shared_program(), frame->field->options());
    uint64_t sum = 0;  // bricks have no order
    for (const uint32_t slot : host->field().slots()) {
        const field::BrickRecord& r = host->field().records()[slot];
        const int32_t place[3] = {r.texel_x, r.texel_y, r.texel_z};
        uint64_t h = hash64_of(std::span<const int32_t>(place));
        for (int i = 0; i < 64; ++i) {
            const dvec3 p{double(r.texel_x + i % 8) * double(frame->field->options().voxel_size),
                          double(r.texel_y + i / 8) * double(frame->field->options().voxel_size),
                          double(r.texel_z + i / 8) * double(frame->field->options().voxel_size)};
            const double d = host->sample(p).distance;
            h = hash_combine(h, std::bit_cast<uint64_t>(d));
        }
        sum += h;
    }
    return sum;
}

Shown shown(const World& world, bool field = true) {
    return {world.to_json(), world.edits(), field ? field_hash(world) : 0};
}

TEST(History, NothingIsRememberedBeforeItIsAskedFor) {
    World world;
    ASSERT_TRUE(world.add(ball_at(1)));
    History history = world.history();
    EXPECT_EQ(history.now(), 0u);
    EXPECT_FALSE(*history.undo());
    EXPECT_FALSE(*history.redo());
    EXPECT_EQ(world.edits().size(), 1u);
}

TEST(History, UndoBringsAnEditBackUnderItsIdNameAndPlace) {
    World world;
    History history = world.history();
    const EditId a = *world.add(ball_at(1)), b = *world.add(ball_at(2)), c = *world.add(ball_at(3));
    const Edit before = *world.find(b);
    ASSERT_TRUE(world.remove(b));
    EXPECT_EQ(world.find(b), nullptr);
    ASSERT_TRUE(*history.undo());
    EXPECT_EQ(world.edits(), (std::vector<EditId>{a, b, c}));
    ASSERT_NE(world.find(b), nullptr);
    EXPECT_EQ(*world.find(b), before);
    EXPECT_EQ(world.find_edit(before.name), b);
    EXPECT_EQ(world.distance({0, 5, 0}), 2);
    ASSERT_TRUE(*history.redo());
    EXPECT_EQ(world.find(b), nullptr);
    EXPECT_EQ(world.edits(), (std::vector<EditId>{a, c}));
}

TEST(History, AnIdOfOneBranchIsNoEditOfAnother) {
    World world;
    History history = world.history();
    const EditId a = *world.add(ball_at(1));
    ASSERT_TRUE(*history.undo());
    const EditId b = *world.add(ball_at(2));
    EXPECT_NE(a, b);
    EXPECT_EQ(world.find(a), nullptr);
    ASSERT_TRUE(history.go_to(1));
    EXPECT_EQ(world.find(b), nullptr);
    EXPECT_NE(world.find(a), nullptr);
}

TEST(History, AChangeAfterAnUndoKeepsTheOldBranchInReach) {
    World world;
    History history = world.history();
    ASSERT_TRUE(world.add(ball_at(1)));
    ASSERT_TRUE(world.add(ball_at(1, {0, 5, 0})));  // step 2
    const std::string first = world.to_json();
    ASSERT_TRUE(*history.undo());
    ASSERT_TRUE(world.add(ball_at(1, {0, 9, 0})));  // step 3, another child of 1
    const std::string second = world.to_json();
    ASSERT_TRUE(history.go_to(2));
    EXPECT_EQ(world.to_json(), first);
    ASSERT_TRUE(history.go_to(0));
    EXPECT_TRUE(world.edits().empty());
    ASSERT_TRUE(*history.redo());
    ASSERT_TRUE(*history.redo());
    EXPECT_EQ(world.to_json(), first) << "redo goes the way that was left last";
    ASSERT_TRUE(history.go_to(3));
    EXPECT_EQ(world.to_json(), second);
    const auto steps = history.steps();
    ASSERT_EQ(steps.size(), 3u);
    EXPECT_EQ(steps[2].parent, 1u);
    EXPECT_FALSE(steps[1].done);
    EXPECT_EQ(steps[0].title, "add sphere-1");
    EXPECT_FALSE(history.go_to(4));
}

TEST(History, AGroupIsOneStepAndADragInItIsOneChange) {
    World world;
    History history = world.history();
    const EditId a = *world.add(ball_at(1));
    const std::string before = world.to_json();
    history.begin_group("drag");
    history.begin_group("inner");
    for (int i = 0; i < 100; ++i) ASSERT_TRUE(world.change(a, ball_at(1, {float(i), 0, 0})));
    ASSERT_TRUE(world.add(ball_at(2)));
    ASSERT_TRUE(history.end_group());
    EXPECT_FALSE(history.undo()) << "a group is open";
    EXPECT_FALSE(history.forget());
    ASSERT_TRUE(history.end_group());
    EXPECT_FALSE(history.end_group());
    const auto steps = history.steps();
    ASSERT_EQ(steps.size(), 2u);
    EXPECT_EQ(steps[1].title, "drag");
    EXPECT_EQ(steps[1].changes, 2u);
    const std::string after = world.to_json();
    ASSERT_TRUE(*history.undo());
    EXPECT_EQ(world.to_json(), before);
    ASSERT_TRUE(*history.redo());
    EXPECT_EQ(world.to_json(), after);
    history.begin_group("nothing");
    ASSERT_TRUE(history.end_group());
    EXPECT_EQ(history.steps().size(), 2u);
    history.begin_group("regretted");
    ASSERT_TRUE(world.remove(a));
    ASSERT_TRUE(world.add(ball_at(3)));
    world.lights.emplace_back();
    ASSERT_TRUE(history.cancel_group());
    EXPECT_EQ(world.to_json(), after);
    EXPECT_EQ(history.steps().size(), 2u);
}

TEST(History, WhatIsAssignedToPublicMembersIsAStepToo) {
    World world;
    History history = world.history();
    ASSERT_TRUE(world.add(ball_at(1)));
    world.lights.push_back({.illuminance = 7});
    world.environment = Environment{.intensity = 2};
    ASSERT_TRUE(world.add(ball_at(2)));
    ASSERT_EQ(history.steps().size(), 4u);
    EXPECT_EQ(history.steps()[1].title, "lights");
    ASSERT_TRUE(*history.undo());
    ASSERT_TRUE(*history.undo());
    EXPECT_FALSE(world.environment);
    EXPECT_EQ(world.lights.size(), 1u);
    ASSERT_TRUE(*history.undo());
    EXPECT_TRUE(world.lights.empty());
    // Assigned and not recorded yet: the undo takes just that back.
    world.cameras.emplace_back("main", Camera{});
    ASSERT_TRUE(*history.undo());
    EXPECT_TRUE(world.cameras.empty());
    EXPECT_EQ(world.edits().size(), 1u);
}

TEST(History, AMaterialAndAnObjectComeAndGo) {
    World world;
    History history = world.history();
    const MaterialId clay = world.add_material("clay", {.roughness = 0.5f});
    ASSERT_EQ(world.add_material("clay", {.roughness = 0.25f}), clay);
    EXPECT_FALSE(world.add_material("", {}));
    EXPECT_FALSE(world.add_material("bad", {.roughness = std::nanf("")}));
    EXPECT_FALSE(world.add_material("bad\xff", {}));
    Edit e = ball_at(1);
    e.node.material = clay;
    ASSERT_TRUE(world.add(e));
    EXPECT_EQ(history.steps().size(), 3u);
    EXPECT_FALSE(world.apply("{\"materials\": {\"clay\": null}}")) << "still in use";
    ASSERT_TRUE(history.go_to(1));
    EXPECT_EQ(world.material(clay)->roughness, 0.5f);
    ASSERT_TRUE(history.go_to(0));
    EXPECT_EQ(world.material(clay), nullptr);
    ASSERT_TRUE(history.go_to(3));
    EXPECT_EQ(world.material_name(world.find(world.edits()[0])->node.material), "clay");
}

// Walks to random steps of a random tree and finds each as it was when it was made.
void check_any_step(uint32_t seed, int changes, bool field) {
    RandomChanges random(seed);
    World world;
    world.field_settings.bounds = Box3{{-1, -1, -1}, {1, 1, 1}};
    world.field_settings.voxel_size = 0.025f;
    History history = world.history();
    std::vector<Shown> states{shown(world, field)};
    for (int i = 0; i < changes; ++i) {
        const bool group = random.below(5) == 0;
        if (group) history.begin_group("stroke");
        for (int k = group ? random.below(4) : 0; k >= 0; --k) (void)random.one(world);
        if (group) {
            ASSERT_TRUE(history.end_group());
        }
        // Only what is now is known of a group's step and of what a refused call began.
        states.resize(history.steps().size() + 1);
        states[history.now()] = shown(world, field);
        if (random.below(4) == 0) {
            const auto to = uint32_t(random.below(int(states.size())));
            ASSERT_TRUE(history.go_to(to));
            random.look(world);
            if (!states[to].text.empty()) {
                ASSERT_EQ(shown(world, field), states[to]) << "seed " << seed << " step " << to;
            }
            states[to] = shown(world, field);
        }
    }
    for (int i = 0; i < 2 * changes; ++i) {
        const auto to = uint32_t(random.below(int(states.size())));
        ASSERT_TRUE(history.go_to(to));
        ASSERT_EQ(history.now(), to);
        if (states[to].text.empty()) continue;
        ASSERT_EQ(shown(world, field), states[to]) << "seed " << seed << " step " << to;
    }
}

RC_GTEST_PROP(History, AnyStepIsReachedFromAnyOther, (uint32_t seed)) { check_any_step(seed, 40, false); }

TEST(History, TheFieldOfAStepIsTheSameHoweverItIsReached) {
    for (uint32_t seed = 1; seed <= 2; ++seed) check_any_step(seed, 12, true);
}

TEST(History, UndoBakesNoMoreThanTheEditDid) {
    World world;
    world.field_settings = {.voxel_size = 0.02f, .cells = 64, .levels = 1, .bounds = Box3{{-2, -2, -2}, {2, 2, 2}}};
    for (int i = 0; i < 200; ++i)
        ASSERT_TRUE(world.add(
            ball_at(0.3f, {float(i % 6) * 0.6f - 1.5f, float(i / 6 % 6) * 0.6f - 1.5f, float(i / 36) * 0.6f - 1.5f})));
    History history = world.history();
    ASSERT_TRUE(world.frame());
    const EditId id = world.edits()[100];
    Edit moved = *world.find(id);
    moved.node.transform.position = moved.node.transform.position + vec3{0.1f, 0, 0};
    const auto baked = [&] {
        const auto frame = world.frame();
        return frame->field->stats().bricks_baked;
    };
    const auto check = [&](auto&& change) {
        ASSERT_TRUE(change());
        const uint32_t edit = baked();
        ASSERT_TRUE(*history.undo());
        const uint32_t undo = baked();
        EXPECT_GT(edit, 0u);
        EXPECT_LE(undo, edit + edit / 4);
        EXPECT_LT(undo, world.frame()->field->stats().bricks / 10);
    };
    check([&] { return world.change(id, moved); });
    check([&] { return world.remove(id); });
    check([&] { return bool(world.add(ball_at(0.2f, {0.1f, 0.3f, 0.9f}))); });
}

struct Work {
    uint64_t cells = 0, baked = 0, bricks = 0;
    friend bool operator==(const Work&, const Work&) = default;
};

// What a change reaches does not depend on its direction, at no level. So an undo looks at the cells that the edit looked at, and bakes the bricks
// that are in them then: those of the edit, and those that it freed.
TEST(History, InAWorldWithLevelsAnUndoLooksAtTheCellsOfTheEditAndBakesTheirBricks) {
    World world;
    world.field_settings = {.voxel_size = 0.05f, .cells = 32, .levels = 3, .bounds = {}};
    for (int i = 0; i < 60; ++i)
        ASSERT_TRUE(world.add(
            ball_at(0.7f, {float(i % 5) * 1.3f - 2.6f, float(i / 5 % 4) * 1.3f - 2, float(i / 20) * 1.3f - 1.3f})));
    History history = world.history();
    const auto work = [&] {
        Work sum;
        const auto frame = world.frame(Camera{.position = {0.3f, 0.2f, 0.1f}});
        if (!frame) return sum;
        for (int level = 0; level < frame->levels->level_count(); ++level) {
            const field::LevelCounts& counts = frame->levels->counts(level);
            sum.cells += counts.cells_made, sum.baked += counts.baked, sum.bricks += counts.bricks;
            EXPECT_EQ(counts.missing_cells + counts.edits_waiting, 0u);
        }
        return sum;
    };
    uint64_t bricks = work().bricks;
    EXPECT_EQ(work(), (Work{0, 0, bricks})) << "a steady camera";
    const auto check = [&](const char* what, auto&& change) {
        ASSERT_TRUE(change()) << what;
        const Work edit = work();
        ASSERT_TRUE(*history.undo()) << what;
        const Work undo = work();
        ASSERT_TRUE(*history.redo()) << what;
        const Work redo = work();
        EXPECT_GT(edit.cells, 0u) << what;
        EXPECT_LT(edit.cells, 3u * 32 * 32 * 32 / 8) << what;
        EXPECT_EQ(undo.cells, edit.cells) << what;
        EXPECT_EQ(undo.baked + edit.bricks, edit.baked + bricks) << what;
        EXPECT_EQ(undo.bricks, bricks) << what;
        EXPECT_EQ(redo, edit) << what;
        ASSERT_TRUE(*history.undo()) << what;
        (void)work();
    };
    const EditId id = world.edits()[27];
    const auto with = [&](auto&& to) {
        Edit e = *world.find(id);
        to(e);
        return world.change(id, e);
    };
    check("a move", [&] { return with([](Edit& e) { e.node.transform.position.x += 0.2f; }); });
    check("a move far off", [&] { return with([](Edit& e) { e.node.transform.position = {0, 3.2f, 0.5f}; }); });
    check("a growth", [&] { return with([](Edit& e) { e.node.shape = Sphere{.radius = 0.9f}; }); });
    check("a blend", [&] { return with([](Edit& e) { e.blend_radius = 0.3f; }); });
    check("a cut instead", [&] { return with([](Edit& e) { e.op = Op::Subtract; }); });
    check("a removal", [&] { return world.remove(id); });
    check("an addition in the crowd", [&] { return bool(world.add(ball_at(0.5f, {0.1f, 0.3f, 0.9f}))); });
    check("an addition in the open", [&] { return bool(world.add(ball_at(0.4f, {0, 3.6f, 0}))); });
    check("another place in the list", [&] { return world.reorder(id, world.edits()[3]); });
}

TEST(History, ADragBetweenTwoFramesIsOneChangeOfTheField) {
    World world;
    world.field_settings = {.voxel_size = 0.05f, .cells = 64, .levels = 1, .bounds = Box3{{-2, -2, -2}, {2, 2, 2}}};
    ASSERT_TRUE(world.add(ball_at(1)));
    const EditId id = *world.add(ball_at(0.2f, {1, 0, 0}));
    const auto first = world.frame();
    for (int i = 0; i < 1000; ++i) ASSERT_TRUE(world.change(id, ball_at(0.2f, {1, float(i) * 0.001f, 0})));
    const auto last = world.frame();
    EXPECT_EQ(last->field->parent_revision(), first->field->revision()) << "updated, not built again";
    World fresh;
    fresh.field_settings = world.field_settings;
    ASSERT_TRUE(fresh.add(ball_at(1)));
    ASSERT_TRUE(fresh.add(ball_at(0.2f, {1, 999 * 0.001f, 0})));
    EXPECT_EQ(field_hash(world), field_hash(fresh));
}

TEST(History, EditsThatNoFileCouldHoldAreRefusedAndOthersMadePlain) {
    World world;
    Edit e = ball_at(1);
    e.name = "bad\xff";
    EXPECT_FALSE(world.add(e));
    e = ball_at(1);
    e.outline = Outline{.width_px = -1};
    EXPECT_FALSE(world.add(e));
    e = ball_at(1, {-0.0f, 0, 0});
    e.node.transform.rotation = {0, 0, 0, 1.0005f};
    e.node.shape.data = "nothing";
    e.node.blend_radius = 3;
    e.node.children = {5};
    e.material_blend_radius = -7;
    const EditId id = *world.add(e);
    const auto again = World::parse(world.to_json(), "s.json");
    ASSERT_TRUE(again);
    EXPECT_EQ(*again->find(again->edits()[0]), *world.find(id));
    EXPECT_FALSE(std::signbit(world.find(id)->node.transform.position.x));
}

TEST(HistorySlow, AMillionEditsAndUndosGiveTheirMemoryBack) {
    World world;
    for (int i = 0; i < 1000; ++i)
        ASSERT_TRUE(world.add(ball_at(0.3f, {float(i % 10), float(i / 10 % 10), float(i / 100)})));
    RandomChanges random(5);
    const std::string before = world.to_json();
    const auto round = [&](int edits) {
        History history = world.history();
        const std::vector<EditId> ids = world.edits();
        for (int i = 0; i < edits; ++i) {
            const EditId id = ids[size_t(random.below(1000))];
            switch (i % 4) {
            case 0:
                ASSERT_TRUE(world.change(id, ball_at(random.number(0.1f, 0.5f), random.point(10))));
                break;
            case 1:
                ASSERT_TRUE(world.reorder(id, ids[size_t(random.below(1000))]));
                break;
            case 2:
                ASSERT_TRUE(world.remove(id));
                break;
            default:
                ASSERT_TRUE(world.add(ball_at(0.2f, random.point(10))));
            }
            ASSERT_TRUE(*history.undo() || i % 4 == 1);
        }
        ASSERT_TRUE(history.forget());
        ASSERT_EQ(world.to_json(), before);
    };
    round(100000);
    const auto in_use = [] {
        malloc_trim(0);
        const struct mallinfo2 info = mallinfo2();
        return double(info.uordblks + info.hblkhd);
    };
    const double first = in_use();
    round(1000000);
    EXPECT_LE(in_use(), 1.01 * first);
}

}  // namespace
}  // namespace kiln

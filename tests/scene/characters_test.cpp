// SPDX-License-Identifier: MIT
// Starts threads.
// Characters of scenes, run: where they walk, for every engine that runs here.
#include <kiln/world.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "simulated.h"

#include <cmath>
#include <string>

using namespace kiln;
using nlohmann::json;
using scene::engines;
using scene::parsed;
using scene::run;
using testing::HasSubstr;

namespace {

const json& walker(const json& out, size_t frame) { return out["frames"][frame]["characters"][0]; }
vec3 place(const json& character) {
    const json& p = character["position"];
    return {p[0].get<float>(), p[1].get<float>(), p[2].get<float>()};
}
double fall(const json& character) { return character["linear_velocity"][1].get<double>(); }

TEST(Characters, WalkAsTheirPathWishesAndStand) {
    const World world = parsed(R"({"format": 1, "edits": [{"id": "ground", "shape": "plane"}],
      "characters": [{"id": "w", "position": [0, 0.01, 0], "speed": 2, "path": [
        {"time": 0.5, "direction": [3, 5, 0]}, {"time": 1.5, "direction": [0, 0, -0.5]}, {"time": 2.5}]}]})");
    for (const std::string& engine : engines()) {
        const json out = run(world, {.seconds = 3, .every = 0.5, .backend = engine});
        const vec3 expected[] = {{0, 0, 0}, {0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 0, -0.5f}, {2, 0, -1}, {2, 0, -1}};
        for (size_t i = 0; i < 7; ++i)
            EXPECT_LT(length(place(walker(out, i)) - expected[i]), 0.04f) << engine << " " << i;
        EXPECT_EQ(walker(out, 2)["floor"], "world");
        EXPECT_NEAR(walker(out, 2)["linear_velocity"][0].get<double>(), 2, 0.01) << engine;
        EXPECT_FALSE(parsed(R"({"format": 1})").simulate_json()->find("characters") != std::string::npos);
    }
}

TEST(Characters, JumpOnceAsHighAsTheFormulaSays) {
    const World world = parsed(R"({"format": 1, "edits": [{"id": "ground", "shape": "plane"}],
      "characters": [{"id": "w", "position": [0, 0.01, 0], "path": [{"time": 0.5, "jump": 3}]}]})");
    for (const std::string& engine : engines()) {
        const json out = run(world, {.seconds = 3, .backend = engine});
        float high = 0;
        int flights = 0;
        for (size_t i = 10; i < 181; ++i) {
            high = std::max(high, place(walker(out, i)).y);
            flights += walker(out, i)["floor"].is_null() && !walker(out, i - 1)["floor"].is_null();
        }
        EXPECT_NEAR(high, 3 * 3 / (2 * 9.81f), 0.05f) << engine;
        EXPECT_EQ(flights, 1) << engine;
        EXPECT_EQ(walker(out, 180)["floor"], "world") << engine;
    }
}

// A course of a hill, a step, a wall and a jump.
TEST(Characters, WalkAlikeOnEveryEngineAndForAnyNumberOfThreads) {
    const World world = parsed(R"({"format": 1, "edits": [
        {"id": "ground", "shape": "plane"},
        {"id": "hill", "shape": "sphere", "radius": 2, "position": [3, -1.2, 0.3], "blend_radius": 0.4},
        {"id": "stair", "shape": "box", "half_extents": [0.4, 0.2, 3], "position": [-2, 0, 0]},
        {"id": "wall", "shape": "box", "half_extents": [0.3, 2, 3], "position": [7, 1, 0]}],
      "characters": [{"id": "w", "position": [0, 0.01, 0], "height": 1.6, "radius": 0.25, "path": [
        {"time": 0, "direction": [1, 0, 0.2]}, {"time": 2.5, "direction": [1, 0, 0], "jump": 3},
        {"time": 5, "direction": [-1, 0, 0]}]}]})");
    std::vector<json> ways;
    for (const std::string& engine : engines()) {
        ways.push_back(run(world, {.seconds = 11, .every = 0.25, .backend = engine, .threads = 1}));
        EXPECT_EQ(run(world, {.seconds = 11, .every = 0.25, .backend = engine, .threads = 2}), ways.back()) << engine;
        float high = 0;
        bool flew = false;
        for (size_t i = 0; i < ways.back()["frames"].size(); ++i) {
            high = std::max(high, place(walker(ways.back(), i)).y);
            flew = flew || walker(ways.back(), i)["floor"].is_null();
        }
        EXPECT_GT(high, 0.7f) << engine << ": over the hill";
        EXPECT_TRUE(flew) << engine << ": it jumped";
        EXPECT_LT(place(walker(ways.back(), 44)).x, -2) << engine << ": over the stair";
    }
    for (size_t e = 1; e < ways.size(); ++e)
        for (size_t i = 0; i < ways[0]["frames"].size(); ++i)
            EXPECT_LT(length(place(walker(ways[e], i)) - place(walker(ways[0], i))), 2e-3f) << i;
}

TEST(Characters, StandOnMovingBodiesAndAreSeenByTriggers) {
    const World world = parsed(R"({"format": 1,
      "objects": {"gate": {"shape": "box", "half_extents": [0.2, 3, 1]}},
      "edits": [{"id": "ground", "shape": "plane"},
                {"id": "lift", "shape": "box", "half_extents": [1, 0.25, 1], "position": [0, 0.25, 0]}],
      "bodies": [{"id": "l", "edits": ["lift"], "motion": "kinematic", "linear_velocity": [0.6, 0.3, 0]}],
      "characters": [{"id": "w", "position": [0, 0.51, 0]}],
      "triggers": [{"id": "t", "object": "gate", "position": [1.5, 1, 0]}]})");
    for (const std::string& engine : engines()) {
        const json out = run(world, {.seconds = 4, .every = 1, .backend = engine});
        for (size_t i = 1; i < 5; ++i) {
            EXPECT_EQ(walker(out, i)["floor"], "l") << engine;
            const vec3 at = place(walker(out, i)), on{0.6f * float(i), 0.5f + 0.3f * float(i), 0};
            EXPECT_LT(length(at - on), 0.05f) << engine << " " << i;
        }
        std::vector<std::string> seen;
        for (const json& e : out["events"])
            if (e["a"] == "t" && e["b"] == "w") seen.push_back(e["type"]);
        EXPECT_THAT(seen, testing::ElementsAre("enter", "leave")) << engine;
    }
}

TEST(Characters, SurviveTheirFloorBeingDugAndBuiltOver) {
    const World world = parsed(R"({"format": 1, "field": {"voxel_size": 0.1}, "edits": [
        {"id": "deep", "shape": "plane", "position": [0, -3, 0]},
        {"id": "floor", "shape": "box", "half_extents": [4, 0.5, 4], "position": [0, -0.5, 0]}],
      "characters": [{"id": "w", "position": [0, 0.01, 0]}]})");
    const std::vector<TimedCommand> edits = {
        {1.0, "e",
         R"({"time": 1, "command": {"add": {"id": "hole", "shape": "cylinder", "half_height": 2, "radius": 1, "op": "subtract"}}})",
         1},
        {3.0, "e",
         R"({"time": 3, "command": {"add": {"id": "mound", "shape": "sphere", "radius": 1, "position": [0.2, -3, 0]}}})",
         2}};
    for (const std::string& engine : engines()) {
        const json out = run(world, {.seconds = 6, .backend = engine, .edits = edits});
        EXPECT_NEAR(fall(walker(out, 60)), 0, 1e-3) << engine;
        EXPECT_NEAR(fall(walker(out, 61)), -9.81 / 60, 0.01 * 9.81 / 60) << engine << ": it falls with the next step";
        EXPECT_NEAR(place(walker(out, 170)).y, -3, 0.03) << engine;
        EXPECT_EQ(walker(out, 170)["floor"], "world");
        EXPECT_GT(place(walker(out, 360)).y, -2.5f) << engine << ": it came up with what was built";
        for (size_t i = 1; i < 361; ++i) {
            const vec3 way = place(walker(out, i)) - place(walker(out, i - 1));
            EXPECT_LT(length(way), 0.14f) << engine << " " << i << ": it is pushed, not shot";
        }
    }
}

TEST(Characters, AreCapsulesInPictures) {
    const World world = parsed(
        R"({"format": 1, "field": {"voxel_size": 0.1}, "edits": [{"id": "floor", "shape": "box", "half_extents": [4, 0.5, 4]}],
      "characters": [{"id": "w", "position": [0, 2, 0]}, {"id": "v", "position": [1, 0.51, 0], "path": [{"time": 0, "direction": [0, 0, 1]}]}]})");
    for (const std::string& engine : engines()) {
        auto play = Play::start(world, {.backend = engine});
        ASSERT_TRUE(play);
        for (int i = 0; i < 30; ++i) ASSERT_TRUE(play->step());
        // What is dug after it came does not cut its picture.
        ASSERT_TRUE(
            play->apply(R"({"add": {"id": "cut", "shape": "sphere", "position": [1, 2, 0.7], "op": "subtract"}})"));
        ASSERT_TRUE(play->step());
        const auto frame = play->frame({.position = {0, 3, 8}});
        ASSERT_TRUE(frame);
        ASSERT_EQ(frame->instances.size(), 2u);
        EXPECT_LT(frame->instances[0].pose.position.y, 2.85f - 1) << "it fell";
        EXPECT_NEAR(frame->instances[1].pose.position.z, 1.5f * 31 / 60, 0.03f) << engine;
        EXPECT_NEAR(frame->instances[1].pose.position.y, 0.5f + 0.85f, 0.03f) << engine;
        ASSERT_TRUE(play->apply("{\"remove\": \"w (character)\"}"));
        ASSERT_TRUE(play->step());
        const auto without = play->frame({.position = {0, 3, 8}});
        ASSERT_TRUE(without);
        EXPECT_EQ(without->instances.size(), 1u) << "it walks on unseen";
    }
}

TEST(Characters, WhatIsWrongWithOneIsOneClearError) {
    const auto message = [](const std::string& character) {
        const auto world = World::parse(
            "{\"format\": 1,\n \"bodies\": [{\"id\": \"b\", \"edits\": [\"e\"]}],\n"
            " \"edits\": [{\"id\": \"e\", \"shape\": \"sphere\"}],\n"
            " \"characters\": [" +
                character + "]}",
            "s.kiln.json");
        return world ? std::string("no error") : world.error().message;
    };
    EXPECT_THAT(message(R"({"id": "w", "radius": 0})"),
                testing::AllOf(HasSubstr("s.kiln.json:4:"), HasSubstr("characters[0].radius")));
    EXPECT_THAT(message(R"({"id": "w", "height": 0.5})"),
                testing::AllOf(HasSubstr("characters[0].height"), HasSubstr("twice the radius")));
    EXPECT_THAT(message(R"({"id": "w", "path": [{"time": 1}, {"time": 0.5}]})"),
                testing::AllOf(HasSubstr("characters[0].path[1].time"), HasSubstr("ascending")));
    EXPECT_THAT(message(R"({"id": "w", "path": [{"direction": [1, 0, 0]}]})"), HasSubstr("characters[0].path[0]"));
    EXPECT_THAT(message(R"({"id": "w", "path": [{"time": 0, "jump": -1}]})"), HasSubstr("characters[0].path[0].jump"));
    EXPECT_THAT(message(R"({"id": "w", "steepest_deg": 95})"), HasSubstr("characters[0].steepest_deg"));
    EXPECT_THAT(message(R"({"id": "w", "sped": 1})"), HasSubstr("did you mean \"speed\""));
    EXPECT_THAT(message(R"({"id": "b"})"), testing::AllOf(HasSubstr("characters[0].id"), HasSubstr("body")));
    EXPECT_THAT(message(R"({"id": "w"}, {"id": "w"})"), HasSubstr("unique"));
    EXPECT_EQ(message(R"({"id": "w", "path": []})"), "no error");
    // Kept when it is saved.
    const auto world =
        World::parse(R"({"format": 1, "characters": [{"id": "w", "speed": 3, "path": [{"time": 2}]}]})", "s");
    ASSERT_TRUE(world);
    EXPECT_EQ(json::parse(world->to_json())["characters"],
              json::parse(R"([{"id": "w", "speed": 3, "path": [{"time": 2}]}])"));
}

}  // namespace

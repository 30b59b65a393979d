// SPDX-License-Identifier: MIT
// Starts threads.
// Edits that are aimed at bodies, in flight and at rest, on every engine that runs here.
#include "scene/simulation.h"

#include <kiln/world.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "played.h"
#include "temp_folder.h"

#include <cmath>
#include <fstream>
#include <string>

using namespace kiln;
using nlohmann::json;
using scene::engines;
using scene::parsed;
using scene::Played;
using testing::HasSubstr;

namespace {

constexpr Camera kCamera{.position = {0, 4, 9}, .target = {0, 3, 0}};

// A bar, a ball and a body of two edits in the air, without weight, over ground.
constexpr const char* kInTheAir = R"({"format": 1, "field": {"voxel_size": 0.05}, "physics": {"gravity": [0, 0, 0]},
  "materials": {"red": {"base_color": [1, 0, 0]}},
  "edits": [
    {"id": "ground", "shape": "plane"},
    {"id": "bar", "shape": "box", "half_extents": [1, 0.2, 0.2], "position": [0, 3, 0], "material": "red"},
    {"id": "ball", "shape": "sphere", "radius": 0.5, "position": [5, 3, 0]},
    {"id": "low", "shape": "box", "half_extents": [0.4, 0.4, 0.4], "position": [-5, 3, 0]},
    {"id": "high", "shape": "sphere", "radius": 0.3, "position": [-5, 3.5, 0]}],
  "bodies": [{"id": "bar", "edits": ["bar"], "linear_velocity": [0, 1, 0], "angular_velocity": [0, 0, 2]},
             {"id": "ball", "edits": ["ball"], "linear_velocity": [0, 0.5, 0], "angular_velocity": [0, 0, 1]},
             {"id": "two", "edits": ["low", "high"]}]})";

std::string line(double time, const std::string& command) {
    return "{\"time\": " + std::to_string(time) + ", \"command\": " + command + "}";
}
const json* find(const json& list, const std::string& id) {
    for (const json& b : list)
        if (b["id"] == id) return &b;
    return nullptr;
}
vec3 vector(const json& v) { return {v[0].get<float>(), v[1].get<float>(), v[2].get<float>()}; }

TEST(BodyEdits, ADigTakesMassAndLeavesEachPointItsVelocity) {
    const World world = parsed(kInTheAir);
    // The half of the ball on the side of +X; a unit ball's half has its centre at 3/8.
    const std::string dig =
        R"({"add": {"shape": "box", "half_extents": [1, 1, 1], "position": [6, 3, 0], "op": "subtract"}, "target": "ball"})";
    for (const std::string& engine : engines()) {
        const json out = scene::run(world, {.seconds = 0.1, .backend = engine, .edits = {{0, "f", line(0, dig), 1}}});
        const json& ball = *find(out["bodies"], "ball");
        EXPECT_NEAR(ball["mass"].get<double>(), 1000 * 2.0 / 3 * 3.14159265 * 0.125, 5) << engine;
        EXPECT_NEAR(vector(ball["center_of_mass"]).x, -3.0f / 8 * 0.5f, 0.005f) << engine;
        const vec3 v = vector((*find(out["frames"][1]["bodies"], "ball"))["linear_velocity"]);
        // It spun about +Z at 1 rad/s: 3/16 m to the left, that is 3/16 m/s less upwards.
        EXPECT_NEAR(v.y, 0.5f - 0.1875f, 0.01f) << engine;
        EXPECT_EQ(vector((*find(out["frames"][0]["bodies"], "ball"))["linear_velocity"]), (vec3{0, 0.5f, 0}));
        EXPECT_TRUE(find(out["bodies"], "two")) << "others are as they were";
        EXPECT_NEAR((*find(out["bodies"], "bar"))["mass"].get<double>(), 320, 4);
    }
}

TEST(BodyEdits, ABarThatIsCutThroughInFlightIsTwoWithTheMomentumOfBoth) {
    const World world = parsed(kInTheAir);
    const std::string cut =
        R"({"add": {"shape": "box", "half_extents": [0.1, 1, 1], "position": [0.3, 3, 0], "op": "subtract"}, "target": "bodies"})";
    for (const std::string& engine : engines()) {
        const SimulateSettings settings{.seconds = 0.2, .backend = engine, .edits = {{0, "f", line(0, cut), 1}}};
        const json out = scene::run(world, settings);
        ASSERT_EQ(out["bodies"].size(), 4u) << engine;
        const json &bar = *find(out["bodies"], "bar"), &part = *find(out["bodies"], "part1");
        EXPECT_NEAR(bar["mass"].get<double>(), 1.2 * 0.16 * 1000, 3) << engine << ": the larger stays";
        EXPECT_NEAR(part["mass"].get<double>(), 0.6 * 0.16 * 1000, 3) << engine;
        const json& frame = out["frames"][1]["bodies"];
        // v + ω × r of the middles of [-1, 0.2] and [0.4, 1].
        EXPECT_NEAR(vector((*find(frame, "bar"))["linear_velocity"]).y, 1 + 2 * -0.4f, 0.03f) << engine;
        EXPECT_NEAR(vector((*find(frame, "part1"))["linear_velocity"]).y, 1 + 2 * 0.7f, 0.03f) << engine;
        for (const char* id : {"bar", "part1"})
            EXPECT_NEAR(vector((*find(frame, id))["angular_velocity"]).z, 2, 0.02f) << engine << id;
        EXPECT_EQ(scene::run(world, {.seconds = 0.2, .backend = engine, .threads = 2, .edits = settings.edits}), out);
    }
}

TEST(BodyEdits, AllIsTheWorldAndWhatItOverlapsAndPicturesAndWhoKeepsItSeeIt) {
    for (const std::string& engine : engines()) {
        Played p(engine, kInTheAir);
        p.apply(
            R"({"add": {"id": "hole", "shape": "cylinder", "half_height": 9, "radius": 0.15, "position": [-5, 3, 0], "op": "subtract"}, "target": "all"})");
        p.run(1);
        auto frame = p.play.frame(kCamera);
        ASSERT_TRUE(frame) << frame.error().message;
        EXPECT_EQ(frame->instances.size(), 3u);
        const World kept = p.kept();
        EXPECT_GT(kept.distance({-5, 3, 0}), 0.1f) << engine << ": the body";
        EXPECT_LT(kept.distance({-5.3f, 3, 0}), 0);
        EXPECT_GT(kept.distance({-5, 3.5f, 0}), 0.1f) << engine << ": its second edit";
        EXPECT_GT(kept.distance({-5, -0.5f, 0}), 0.1f) << engine << ": the ground";
        EXPECT_LT(kept.distance({0, 3, 0}), 0) << "not the bar";
        // What was kept runs, and has the hole.
        const json again = scene::run(kept, {.seconds = 0.05, .backend = engine});
        EXPECT_NEAR(
            (*find(again["bodies"], "two"))["mass"].get<double>(),
            (*find(scene::run(p.start, {.seconds = 0, .backend = engine})["bodies"], "two"))["mass"].get<double>() -
                3.14159265 * 0.0225 * (0.8 + 0.4) * 1000,
            12)
            << engine;
    }
}

TEST(BodyEdits, WhatIsBuiltOnABodyGoesWithIt) {
    const World world = parsed(kInTheAir);
    const std::string lump =
        R"({"add": {"shape": "box", "half_extents": [0.2, 0.4, 0.2], "position": [0, 3.4, 0]}, "target": "bar"})";
    for (const std::string& engine : engines()) {
        const json out = scene::run(world, {.seconds = 0.5, .backend = engine, .edits = {{0, "f", line(0, lump), 1}}});
        EXPECT_NEAR((*find(out["bodies"], "bar"))["mass"].get<double>(), 320 + 0.16 * 0.6 * 1000, 6) << engine;
        EXPECT_GT(vector((*find(out["bodies"], "bar"))["center_of_mass"]).y, 0.08f) << engine;
    }
}

TEST(BodyEdits, ABodyThatIsDugAwayWholeIsNoMore) {
    const World world = parsed(kInTheAir);
    const std::string gone =
        R"({"add": {"shape": "sphere", "radius": 1, "position": [5, 3, 0], "op": "subtract"}, "target": "bodies"})";
    for (const std::string& engine : engines()) {
        const json out =
            scene::run(world, {.seconds = 0.5, .backend = engine, .edits = {{0.1, "f", line(0.1, gone), 1}}});
        EXPECT_TRUE(find(out["frames"][0]["bodies"], "ball")) << engine;
        EXPECT_FALSE(find(out["frames"].back()["bodies"], "ball")) << engine;
        EXPECT_TRUE(find(out["frames"].back()["bodies"], "bar")) << engine;
        Played p(engine, kInTheAir);
        p.apply(gone);
        p.run(2);
        auto frame = p.play.frame(kCamera);
        ASSERT_TRUE(frame);
        EXPECT_EQ(frame->instances.size(), 2u) << engine;
        EXPECT_GT(p.kept().distance({5, 3, 0}), 0);
    }
}

TEST(BodyEdits, WhatIsLeftOfAMeshIsSeenAsTheSolidThatItIs) {
    const TempFolder folder;
    {
        std::ofstream out(folder / "cube.obj");
        for (const char* v : {"0 0 0", "1 0 0", "1 1 0", "0 1 0", "0 0 1", "1 0 1", "1 1 1", "0 1 1"})
            out << "v " << v << "\n";
        for (const char* f : {"4 3 2 1", "5 6 7 8", "1 2 6 5", "2 3 7 6", "3 4 8 7", "4 1 5 8"})
            out << "f " << f << "\n";
    }
    auto world = World::parse(R"({"format": 1, "field": {"voxel_size": 0.05}, "physics": {"gravity": [0, 0, 0]},
      "edits": [{"id": "ground", "shape": "plane"}],
      "meshes": [{"id": "m", "file": "cube.obj", "position": [0, 2, 0]},
                 {"id": "other", "file": "cube.obj", "position": [5, 2, 0]}],
      "bodies": [{"id": "crate", "mesh": "m", "linear_velocity": [0, 1, 0]}, {"id": "still", "mesh": "other"}]})",
                              (folder / "s.kiln.json").string());
    ASSERT_TRUE(world) << world.error().message;
    for (const std::string& engine : engines()) {
        auto play = Play::start(*world, {.backend = engine});
        ASSERT_TRUE(play) << play.error().message;
        ASSERT_TRUE(play->step());
        ASSERT_EQ(play->frame(kCamera)->meshes.size(), 2u);
        // The half on the side of +X goes; then all.
        const auto dig = [&](const char* half, const char* at) {
            const auto done =
                play->apply(std::string(R"({"add": {"shape": "box", "op": "subtract", "half_extents": )") + half +
                                R"(, "position": )" + at + R"(}, "target": "crate"})",
                            "a dig");
            ASSERT_TRUE(done) << done.error().message;
        };
        dig("[0.5, 2, 2]", "[1, 2.5, 0.5]");
        ASSERT_TRUE(play->step());
        auto frame = play->frame(kCamera);
        ASSERT_TRUE(frame) << frame.error().message;
        EXPECT_EQ(frame->meshes.size(), 1u) << engine << ": the mesh is hidden";
        const auto ray = [](Play& by, float x) { return by.cast({{x, 2.6f, 9}, {0, 0, -1}})->hit; };
        EXPECT_TRUE(ray(*play, 0.25f)) << engine;
        EXPECT_FALSE(ray(*play, 0.75f)) << engine << ": it was cut away";
        // Whoever keeps it has the same, and plays on from there.
        World kept = *World::parse(world->to_json(), (folder / "s.kiln.json").string());
        const auto done = play->keep(kept);
        ASSERT_TRUE(done) << done.error().message;
        auto again = Play::start(kept, {.backend = engine});
        ASSERT_TRUE(again) << again.error().message;
        ASSERT_TRUE(again->step());
        EXPECT_EQ(again->frame(kCamera)->meshes.size(), 1u) << engine;
        EXPECT_TRUE(ray(*again, 0.25f)) << engine;
        EXPECT_FALSE(ray(*again, 0.75f)) << engine;
        dig("[2, 2, 2]", "[0.5, 2.5, 0.5]");
        ASSERT_TRUE(play->step());
        EXPECT_EQ(play->frame(kCamera)->meshes.size(), 1u) << engine;
        EXPECT_FALSE(ray(*play, 0.25f)) << engine;
    }
}

TEST(BodyEdits, TargetsThatCannotBeHitSayWhy) {
    Played p(engines().front(), kInTheAir);
    const auto told = [&](const char* command) {
        const auto done = p.play.apply(command, "editor");
        EXPECT_FALSE(done) << command;
        return done ? std::string() : done.error().message;
    };
    EXPECT_THAT(told(R"({"add": {"shape": "sphere"}, "target": "nobody"})"), HasSubstr("no body \"nobody\""));
    EXPECT_THAT(told(R"({"add": {"shape": "plane"}, "target": "ball"})"), HasSubstr("no end"));
    EXPECT_THAT(told(R"({"remove": "ground", "target": "ball"})"), HasSubstr("only edits that are added"));
    EXPECT_THAT(told(R"({"add": {"shape": "sphere"}, "target": 3})"), HasSubstr("the id of a body"));
    World world = parsed(kInTheAir);
    const auto outside = world.apply(R"({"add": {"shape": "sphere"}, "target": "all"})", "editor");
    ASSERT_FALSE(outside);
    EXPECT_THAT(outside.error().message, HasSubstr("while bodies run"));
    p.run(1);
    EXPECT_EQ(p.kept().edits().size(), world.edits().size()) << "refused, they changed nothing";
}

TEST(BodyEdits, WhatIsTooSmallToBeABodyIsCountedAndSeenToFall) {
    // A spike thinner than a voxel, which is cut.
    constexpr const char* kTooth = R"({"format": 1, "field": {"voxel_size": 0.1},
      "edits": [
        {"id": "ground", "shape": "plane"},
        {"id": "neck", "shape": "box", "half_extents": [0.04, 0.5, 0.04], "position": [0, 0.5, 0]},
        {"id": "ball", "shape": "sphere", "radius": 0.2, "position": [5, 0.2, 0]}],
      "bodies": [{"id": "b", "edits": ["ball"]}]})";
    const std::string cut =
        R"({"add": {"shape": "box", "half_extents": [1, 0.1, 1], "position": [0, 0.6, 0], "op": "subtract"}})";
    for (const std::string& engine : engines()) {
        Played p(engine, kTooth);
        p.apply(cut);
        p.run(2);
        auto frame = p.play.frame(kCamera);
        ASSERT_TRUE(frame);
        ASSERT_EQ(frame->particles.size(), 1u) << engine;
        const float height = frame->particles[0].position.y;
        EXPECT_NEAR(height, 0.85f, 0.1f);
        EXPECT_GT(p.kept().distance({0, 0.85f, 0}), 0) << engine << ": it hangs no more";
        p.run(10);
        frame = p.play.frame(kCamera);
        ASSERT_EQ(frame->particles.size(), 1u);
        EXPECT_LT(frame->particles[0].position.y, height - 0.1f);
        p.run(240);
        EXPECT_TRUE(p.play.frame(kCamera)->particles.empty());
        const json out = scene::run(p.start, {.seconds = 0.1, .backend = engine, .edits = {{0, "f", line(0, cut), 1}}});
        EXPECT_EQ(out["crumbs"], 1) << engine;
        EXPECT_EQ(out["bodies"].size(), 1u);
    }
}

}  // namespace

// SPDX-License-Identifier: MIT
// Starts threads.
// Plays: what pictures of a scene see while its bodies run, on every engine that runs here.
#include "field/field.h"
#include "physics/debug_lines.h"
#include "scene/simulation.h"

#include <kiln/world.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "simulated.h"
#include "temp_folder.h"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <string>
#include <string_view>

using namespace kiln;
using nlohmann::json;
using scene::engines;
using scene::parsed;
using testing::HasSubstr;

namespace {

constexpr Camera kPlayCamera{.position = {0, 2, 6}, .target = {0, 0.5f, 0}};

constexpr const char* kScene = R"({"format": 1, "field": {"voxel_size": 0.1},
  "edits": [
    {"id": "ground", "shape": "plane"},
    {"id": "block", "shape": "box", "half_extents": [1, 0.2, 1], "position": [0, 0.2, 0]},
    {"id": "ball", "shape": "sphere", "radius": 0.3, "position": [0.2, 1.5, 0]},
    {"id": "crate", "shape": "box", "half_extents": [0.3, 0.3, 0.3], "position": [-1.5, 1, 0], "rotation": [0, 0, 0.1305262, 0.9914449]}],
  "bodies": [{"id": "b", "edits": ["ball"], "linear_velocity": [1, 0, 0]}, {"id": "c", "edits": ["crate"]}]})";

Play started(const World& world, const std::string& engine) {
    auto play = Play::start(world, {.backend = engine});
    EXPECT_TRUE(play) << (play ? "" : play.error().message);
    return std::move(*play);
}

Frame shown(Play& play, const PlayLines& lines = {}) {
    auto frame = play.frame(kPlayCamera, lines);
    EXPECT_TRUE(frame) << (frame ? "" : frame.error().message);
    return frame ? std::move(*frame) : Frame();
}

TEST(Play, PicturesShowBodiesWhereTheStepsHaveThemAndWhereTheyWereInTheFrameBefore) {
    const World world = parsed(kScene);
    for (const std::string& engine : engines()) {
        Play play = started(world, engine);
        Frame before = shown(play);
        for (int i = 0; i < 8; ++i) {
            for (int k = 0; k <= 3 * i; ++k) ASSERT_TRUE(play.step());
            const Frame frame = shown(play);
            // The same steps again, as they are told.
            auto told = world.simulate_json({.seconds = play.time(), .every = 1000, .backend = engine});
            ASSERT_TRUE(told);
            const json bodies = json::parse(*told)["frames"].back()["bodies"];
            ASSERT_EQ(frame.instances.size(), 2u);
            for (size_t b = 0; b < 2; ++b) {
                const Instance& seen = frame.instances[b];
                const vec3 p = seen.pose.position;
                const quat q = seen.pose.rotation;
                const float place[3] = {p.x, p.y, p.z}, turn[4] = {q.x, q.y, q.z, q.w};
                for (size_t k = 0; k < 3; ++k) EXPECT_EQ(place[k], bodies[b]["position"][k].get<float>()) << engine;
                for (size_t k = 0; k < 4; ++k)
                    EXPECT_NEAR(turn[k], bodies[b]["rotation"][k].get<float>(), 2e-7f) << engine;
                EXPECT_EQ(seen.before, before.instances[b].pose) << engine << " " << i;
            }
            EXPECT_EQ(frame.time_before, before.time);
            before = frame;
        }
        EXPECT_LT(before.instances[0].pose.position.y, 1) << "it fell";
    }
    EXPECT_EQ(world.pose(*world.find_edit("ball"))->position, (vec3{0.2f, 1.5f, 0})) << "the world stays as it is";
}

TEST(Play, BodiesOfMeshesMoveTheirMeshes) {
    const TempFolder folder;
    {
        std::ofstream out(folder / "cube.obj");
        for (const char* v : {"0 0 0", "1 0 0", "1 1 0", "0 1 0", "0 0 1", "1 0 1", "1 1 1", "0 1 1"})
            out << "v " << v << "\n";
        for (const char* f : {"4 3 2 1", "5 6 7 8", "1 2 6 5", "2 3 7 6", "3 4 8 7", "4 1 5 8"})
            out << "f " << f << "\n";
    }
    const auto world = World::parse(R"({"format": 1, "edits": [{"id": "ground", "shape": "plane"}],
      "meshes": [{"id": "gone", "file": "cube.obj", "hidden": true},
                 {"id": "still", "file": "cube.obj", "position": [5, 0, 0]},
                 {"id": "m", "file": "cube.obj", "position": [0, 2, 0], "scale": 0.5}],
      "bodies": [{"id": "crate", "mesh": "m", "linear_velocity": [1, 0, 0], "angular_velocity": [0, 1, 0]}]})",
                                    (folder / "s.kiln.json").string());
    ASSERT_TRUE(world) << world.error().message;
    for (const std::string& engine : engines()) {
        Play play = started(*world, engine);
        Frame before = shown(play);
        ASSERT_EQ(before.meshes.size(), 2u);
        EXPECT_EQ(before.meshes[1].before, before.meshes[1].transform) << "nothing moved before the first";
        for (int i = 1; i <= 20; ++i) {
            ASSERT_TRUE(play.step());
            const Frame frame = shown(play);
            EXPECT_EQ(frame.meshes[0].transform, before.meshes[0].transform);
            EXPECT_EQ(frame.meshes[1].before, before.meshes[1].transform);
            EXPECT_EQ(frame.meshes[1].transform.scale, (vec3{0.5f, 0.5f, 0.5f}));
            // Its middle flies on a parabola, v t and g t (t + dt) / 2 (symplectic Euler).
            const Transform& t = frame.meshes[1].transform;
            const vec3 middle = t.position + rotate(t.rotation, vec3{0.25f, 0.25f, 0.25f});
            const float s = float(i) / 60;
            EXPECT_NEAR(middle.x, 0.25f + s, 2e-3f) << engine;
            EXPECT_NEAR(middle.y, 2.25f - 9.81f * s * (s + 1.0f / 60) / 2, 3e-3f) << engine;
            before = frame;
        }
    }
}

TEST(Play, TimeThatGoesByMakesStepsAndFramesStandBetweenThem) {
    const World world = parsed(R"({"format": 1, "physics": {"gravity": [0, 0, 0], "step": 0.1},
      "edits": [{"id": "ball", "shape": "sphere", "radius": 0.3}],
      "bodies": [{"id": "b", "edits": ["ball"], "linear_velocity": [1, 0, 0], "angular_velocity": [0, 1, 0]}]})");
    for (const std::string& engine : engines()) {
        Play play = started(world, engine);
        const auto x = [&] { return shown(play).instances[0].pose.position.x; };
        const auto made = [&](double seconds) {
            const auto steps = play.advance(seconds);
            EXPECT_TRUE(steps);
            return steps ? *steps : -1;
        };
        EXPECT_EQ(made(0.25), 2);
        EXPECT_NEAR(x(), 0.15f, 1e-5f) << "half way between 0.1 and 0.2";
        const quat half = shown(play).instances[0].pose.rotation;
        EXPECT_NEAR(half.y, std::sin(0.15 / 2), 1e-3) << engine;
        EXPECT_NEAR(half.x * half.x + half.y * half.y + half.z * half.z + half.w * half.w, 1, 1e-6);
        EXPECT_EQ(made(0.02), 0);
        EXPECT_NEAR(x(), 0.17f, 1e-5f) << engine;
        EXPECT_EQ(made(1.05), 4) << "four at most";
        EXPECT_NEAR(play.dropped_seconds(), 0.7, 1e-6);
        EXPECT_NEAR(play.time(), 0.6, 1e-6);
        EXPECT_NEAR(x(), 0.5f + 0.02f, 1e-4f) << engine;
        ASSERT_TRUE(play.step());
        EXPECT_NEAR(x(), 0.7f, 1e-5f) << "after a step, the last one";
        for (const double wrong : {-1.0, double(NAN), double(INFINITY)}) {
            const auto refused = play.advance(wrong);
            ASSERT_FALSE(refused);
            EXPECT_EQ(refused.error().kind, ErrorKind::Usage);
        }
        EXPECT_NEAR(play.time(), 0.7, 1e-6);
    }
}

// What a program asks step by step is what simulate tells of the whole.
TEST(Play, BodiesAndEventsAreThoseThatSimulateTells) {
    std::string text = kScene;
    text.insert(text.rfind('}'), R"(, "objects": {"zone": {"shape": "box", "half_extents": [0.5, 0.2, 0.5]}},
        "triggers": [{"id": "gate", "object": "zone", "position": [0.2, 1, 0]}])");
    const World world = parsed(text);
    for (const std::string& engine : engines()) {
        const auto told = world.simulate_json({.seconds = 1, .backend = engine});
        ASSERT_TRUE(told) << told.error().message;
        const json ways = json::parse(*told);
        Play play = started(world, engine);
        EXPECT_TRUE(play.events().empty());
        json events = json::array();
        for (int i = 0; i <= 60; ++i) {
            if (i > 0) {
                ASSERT_TRUE(play.step());
            }
            const auto bodies = play.bodies();
            const json& frame = ways["frames"][size_t(i)]["bodies"];
            ASSERT_EQ(bodies.size(), frame.size());
            for (size_t k = 0; k < bodies.size(); ++k) {
                EXPECT_EQ(bodies[k].id, frame[k]["id"]);
                EXPECT_EQ(bodies[k].pose.position.y, frame[k]["position"][1].get<float>()) << i;
                EXPECT_EQ(bodies[k].linear_velocity.x, frame[k]["linear_velocity"][0].get<float>()) << i;
                EXPECT_EQ(bodies[k].asleep, frame[k]["asleep"]);
            }
            for (const PlayEvent& e : play.events()) events.push_back({std::string(e.type), e.a, e.b});
        }
        ASSERT_EQ(events.size(), ways["events"].size());
        bool entered = false;
        for (size_t i = 0; i < events.size(); ++i) {
            const json& e = ways["events"][i];
            EXPECT_EQ(events[i], json({e["type"], e["a"], e["b"]}));
            entered = entered || events[i] == json({"enter", "gate", "b"});
        }
        EXPECT_TRUE(entered);
        // Several steps at once, none of whose events is lost.
        Play other = started(world, engine);
        json again = json::array();
        for (int i = 0; i < 20; ++i) {
            ASSERT_EQ(*other.advance(3.0001 / 60), 3);
            for (const PlayEvent& e : other.events()) again.push_back({std::string(e.type), e.a, e.b});
        }
        EXPECT_EQ(again, events);
        // What is launched is the last of them.
        Edit ball;
        ball.node.shape = Sphere{.radius = 0.2f};
        ball.node.transform.position = {3, 5, 0};
        ASSERT_TRUE(other.launch(ball, {0, 1, 0}));
        EXPECT_EQ(other.bodies().size(), 3u);
        EXPECT_EQ(other.bodies().back().pose.position, (vec3{3, 5, 0}));
        for (int i = 0; i < 300 && other.events().empty(); ++i) ASSERT_TRUE(other.step());
        ASSERT_FALSE(other.events().empty()) << "it falls on the ground";
        ASSERT_TRUE(other.restart());
        EXPECT_TRUE(other.events().empty());
        EXPECT_EQ(other.bodies().size(), 2u);
    }
}

TEST(Play, CommandsChangeTheGroundBeforeTheNextStepAndNeverABody) {
    const World world = parsed(kScene);
    for (const std::string& engine : engines()) {
        Play play = started(world, engine);
        for (int i = 0; i < 180; ++i) ASSERT_TRUE(play.step());
        const float rest = shown(play).instances[1].pose.position.y;
        EXPECT_NEAR(rest, 0.3f, 0.05f) << engine;
        const auto refused = play.apply(R"({"remove": "crate"})", "editor");
        ASSERT_FALSE(refused);
        EXPECT_THAT(refused.error().message, HasSubstr("editor: \"crate\" is a body's"));
        EXPECT_FALSE(play.apply(R"({"remove": "nobody"})"));
        ASSERT_TRUE(play.step()) << "a refused command changes nothing";
        EXPECT_EQ(shown(play).instances.size(), 2u);
        ASSERT_TRUE(play.apply(
            R"({"add": {"id": "pit", "shape": "box", "half_extents": [1, 2, 1], "position": [-1.5, 0, 0], "op": "subtract"}})"));
        for (int i = 0; i < 30; ++i) ASSERT_TRUE(play.step());
        EXPECT_LT(shown(play).instances[1].pose.position.y, rest - 0.5f) << engine << ": dug away under it";
    }
    EXPECT_FALSE(world.find_edit("pit"));
}

TEST(Play, BakesNothingOfWhatTheWorldThatItBeginsFromHasBaked) {
    World world = parsed(kScene);
    // Its rows and slots are not those that its file would give.
    for (const char* command :
         {R"({"add": {"id": "gone", "shape": "sphere", "position": [3, 0, 0]}})",
          R"({"add": {"id": "hill", "shape": "sphere", "position": [-4, -0.5, 0], "blend_radius": 0.2}})",
          R"({"remove": "gone"})", R"({"add": {"id": "dent", "shape": "sphere", "op": "subtract", "radius": 0.3}})"})
        ASSERT_TRUE(world.apply(command));
    const auto drawn = world.frame(kPlayCamera);
    ASSERT_TRUE(drawn);
    const uint64_t baked = drawn->field->revision();
    const World read = parsed(world.to_json());
    const std::string text = world.to_json();
    for (const std::string& engine : engines()) {
        Play play = started(world, engine), other = started(read, engine);
        auto begun = Play::begin(world, {.backend = engine});
        ASSERT_TRUE(begun);
        EXPECT_EQ(shown(*begun).field->revision(), baked) << engine;
        ASSERT_TRUE(begun->stop());
        ASSERT_TRUE(play.step() && other.step());
        EXPECT_EQ(shown(play).field->revision(), baked) << engine;
        EXPECT_NE(shown(other).field->revision(), baked) << engine;
        const char* dig =
            R"({"add": {"shape": "sphere", "radius": 0.3, "position": [0.8, 0.3, 0.5], "op": "subtract"}})";
        ASSERT_TRUE(play.apply(dig) && other.apply(dig));
        ASSERT_TRUE(play.step() && other.step());
        const Frame dug = shown(play), as_read = shown(other);
        EXPECT_EQ(dug.field->parent_revision(), baked) << engine;
        EXPECT_GT(dug.field->stats().bricks_baked, 0u);
        EXPECT_LT(dug.field->stats().bricks_baked, dug.field->stats().bricks / 4) << engine << ": what the dig reaches";
        // It is the play of the world as it would be read, to the bit.
        EXPECT_EQ(dug.field->stats().bricks, as_read.field->stats().bricks);
        ASSERT_EQ(dug.instances.size(), as_read.instances.size());
        for (int i = 0; i < 60; ++i) ASSERT_TRUE(play.step() && other.step());
        const Frame late = shown(play), late_as_read = shown(other);
        for (size_t b = 0; b < late.instances.size(); ++b) {
            EXPECT_EQ(late.instances[b].pose, late_as_read.instances[b].pose) << engine;
            EXPECT_EQ(dug.instances[b].pose, as_read.instances[b].pose) << engine;
        }
        World one = parsed(text), two = parsed(text);
        ASSERT_TRUE(play.keep(one) && other.keep(two));
        EXPECT_EQ(one.to_json(), two.to_json()) << engine;
        // From the start again it is the same field still.
        ASSERT_TRUE(play.restart());
        EXPECT_LT(shown(play).field->stats().bricks_baked, dug.field->stats().bricks / 4) << engine;
    }
    EXPECT_EQ(world.to_json(), text) << "the world stays as it is";
    EXPECT_EQ(world.frame(kPlayCamera)->field->revision(), baked);
}

TEST(Play, WhatWasMovedByHandStartsWhereTheListHasIt) {
    World world = parsed(R"({"format": 1, "field": {"voxel_size": 0.1},
      "edits": [{"id": "ground", "shape": "plane"},
        {"id": "loose", "shape": "sphere", "radius": 0.3, "position": [3, 1, 0], "dynamic": true},
        {"id": "blended", "shape": "sphere", "radius": 0.3, "position": [-3, 0, 0], "blend_radius": 0.2, "dynamic": true},
        {"id": "ball", "shape": "sphere", "radius": 0.3, "position": [0, 1, 0]}],
      "bodies": [{"id": "b", "edits": ["ball"]}]})");
    ASSERT_TRUE(world.move(*world.find_edit("loose"), {{3, 2, 0}, {}}));
    ASSERT_TRUE(world.move(*world.find_edit("blended"), {{-4, 0, 0}, {}}));
    ASSERT_TRUE(world.frame(kPlayCamera));
    Play play = started(world, engines().front());
    const World read = parsed(world.to_json());
    Play other = started(read, engines().front());
    const Frame frame = shown(play), as_read = shown(other);
    ASSERT_EQ(frame.instances.size(), 2u);
    for (size_t i = 0; i < 2; ++i) {
        EXPECT_EQ(frame.instances[i].pose, as_read.instances[i].pose) << i;
        EXPECT_EQ(frame.instances[i].before, as_read.instances[i].before) << i;
    }
    EXPECT_EQ(frame.field->stats().bricks, as_read.field->stats().bricks) << "the hump is where the list has it";
    EXPECT_EQ(world.pose(*world.find_edit("loose"))->position, (vec3{3, 2, 0}));
}

TEST(Play, LinesAreThoseOfTheContactsTheShapesAndTheSleepers) {
    const World world = parsed(kScene);
    for (const std::string& engine : engines()) {
        auto made = scene::Simulation::make(world, {.backend = engine});
        ASSERT_TRUE(made);
        scene::Simulation& simulation = **made;
        const auto count = [&](const PlayLines& lines) {
            auto frame = simulation.frame(kPlayCamera, 1, lines);
            EXPECT_TRUE(frame);
            return frame->lines;
        };
        const PlayLines contacts{.contacts = true}, shapes{.shapes = true}, sleeping{.sleeping = true};
        EXPECT_TRUE(count({}).empty());
        EXPECT_TRUE(count(contacts).empty()) << "nothing touches yet";
        EXPECT_TRUE(count(sleeping).empty());
        // Three circles of 24 pieces, and the edges of a box.
        EXPECT_EQ(count(shapes).size(), 3u * 24 + 12);
        bool slept = false;
        for (int i = 0; i < 400; ++i) {
            ASSERT_TRUE(simulation.step());
            if (i % 40 != 0 && slept) continue;
            std::vector<dvec3> expected;
            const physics::World& w = simulation.world();
            for (const physics::World::Touch& touch : w.touches())
                for (const physics::BodyContact& c : w.touch_points(touch))
                    expected.push_back({double(c.position.x), double(c.position.y), double(c.position.z)});
            const std::vector<DebugLine> drawn = count(contacts);
            ASSERT_EQ(drawn.size(), expected.size()) << engine << " " << i;
            for (size_t k = 0; k < drawn.size(); ++k) EXPECT_EQ(drawn[k].a, expected[k]) << engine;
            EXPECT_TRUE(i < 200 || !drawn.empty()) << engine;
            size_t asleep = 0;
            for (const auto& m : simulation.members())
                if (simulation.state(m).asleep) asleep += m.id == "b" ? 3 * 24 : 12;
            slept = slept || asleep > 0;
            const std::vector<DebugLine> sleepers = count(sleeping);
            ASSERT_EQ(sleepers.size(), asleep) << engine << " " << i;
            for (const DebugLine& line : sleepers) EXPECT_EQ(line.color, physics::kAsleep);
        }
        EXPECT_TRUE(slept) << engine;
    }
}

// A body drawn where it fell is the picture of a scene that has it there.
TEST(PlayGpu, ABodyLooksAsIfTheSceneHadItWhereItIs) {
    auto renderer = Renderer::create({.validation = true});
    if (!renderer) {
        const char* required = std::getenv("REQUIRE_VULKAN");
        ASSERT_FALSE(required != nullptr && std::string_view(required) == "1") << renderer.error().message;
        GTEST_SKIP() << renderer.error().message;
    }
    const World world = parsed(kScene);
    for (const std::string& engine : engines()) {
        Play play = started(world, engine);
        for (int i = 0; i < 25; ++i) ASSERT_TRUE(play.step());
        const Frame frame = shown(play);
        World there = parsed(kScene);
        for (const char* name : {"ball", "crate"}) {
            const EditId id = *there.find_edit(name);
            Edit edit = *there.find(id);
            const Pose pose = frame.instances[name == std::string_view("ball") ? 0 : 1].pose;
            EXPECT_NE(edit.node.transform.position, pose.position);
            edit.node.transform.position = pose.position;
            edit.node.transform.rotation = pose.rotation;
            ASSERT_TRUE(there.change(id, edit));
        }
        const auto still = there.frame(kPlayCamera);
        ASSERT_TRUE(still);
        const RenderSettings settings{.width = 64, .height = 40};
        const auto played = renderer->render(frame, settings);
        ASSERT_TRUE(played);
        const auto placed = renderer->render(*still, settings);
        ASSERT_TRUE(placed);
        size_t differ = 0;
        for (size_t i = 0; i < played->srgb.size(); ++i) differ += std::abs(played->srgb[i] - placed->srgb[i]) > 2;
        EXPECT_LE(differ, 8u) << engine;  // bytes of 10240
        const auto at_start = renderer->render(*world.frame(kPlayCamera), settings);
        ASSERT_TRUE(at_start);
        size_t moved = 0;
        for (size_t i = 0; i < played->srgb.size(); ++i) moved += std::abs(played->srgb[i] - at_start->srgb[i]) > 2;
        EXPECT_GT(moved, 200u) << engine;
    }
}

}  // namespace

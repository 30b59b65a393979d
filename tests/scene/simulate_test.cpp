// SPDX-License-Identifier: MIT
// Starts threads.
// Scenes with bodies, run: what the JSON says, for every engine that runs here.
#include <kiln/world.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "simulated.h"
#include "temp_folder.h"

#include <cmath>
#include <fstream>
#include <string>
#include <string_view>

using namespace kiln;
using nlohmann::json;
using scene::engines;
using scene::parsed;
using scene::run;
using testing::HasSubstr;

namespace {

std::string message(const std::string& text, const SimulateSettings& settings = {}) {
    auto world = World::parse(text, "s.kiln.json");
    if (!world) return world.error().message;
    const auto out = world->simulate_json(settings);
    return out ? "no error" : out.error().message;
}

const json& body(const json& frame, const std::string& id) {
    for (const json& b : frame["bodies"])
        if (b["id"] == id) return b;
    static const json none;
    ADD_FAILURE() << "no body " << id;
    return none;
}

constexpr const char* kTumble = R"({"format": 1,
  "edits": [
    {"id": "ground", "shape": "plane"},
    {"id": "lump", "shape": "sphere", "radius": 1, "position": [0, -0.2, 0], "blend_radius": 0.3},
    {"id": "ball", "shape": "sphere", "radius": 0.2, "scale": 2, "position": [4, 0.4, 0]},
    {"id": "crate", "shape": "box", "half_extents": [0.3, 0.3, 0.3], "position": [-0.2, 2, 0.1], "rotation": [0, 0, 0.1305262, 0.9914449]},
    {"id": "ring", "shape": "torus", "major_radius": 0.6, "minor_radius": 0.15, "position": [-4, 0.2, 0]},
    {"id": "cut", "shape": "box", "half_extents": [0.2, 0.5, 0.2], "position": [-3.4, 0.2, 0], "op": "subtract"}],
  "bodies": [
    {"id": "b1", "edits": ["ball"], "density": 500},
    {"id": "b2", "edits": ["crate"]},
    {"id": "b3", "edits": ["ring", "cut"], "friction": 0.9}]})";

// A ball at rest on a block; the block is dug away under it.
constexpr const char* kDug = R"({"format": 1,
  "edits": [
    {"id": "block", "shape": "box", "half_extents": [2, 1, 2], "position": [0, -1, 0]},
    {"id": "far", "shape": "box", "half_extents": [1, 1, 1], "position": [30, -1, 0]},
    {"id": "ball", "shape": "sphere", "radius": 0.5, "position": [0, 0.5, 0]},
    {"id": "other", "shape": "sphere", "radius": 0.5, "position": [30, 0.5, 0]}],
  "bodies": [{"id": "b", "edits": ["ball"]}, {"id": "o", "edits": ["other"]}]})";

TEST(Simulate, WhatIsDugAwayUnderABodyLetsItFallWithTheNextStep) {
    const World world = parsed(kDug);
    const std::vector<TimedCommand> dig = {
        {2.0, "dig",
         R"({"time": 2, "command": {"add": {"id": "hole", "shape": "box", "half_extents": [1, 3, 1], "op": "subtract"}}})",
         1}};
    for (const std::string& engine : engines()) {
        const json out = run(world, {.seconds = 2.5, .backend = engine, .edits = dig});
        const auto fall = [&](int frame) {
            return body(out["frames"][size_t(frame)], "b")["linear_velocity"][1].get<double>();
        };
        EXPECT_NEAR(fall(120), 0, 1e-3) << engine;
        EXPECT_NEAR(fall(121), -9.81 / 60, 0.01 * 9.81 / 60) << engine;
        EXPECT_NEAR(fall(130), -9.81 / 6, 0.02 * 9.81) << engine;
        EXPECT_TRUE(body(out["frames"][150], "o")["asleep"].get<bool>()) << engine << ": what lies elsewhere sleeps on";
        const json again = run(world, {.seconds = 2.5, .backend = engine, .threads = 2, .edits = dig});
        EXPECT_EQ(again, out) << engine;
    }
    EXPECT_TRUE(world.find_edit("block") && !world.find_edit("hole")) << "the world stays as it is";
}

TEST(Simulate, CommandsThatCannotBeMadeSayWhere) {
    const World world = parsed(kDug);
    const auto told = [&](const std::string& command) {
        const auto out = world.simulate_json(
            {.seconds = 0.1, .edits = {{0.0, "edits.jsonl", R"({"time": 0, "command": )" + command + "}", 7}}});
        return out ? std::string("no error") : out.error().message;
    };
    EXPECT_THAT(told(R"({"remove": "ball"})"), HasSubstr("edits.jsonl:7: \"ball\" is a body's"));
    EXPECT_THAT(told(R"({"remove": "nobody"})"), HasSubstr("edits.jsonl:7"));
}

TEST(Simulate, SaysWhatTheContractNames) {
    const World world = parsed(kTumble);
    for (const std::string& engine : engines()) {
        const json out = run(world, {.seconds = 1, .every = 0.25, .backend = engine});
        EXPECT_EQ(out["backend"], engine);
        ASSERT_EQ(out["bodies"].size(), 3u);
        EXPECT_EQ(out["bodies"][0]["id"], "b1");
        EXPECT_NEAR(out["bodies"][0]["mass"].get<double>(), 500 * 4 / 3.0 * 3.14159265 * 0.064, 0.01);
        EXPECT_NEAR(out["bodies"][1]["mass"].get<double>(), 216, 0.01);
        EXPECT_LT(out["bodies"][2]["center_of_mass"][0].get<double>(), -0.05);
        ASSERT_EQ(out["frames"].size(), 5u);
        for (size_t i = 0; i < 5; ++i) {
            EXPECT_NEAR(out["frames"][i]["time"].get<double>(), 0.25 * double(i), 1e-5);
            for (const json& b : out["frames"][i]["bodies"])
                for (const char* key : {"id", "position", "rotation", "linear_velocity", "angular_velocity", "asleep"})
                    EXPECT_TRUE(b.contains(key)) << key;
        }
        // At the start a body's frame is its first edit's.
        EXPECT_EQ(body(out["frames"][0], "b2")["position"], json::parse("[-0.2, 2.0, 0.1]"));
        EXPECT_EQ(body(out["frames"][0], "b3")["position"], json::parse("[-4.0, 0.2, 0.0]"));
        ASSERT_FALSE(out["events"].empty());
        for (const json& e : out["events"]) EXPECT_TRUE(e["type"] == "begin" || e["type"] == "end");
    }
}

TEST(Simulate, ThreadsDoNotChangeAByte) {
    const World world = parsed(kTumble);
    for (const std::string& engine : engines()) {
        const auto one = world.simulate_json({.seconds = 3, .backend = engine, .threads = 1});
        const auto two = world.simulate_json({.seconds = 3, .backend = engine, .threads = 2});
        const auto again = world.simulate_json({.seconds = 3, .backend = engine, .threads = 1});
        ASSERT_TRUE(one && two && again);
        EXPECT_EQ(*one, *two) << engine;
        EXPECT_EQ(*one, *again) << engine;
    }
}

TEST(Simulate, EditsOfBodiesLeaveTheWorld) {
    // Where each lies in the world's list it would be pushed out of itself.
    const World world = parsed(kTumble);
    for (const std::string& engine : engines()) {
        for (const bool as_fields : {false, true}) {
            const json out = run(world, {.seconds = 4, .every = 4, .backend = engine, .field_bodies = as_fields});
            const json& ball = body(out["frames"].back(), "b1");
            EXPECT_NEAR(ball["position"][1].get<double>(), 0.4, 0.01) << engine << as_fields;
            EXPECT_NEAR(ball["position"][0].get<double>(), 4, 0.02) << engine << as_fields;
            const json& ring = body(out["frames"].back(), "b3");
            EXPECT_NEAR(ring["position"][1].get<double>(), 0.15, 0.02) << engine << as_fields;
            EXPECT_NEAR(ring["position"][0].get<double>(), -4, 0.05) << engine << as_fields;
        }
    }
}

TEST(Simulate, AFallIsTheFormulas) {
    const World world = parsed(R"({"format": 1, "physics": {"gravity": [0, -3.7, 0.5], "step": 0.01},
      "edits": [{"id": "e", "shape": "ellipsoid", "radii": [0.2, 0.3, 0.4], "position": [1, 100, 2]}],
      "bodies": [{"id": "b", "edits": ["e"], "linear_velocity": [2, 1, 0], "angular_velocity": [0, 0, 0]}]})");
    for (const std::string& engine : engines()) {
        const json out = run(world, {.seconds = 2, .every = 2, .backend = engine});
        ASSERT_EQ(out["frames"].size(), 2u);
        const json& b = body(out["frames"][1], "b");
        EXPECT_NEAR(b["linear_velocity"][1].get<double>(), 1 - 3.7 * 2, 1e-3) << engine;
        // Symplectic Euler: half a step more than the parabola.
        EXPECT_NEAR(b["position"][0].get<double>(), 1 + 2 * 2, 2e-3) << engine;
        EXPECT_NEAR(b["position"][1].get<double>(), 100 + 2 - 0.5 * 3.7 * 2 * 2.01, 5e-3) << engine;
        EXPECT_NEAR(b["position"][2].get<double>(), 2 + 0.5 * 0.5 * 2 * 2.01, 2e-3) << engine;
        EXPECT_FALSE(b["asleep"].get<bool>());
    }
}

TEST(Simulate, MotionAndSurfaceAreRead) {
    const World world = parsed(R"({"format": 1, "physics": {"restitution": 0.8},
      "edits": [{"id": "ground", "shape": "plane"},
                {"id": "a", "shape": "sphere", "radius": 0.5, "position": [0, 3, 0]},
                {"id": "b", "shape": "sphere", "radius": 0.5, "position": [5, 3, 0]},
                {"id": "c", "shape": "box", "position": [-5, 3, 0]}],
      "bodies": [{"id": "bouncer", "edits": ["a"]},
                 {"id": "hanging", "edits": ["b"], "motion": "static"},
                 {"id": "gliding", "edits": ["c"], "motion": "kinematic", "linear_velocity": [1, 0, 0]}]})");
    for (const std::string& engine : engines()) {
        const json out = run(world, {.seconds = 1.4, .backend = engine});
        double highest = 0;
        bool touched = false;
        for (const json& f : out["frames"]) {
            const double y = body(f, "bouncer")["position"][1].get<double>();
            touched = touched || y < 0.6;
            if (touched) highest = std::max(highest, y);
        }
        // 2.5 m down, 0.8² of it up again.
        EXPECT_NEAR(highest - 0.5, 2.5 * 0.64, 0.15) << engine;
        EXPECT_EQ(body(out["frames"].back(), "hanging")["position"][1], 3.0);
        EXPECT_NEAR(body(out["frames"].back(), "gliding")["position"][0].get<double>(), -5 + 1.4, 0.01) << engine;
        EXPECT_EQ(out["bodies"][1]["mass"], 0.0);
    }
}

TEST(Simulate, TheGroundsMaterialsSayHowTheyRub) {
    // Three strips of a slope of 20 degrees: ice, rubber, and one whose material says nothing of friction.
    const World world = parsed(R"({"format": 1, "physics": {"friction": 0.9, "gravity": [3.3552, -9.2184, 0]},
      "materials": {"ice": {"friction": 0}, "rubber": {"friction": 1.5}, "paint": {"base_color": [1, 0, 0]}},
      "edits": [{"id": "i", "shape": "box", "half_extents": [50, 1, 1], "position": [0, -1, -3], "material": "ice"},
                {"id": "r", "shape": "box", "half_extents": [50, 1, 1], "position": [0, -1, 0], "material": "rubber"},
                {"id": "p", "shape": "box", "half_extents": [50, 1, 1], "position": [0, -1, 3], "material": "paint"},
                {"id": "a", "shape": "box", "half_extents": [0.3, 0.1, 0.3], "position": [0, 0.1, -3]},
                {"id": "b", "shape": "box", "half_extents": [0.3, 0.1, 0.3], "position": [0, 0.1, 0]},
                {"id": "c", "shape": "box", "half_extents": [0.3, 0.1, 0.3], "position": [0, 0.1, 3]}],
      "bodies": [{"id": "on_ice", "edits": ["a"]}, {"id": "on_rubber", "edits": ["b"]},
                 {"id": "on_paint", "edits": ["c"], "friction": 0.2}]})");
    for (const std::string& engine : engines()) {
        const json end = run(world, {.seconds = 1, .every = 1, .backend = engine})["frames"].back();
        EXPECT_NEAR(body(end, "on_ice")["linear_velocity"][0].get<double>(), 3.3552, 0.02) << engine;
        EXPECT_NEAR(body(end, "on_rubber")["position"][0].get<double>(), 0, 0.01) << engine;
        EXPECT_NEAR(body(end, "on_paint")["position"][0].get<double>(), 0, 0.01) << engine;
    }
}

TEST(Simulate, WhatCannotBeSimulatedIsOneClearError) {
    const std::string hollow = R"({"format": 1,
 "edits": [{"id": "a", "shape": "sphere", "radius": 0.2}, {"id": "b", "shape": "sphere", "radius": 0.3, "op": "subtract"}],
 "bodies": [{"id": "x", "edits": ["a", "b"]}]})";
    EXPECT_THAT(message(hollow),
                testing::AllOf(HasSubstr("s.kiln.json:3:"), HasSubstr("bodies[0]"), HasSubstr("no volume")));
    EXPECT_THAT(
        message(R"({"format": 1, "edits": [{"id": "a", "shape": "plane"}], "bodies": [{"id": "x", "edits": ["a"]}]})"),
        HasSubstr("without end"));
    EXPECT_THAT(message(R"({"format": 1, "edits": [{"id": "a", "shape": "sphere"}],
      "bodies": [{"id": "x", "edits": ["a"]}, {"id": "y", "edits": ["a"]}]})"),
                testing::AllOf(HasSubstr("bodies[1].edits[0]"), HasSubstr("body \"x\" already")));
    EXPECT_THAT(
        message(R"({"format": 1, "meshes": [{"id": "m", "file": "m.glb"}], "bodies": [{"id": "x", "mesh": "m"}]})"),
        testing::AllOf(HasSubstr("bodies[0]"), HasSubstr("m.glb")));
    EXPECT_THAT(message(R"({"format": 1, "meshes": [{"id": "m", "file": "m.glb"}],
      "bodies": [{"id": "x", "mesh": "m", "collision": "triangles"}]})"),
                testing::AllOf(HasSubstr("bodies[0].collision"), HasSubstr("static")));
    EXPECT_THAT(message(kTumble, {.backend = "no such"}), testing::AllOf(HasSubstr("no such"), HasSubstr("bullet")));
    EXPECT_THAT(message(kTumble, {.seconds = NAN}), HasSubstr("finite"));
    EXPECT_THAT(message(kTumble, {.seconds = -1}), HasSubstr("0 or more"));
    EXPECT_THAT(message(kTumble, {.every = -1}), HasSubstr("0 or more"));
}

// A pillar on the ground, cut through; its upper part leans over nothing and falls straight.
constexpr const char* kCutPillar = R"({"format": 1, "field": {"voxel_size": 0.05},
  "edits": [
    {"id": "ground", "shape": "plane"},
    {"id": "pillar", "shape": "box", "half_extents": [0.3, 2, 0.3], "position": [0, 1.5, 0]},
    {"id": "ball", "shape": "sphere", "radius": 0.2, "position": [5, 0.2, 0]}],
  "bodies": [{"id": "b", "edits": ["ball"]}]})";
const std::vector<TimedCommand> kCut = {
    {0.5, "cut",
     R"({"time": 0.5, "command": {"add": {"id": "slit", "shape": "box", "half_extents": [1, 0.2, 1], "position": [0, 1.8, 0], "op": "subtract"}}})",
     1}};

TEST(Simulate, APartCutLooseBecomesABodyThatFallsAndComesToRest) {
    const World world = parsed(kCutPillar);
    for (const std::string& engine : engines()) {
        const json out = run(world, {.seconds = 4, .backend = engine, .edits = kCut});
        ASSERT_EQ(out["bodies"].size(), 2u) << engine;
        EXPECT_EQ(out["bodies"][1]["id"], "part1");
        // 0.6 x 1.5 x 0.6 m of 1000 kg/m3.
        EXPECT_NEAR(out["bodies"][1]["mass"].get<double>(), 540, 15);
        EXPECT_EQ(out["frames"][30]["bodies"].size(), 1u);
        const auto part = [&](size_t frame) { return body(out["frames"][frame], "part1"); };
        EXPECT_NEAR(part(31)["linear_velocity"][1].get<double>(), -9.81 / 60, 0.01 * 9.81 / 60)
            << "it falls with the next step";
        const double before = part(31)["position"][1].get<double>(), after = part(240)["position"][1].get<double>();
        EXPECT_NEAR(before - after, 0.4, 0.03) << engine << ": it stands on the stump";
        EXPECT_NEAR(part(240)["position"][0].get<double>(), part(31)["position"][0].get<double>(), 0.03) << engine;
        EXPECT_LT(std::abs(part(240)["linear_velocity"][1].get<double>()), 0.02) << engine;
        EXPECT_EQ(run(world, {.seconds = 4, .backend = engine, .threads = 2, .edits = kCut}), out) << engine;
    }
}

TEST(Simulate, WhatIsCutAgainIsCutFromWhatWasLeft) {
    // The stump is cut off too, below the part that lies on it: the part stays a body, and falls with it.
    const World world = parsed(kCutPillar);
    std::vector<TimedCommand> twice = kCut;
    twice.push_back(
        {2.5, "cut",
         R"({"time": 2.5, "command": {"add": {"id": "slit2", "shape": "box", "half_extents": [1, 0.1, 1], "position": [0, 0.5, 0], "op": "subtract"}}})",
         2});
    for (const std::string& engine : engines()) {
        const json out = run(world, {.seconds = 5, .every = 0.5, .backend = engine, .edits = twice});
        ASSERT_EQ(out["bodies"].size(), 3u) << engine;
        EXPECT_NEAR(out["bodies"][2]["mass"].get<double>(), 0.6 * 1.0 * 0.6 * 1000, 20)
            << "no second copy of the first part";
        const json& end = out["frames"].back();
        EXPECT_NEAR(body(end, "part2")["position"][1].get<double>(), 0.9, 0.1) << engine;
    }
}

TEST(Simulate, APartThatHasComeToRestIsGroundAgainAndCanBeCutAgain) {
    const World world = parsed(kCutPillar);
    std::vector<TimedCommand> later = kCut;
    // Through the fallen part, which reaches from 1.6 m to 3.1 m now.
    later.push_back(
        {6, "cut",
         R"({"time": 6, "command": {"add": {"id": "slit2", "shape": "box", "half_extents": [1, 0.1, 1], "position": [0, 2.4, 0], "op": "subtract"}}})",
         2});
    for (const std::string& engine : engines()) {
        const json out = run(world, {.seconds = 8, .every = 0.5, .backend = engine, .edits = later});
        ASSERT_EQ(out["bodies"].size(), 3u) << engine;
        EXPECT_NEAR(out["bodies"][1]["mass"].get<double>(), 540, 15) << engine;
        EXPECT_NEAR(out["bodies"][2]["mass"].get<double>(), 0.6 * 0.6 * 0.6 * 1000, 15) << engine;
        const json &first = body(out["frames"][11], "part1"), &end = body(out["frames"][16], "part1");
        EXPECT_EQ(first["position"], end["position"]) << engine << ": it stays where it settled";
        EXPECT_TRUE(end["asleep"].get<bool>());
        // 2.8 m, and down by the 0.2 m of the slit.
        EXPECT_NEAR(body(out["frames"][16], "part2")["position"][1].get<double>(), 2.6, 0.04) << engine;
        EXPECT_EQ(run(world, {.seconds = 8, .every = 0.5, .backend = engine, .threads = 2, .edits = later}), out);
    }
}

TEST(Simulate, AnEditThatEnclosesABodyNeitherShootsItNorStopsTheOthers) {
    const World world = parsed(kDug);
    const std::vector<TimedCommand> enclose = {
        {1.0, "edits",
         R"({"time": 1, "command": {"add": {"id": "tomb", "shape": "sphere", "radius": 2, "position": [0, 0.5, 0]}}})",
         1}};
    for (const std::string& engine : engines()) {
        const json out = run(world, {.seconds = 4, .backend = engine, .edits = enclose});
        // It comes out somewhere, and rolls off: what it has beyond what a fall gives it is a push's.
        double highest = 0.5;
        for (const json& f : out["frames"]) {
            double speed2 = 0;
            for (const char* key : {"position", "linear_velocity", "angular_velocity"})
                for (const json& v : body(f, "b")[key]) {
                    ASSERT_TRUE(v.is_number()) << engine << " " << key;
                    if (std::string_view(key) == "angular_velocity") {
                        EXPECT_LT(std::abs(v.get<double>()), 10) << engine << " " << f["time"];
                    } else if (std::string_view(key) == "linear_velocity") {
                        speed2 += v.get<double>() * v.get<double>();
                    }
                }
            const double height = body(f, "b")["position"][1].get<double>();
            highest = std::max(highest, height);
            EXPECT_LT(speed2, 5 * 5 + 2 * 9.81 * (highest - height)) << engine << " " << f["time"];
        }
        EXPECT_NEAR(body(out["frames"].back(), "o")["position"][1].get<double>(), 0.5, 0.01) << engine;
        EXPECT_TRUE(body(out["frames"].back(), "o")["asleep"].get<bool>()) << engine;
    }
}

TEST(Simulate, ATriggerIsLeftByAPartThatIsABodyNoMore) {
    json scene = json::parse(kCutPillar);
    scene["objects"] = json::parse(R"({"gate": {"shape": "box", "half_extents": [0.5, 0.5, 0.5]}})");
    scene["triggers"] = json::parse(R"([{"id": "stump", "object": "gate", "position": [0, 1.6, 0]}])");
    const World world = parsed(scene.dump());
    for (const std::string& engine : engines()) {
        const json out = run(world, {.seconds = 7, .every = 7, .backend = engine, .edits = kCut});
        std::vector<std::string> told;
        double left = 0;
        for (const json& e : out["events"]) {
            if (e["a"] != "stump") continue;
            EXPECT_EQ(e["b"], "part1") << engine;
            told.push_back(e["type"]);
            left = e["time"].get<double>();
        }
        EXPECT_THAT(told, testing::ElementsAre("enter", "leave")) << engine;
        EXPECT_GT(left, 2.5) << engine << ": when it settled";
    }
}

// One more than there may be, before any is made.
TEST(Simulate, AMillionBodiesAreRefusedAtOnce) {
    std::string edits, bodies;
    for (int i = 0; i < 65537; ++i) {
        const std::string n = std::to_string(i), comma = i > 0 ? "," : "";
        edits += comma + R"({"id": "e)" + n + R"(", "shape": "sphere"})";
        bodies += comma + R"({"id": "b)" + n + R"(", "edits": ["e)" + n + "\"]}";
    }
    EXPECT_THAT(message(R"({"format": 1, "edits": [)" + edits + "],\n\"bodies\": [" + bodies + "]}"),
                testing::AllOf(HasSubstr("s.kiln.json:2:"), HasSubstr("65537"), HasSubstr("65535")));
}

TEST(Simulate, TimesAreTidy) {
    const auto text = parsed(kDug).simulate_json({.seconds = 0.05});
    ASSERT_TRUE(text);
    EXPECT_THAT(*text, testing::AllOf(HasSubstr(R"("time": 0,)"), HasSubstr(R"("time": 0.016667,)"),
                                      HasSubstr(R"("time": 0.033333,)"), HasSubstr(R"("time": 0.05,)")));
}

TEST(Simulate, AMeshIsABodyOfTheSolidThatItBounds) {
    const TempFolder folder;
    const auto write = [&](const char* name, int faces) {
        std::ofstream out(folder / name);
        for (const char* v : {"0 0 0", "1 0 0", "1 1 0", "0 1 0", "0 0 1", "1 0 1", "1 1 1", "0 1 1"})
            out << "v " << v << "\n";
        constexpr const char* kFaces[] = {"4 3 2 1", "5 6 7 8", "1 2 6 5", "2 3 7 6", "3 4 8 7", "4 1 5 8"};
        for (int i = 0; i < faces; ++i) out << "f " << kFaces[i] << "\n";
    };
    write("cube.obj", 6);
    write("open.obj", 5);
    const auto scene = [&](const char* file) {
        return World::parse(R"({"format": 1, "edits": [{"id": "ground", "shape": "plane"}],
          "meshes": [{"id": "m", "file": ")" +
                                std::string(file) + R"(", "position": [0, 1, 0], "scale": 0.8}],
          "bodies": [{"id": "crate", "mesh": "m", "density": 500}]})",
                            (folder / "s.kiln.json").string());
    };
    const auto world = scene("cube.obj");
    ASSERT_TRUE(world) << world.error().message;
    for (const std::string& engine : engines()) {
        const json out = run(*world, {.seconds = 3, .every = 3, .backend = engine});
        EXPECT_NEAR(out["bodies"][0]["mass"].get<double>(), 500 * 0.512, 5) << engine;
        EXPECT_NEAR(out["bodies"][0]["center_of_mass"][0].get<double>(), 0.4, 0.005) << engine;
        EXPECT_NEAR(body(out["frames"][1], "crate")["position"][1].get<double>(), 0, 0.01) << engine;
    }
    const auto open = scene("open.obj");
    ASSERT_TRUE(open) << open.error().message;
    const auto refused = open->simulate_json({.seconds = 1});
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message, testing::AllOf(HasSubstr("bodies[0]"), HasSubstr("open.obj"),
                                                        HasSubstr("not closed"), HasSubstr("4 open")));
}

// When each body of ten seconds falls asleep (a step's number; one more than there are: never), how fast it was in the second before (m/s,
// root mean square), and that nobody has fallen through, or drifts.
struct Rest {
    std::string what;
    size_t latest = 0;
    double fastest = 0;
};
Rest rest_of(const World& world, const std::string& engine, bool meshed) {
    Rest out{engine + (meshed ? " on triangles" : " on the field")};
    const json run_ = run(world, {.seconds = 10, .backend = engine, .mesh_ground = meshed});
    const json& frames = run_["frames"];
    EXPECT_GE(run_["bodies"].size(), 8u);
    for (size_t i = 0; i < run_["bodies"].size(); ++i) {
        const auto at = [&](size_t frame) -> const json& { return frames[frame]["bodies"][i]; };
        const auto vector = [&](size_t frame, const char* key) {
            const json& v = at(frame)[key];
            return vec3{v[0].get<float>(), v[1].get<float>(), v[2].get<float>()};
        };
        for (size_t k = 0; k < frames.size(); ++k) EXPECT_GT(vector(k, "position").y, 0.08f) << out.what << i << k;
        size_t slept = frames.size();
        while (slept > 0 && at(slept - 1)["asleep"].get<bool>()) --slept;
        out.latest = std::max(out.latest, slept);
        if (slept == frames.size()) continue;
        double sum = 0;
        const size_t first = slept > 60 ? slept - 60 : 0;
        for (size_t k = first; k < slept; ++k) {
            const vec3 v = vector(k, "linear_velocity");
            sum += double(dot(v, v));
        }
        out.fastest = std::max(out.fastest, std::sqrt(sum / double(std::max<size_t>(slept - first, 1))));
        EXPECT_LE(length(vector(slept, "position") - vector(frames.size() - 1, "position")), 1e-3f) << out.what << i;
    }
    return out;
}

json quarry() {
    std::ifstream in(KILN_SOURCE_DIR "/scenes/quarry.kiln.json");
    return json::parse(in);
}

TEST(SlowSimulate, TheQuarrysBouldersRollDownAndComeToRest) {
    const World world = parsed(quarry().dump());
    for (const std::string& engine : engines()) {
        const json out = run(world, {.seconds = 4, .every = 4, .backend = engine});
        int down = 0;
        for (size_t i = 0; i < out["bodies"].size(); ++i)
            down += out["frames"][0]["bodies"][i]["position"][1].get<double>() >
                    out["frames"][1]["bodies"][i]["position"][1].get<double>() + 1.5;
        EXPECT_GE(down, 4) << engine << ": from one bench to the next";
    }
    for (const std::string& engine : engines())
        for (const bool meshed : {false, true}) {
            const Rest rest = rest_of(world, engine, meshed);
            EXPECT_LE(rest.latest, 5u * 60) << rest.what;
            EXPECT_LE(rest.fastest, 0.02) << rest.what;
        }
}

// What a person does there: the top of the buttress is sawn off, and later the ground dug away under a boulder.
TEST(SlowSimulate, TheQuarryIsDugWhatIsCutOffFallsAndAllComesToRestAgain) {
    const World world = parsed(quarry().dump());
    const std::vector<TimedCommand> digs = {
        {1.0, "digs",
         R"({"time": 1, "command": {"add": {"id": "behind", "shape": "box", "half_extents": [2.5, 1, 0.2], "position": [-6.2, 8, -3.2], "op": "subtract"}}})",
         1},
        {1.0, "digs",
         R"({"time": 1, "command": {"add": {"id": "slit", "shape": "box", "half_extents": [2.2, 0.15, 2.2], "position": [-6.2, 7.1, -1.2], "op": "subtract"}}})",
         2},
        {3.0, "digs",
         R"({"time": 3, "command": {"add": {"id": "hole", "shape": "sphere", "radius": 1, "position": [-9.447, -0.4, 2.281], "op": "subtract"}}})",
         3}};
    for (const std::string& engine : engines()) {
        const json out = run(world, {.seconds = 9, .backend = engine, .edits = digs});
        const json& frames = out["frames"];
        const auto at = [&](size_t frame, const char* id, const char* key) {
            return body(frames[frame], id)[key][1].get<double>();
        };
        ASSERT_EQ(out["bodies"].back()["id"], "part1") << engine;
        EXPECT_NEAR(at(61, "part1", "linear_velocity"), -9.81 / 60, 0.01 * 9.81 / 60) << engine;
        EXPECT_NEAR(at(61, "part1", "position") - at(540, "part1", "position"), 0.3, 0.03) << engine << ": the slit";
        EXPECT_NEAR(at(180, "boulder-5", "linear_velocity"), 0, 1e-3) << engine;
        EXPECT_LT(at(181, "boulder-5", "linear_velocity"), -0.9 * 9.81 / 60) << engine << ": it leans on rubble";
        EXPECT_LT(at(540, "boulder-5", "position"), at(180, "boulder-5", "position") - 0.5) << engine;
        for (size_t i = 0; i < frames.size(); ++i)
            for (const json& b : frames[i]["bodies"])
                for (const char* key : {"position", "rotation", "linear_velocity", "angular_velocity"})
                    for (const json& v : b[key]) ASSERT_TRUE(v.is_number()) << engine << i;
        for (const json& b : frames.back()["bodies"]) {
            EXPECT_TRUE(b["asleep"].get<bool>()) << engine << b["id"];
            EXPECT_GT(b["position"][1].get<double>(), -1.4) << engine << b["id"];
        }
        EXPECT_EQ(run(world, {.seconds = 9, .backend = engine, .threads = 2, .edits = digs}), out) << engine;
    }
}

// Sixteen more of four shapes, convex ones among them, dropped onto the benches.
TEST(SlowSimulate, BouldersComeToRestInTheQuarryWithoutFallingThroughOrTrembling) {
    json scene = quarry();
    scene["bodies"] = json::array();
    std::erase_if(scene["edits"].get_ref<json::array_t&>(),
                  [](const json& e) { return e["id"].get<std::string>().starts_with("boulder-"); });
    constexpr double kAcross[] = {1.0, -2.9, -4.4, 2.0}, kUp[] = {1.5, 4.6, 7.0, 1.2};
    for (int i = 0; i < 16; ++i) {
        const std::string id = "stone-" + std::to_string(i);
        json edit = {{"id", id},
                     {"position", {double(i) - 7.5, kUp[i % 4], kAcross[i % 4]}},
                     {"rotation", {0.258819, 0, 0, 0.9659258}}};
        if (i % 4 == 0) edit.update({{"shape", "sphere"}, {"radius", 0.3}});
        if (i % 4 == 1) edit.update({{"shape", "box"}, {"half_extents", {0.35, 0.25, 0.3}}});
        if (i % 4 == 2) edit.update({{"shape", "rounded_box"}, {"half_extents", {0.4, 0.25, 0.3}}, {"rounding", 0.1}});
        if (i % 4 == 3) edit.update({{"shape", "ellipsoid"}, {"radii", {0.35, 0.25, 0.3}}});
        scene["edits"].push_back(edit);
        scene["bodies"].push_back(
            {{"id", "b" + std::to_string(i)}, {"edits", {id}}, {"density", 2500}, {"friction", 0.8}});
    }
    scene["physics"]["rolling_friction"] = 0.25;
    const World world = parsed(scene.dump());
    for (const std::string& engine : engines())
        EXPECT_EQ(run(world, {.seconds = 4, .backend = engine, .threads = 1}),
                  run(world, {.seconds = 4, .backend = engine, .threads = 2}))
            << engine;
    for (const std::string& engine : engines())
        for (const bool meshed : {false, true}) {
            const Rest rest = rest_of(world, engine, meshed);
            // They fall from the air, and some roll over an edge and fall again.
            EXPECT_LE(rest.latest, 5u * 60) << rest.what;
            EXPECT_LE(rest.fastest, 0.02) << rest.what;
        }
}

TEST(Simulate, TriggersTellWhoEntersAndLeaves) {
    const World world = parsed(R"({"format": 1,
      "objects": {"gate": {"shape": "box", "half_extents": [1, 0.5, 1]}},
      "edits": [
        {"id": "ground", "shape": "plane"},
        {"id": "ball", "shape": "sphere", "radius": 0.25, "position": [0, 5, 0]},
        {"id": "ring", "shape": "torus", "major_radius": 0.3, "minor_radius": 0.1, "position": [6, 4, 0]}],
      "bodies": [{"id": "b", "edits": ["ball"]}, {"id": "r", "edits": ["ring"]}],
      "triggers": [
        {"id": "floor", "object": "gate", "position": [6, 0, 0]},
        {"id": "air", "object": "gate", "position": [0, 2.5, 0], "scale": 0.5, "rotation": [0, 0.3826834, 0, 0.9238795]}]})");
    for (const std::string& engine : engines()) {
        const json out = run(world, {.seconds = 2, .every = 1, .backend = engine});
        std::vector<std::string> told;
        double in = 0, left = 0;
        for (const json& e : out["events"]) {
            const std::string type = e["type"];
            if (type != "enter" && type != "leave") continue;
            told.push_back(type + " " + e["a"].get<std::string>() + " " + e["b"].get<std::string>());
            if (e["a"] == "air") (type == "enter" ? in : left) = e["time"].get<double>();
        }
        EXPECT_THAT(told, testing::ElementsAre("enter air b", "leave air b", "enter floor r")) << engine;
        // Falls 2 m to touch the upper face, 3 m to leave the lower one.
        EXPECT_NEAR(in, std::sqrt(2 * 2 / 9.81), 0.03);
        EXPECT_NEAR(left, std::sqrt(2 * 3 / 9.81), 0.03);
    }
}

}  // namespace

// SPDX-License-Identifier: MIT
// Starts threads.
// What commands cut loose, as the world has it: in pictures, in questions, in the journal; on every engine that runs here.
#include <kiln/world.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "played.h"
#include "temp_folder.h"

#include <cmath>
#include <fstream>
#include <random>
#include <string>

using namespace kiln;
using scene::engines;
using scene::kSlit;
using scene::parsed;
using scene::Played;
using testing::HasSubstr;

namespace {

constexpr Camera kPartsCamera{.position = {0, 2, 6}, .target = {0, 0.5f, 0}};

// A pillar with a painted belt and a smooth head, to be cut through below them.
constexpr const char* kPillar = R"({"format": 1, "field": {"voxel_size": 0.05},
  "materials": {"stone": {}, "red": {"base_color": [1, 0, 0]}, "blue": {"base_color": [0, 0, 1]}},
  "edits": [
    {"id": "ground", "shape": "plane", "material": "stone"},
    {"id": "pillar", "shape": "box", "half_extents": [0.3, 2, 0.3], "position": [0, 1.5, 0], "material": "stone"},
    {"id": "head", "shape": "sphere", "radius": 0.4, "position": [0, 3.4, 0], "blend_radius": 0.2, "material": "stone"},
    {"id": "belt", "shape": "box", "half_extents": [1, 0.1, 1], "position": [0, 2.8, 0], "op": "paint", "material": "red"},
    {"id": "ball", "shape": "sphere", "radius": 0.2, "position": [5, 0.2, 0]}],
  "bodies": [{"id": "b", "edits": ["ball"]}]})";
std::string_view material_at(const World& world, vec3 p) { return world.material_name(world.sample(p).material); }

TEST(Parts, ArePartOfTheSolidInTheirOwnColoursAndMoveInPictures) {
    for (const std::string& engine : engines()) {
        Played p(engine, kPillar);
        EXPECT_EQ(p.shown(kPartsCamera).instances.size(), 1u);
        p.apply(kSlit);
        p.run(1);
        // As it hangs there, a step fallen, world and part are what the dig left, each point once.
        const World kept = p.kept();
        World dug = parsed(kPillar);
        ASSERT_TRUE(dug.apply(kSlit));
        std::mt19937 rng(5);
        const auto uniform = [&](float a, float b) { return std::uniform_real_distribution<float>(a, b)(rng); };
        int solid = 0;
        for (int i = 0; i < 3000; ++i) {
            const vec3 at{uniform(-0.6f, 0.6f), uniform(-0.2f, 4.2f), uniform(-0.6f, 0.6f)};
            const float d = dug.distance(at), k = kept.distance(at);
            if (std::abs(d) < 0.01f) continue;  // it has fallen by 3 mm
            EXPECT_EQ(d < 0, k < 0) << engine << " " << at.x << " " << at.y << " " << at.z << ": " << d << " " << k;
            solid += d < 0;
        }
        EXPECT_GT(solid, 300);
        EXPECT_EQ(material_at(kept, {0.31f, 2.8f, 0}), "red") << engine;
        EXPECT_EQ(material_at(kept, {0.31f, 2.4f, 0}), "stone") << engine;
        const Frame frame = p.shown(kPartsCamera);
        ASSERT_EQ(frame.instances.size(), 2u) << engine << ": it stands apart";
        const float height = frame.instances[1].pose.position.y;
        p.run(20);
        const Frame later = p.shown(kPartsCamera);
        EXPECT_LT(later.instances[1].pose.position.y, height - 0.2f) << engine;
        EXPECT_EQ(later.instances[1].before, frame.instances[1].pose) << engine << ": motion";
        const World flying = p.kept();
        EXPECT_EQ(flying.find(*flying.find_edit("part1"))->node.transform.position, later.instances[1].pose.position)
            << engine << ": kept in flight";
        p.run(400);
        EXPECT_EQ(p.shown(kPartsCamera).instances.size(), 1u) << engine << ": it is ground again";
        const World settled = p.kept();
        EXPECT_LT(settled.distance({0, 1.8f, 0}), 0) << engine << ": it stands on the stump";
        EXPECT_GT(settled.distance({0, 3.7f, 0}), 0);
        EXPECT_EQ(material_at(settled, {0.31f, 2.4f, 0}), "red") << engine << ": 0.4 m lower";
    }
}

TEST(Parts, ThatHaveSettledAreChangedByLaterEditsAsTheWorldIs) {
    for (const std::string& engine : engines()) {
        Played p(engine, kPillar);
        p.apply(kSlit);
        p.run(2);
        // A hole in the air, where the part comes to rest later: it is no hole of the part.
        p.apply(
            R"({"add": {"id": "air", "shape": "sphere", "radius": 0.14, "position": [0, 1.75, 0], "op": "subtract"}})");
        p.run(400);
        const World before = p.kept();
        EXPECT_LT(before.distance({0, 1.75f, 0}), 0) << engine;
        ASSERT_LT(before.distance({0, 2, 0}), -0.15f);
        // A smooth cut, a belt of blue, and all above 2.6 m gone.
        p.apply(
            R"({"add": {"id": "dent", "shape": "sphere", "radius": 0.2, "position": [0.3, 2, 0], "op": "subtract", "blend_radius": 0.1}})");
        p.apply(
            R"({"add": {"id": "blue", "shape": "box", "half_extents": [1, 0.05, 1], "position": [0, 2.3, 0], "op": "paint", "material": "blue"}})");
        p.apply(R"({"add": {"id": "top", "shape": "plane", "position": [0, 2.6, 0], "op": "intersect"}})");
        p.run(2);
        const World after = p.kept();
        const auto smooth_max = [](float a, float b, float k) {
            const float h = std::max(k - std::abs(a - b), 0.0f) / k;
            return std::max(a, b) + h * h * k / 4;
        };
        for (const vec3 at : {vec3{0.1f, 2, 0}, vec3{0.05f, 2.05f, 0.1f}, vec3{0.2f, 1.85f, 0.1f}}) {
            const float cut = length(at - vec3{0.3f, 2, 0}) - 0.2f;
            const float expected = smooth_max(before.distance(at), -cut, 0.1f);
            EXPECT_NEAR(after.distance(at), std::max(expected, at.y - 2.6f), 1e-5f) << engine;
        }
        EXPECT_EQ(material_at(after, {0.31f, 2.3f, 0}), "blue") << engine;
        EXPECT_NE(material_at(before, {0.31f, 2.3f, 0}), "blue") << engine;
        EXPECT_LT(before.distance({0, 2.7f, 0}), 0);
        EXPECT_GT(after.distance({0, 2.7f, 0}), 0.05f) << engine;
    }
}

TEST(Parts, SurviveARestartInTheJournalAndAreTakenBackInOneStep) {
    for (const std::string& engine : engines()) {
        const TempFolder folder;
        const std::string file = (folder / "s.kiln.json").string();
        std::ofstream(file) << kPillar;
        std::string start, now;
        std::vector<float> distances;
        const auto ask = [](const World& w) {
            std::vector<float> out;
            for (int i = 0; i < 60; ++i) out.push_back(w.distance({0.31f, 0.07f * float(i), 0.05f}));
            return out;
        };
        for (const int steps : {15, 400}) {  // in flight, and settled
            auto world = World::open(file);
            ASSERT_TRUE(world) << world.error().message;
            if (steps == 15) start = world->to_json();
            EXPECT_EQ(world->to_json(), start) << "what was taken back is back after a restart too";
            auto play = Play::start(*world, {.backend = engine});
            ASSERT_TRUE(play);
            ASSERT_TRUE(play->apply(kSlit));
            for (int i = 0; i < steps; ++i) ASSERT_TRUE(play->step());
            EXPECT_EQ(world->to_json(), start) << "a play leaves the world alone until it is kept";
            const auto kept = play->keep(*world);
            ASSERT_TRUE(kept) << kept.error().message;
            now = world->to_json();
            distances = ask(*world);
            EXPECT_THAT(now, testing::AllOf(HasSubstr("\"part1\""), HasSubstr("part1.cut"), HasSubstr("region:")));
            ASSERT_TRUE(world->flush());
            // Another process, which reads the journal on one thread and on three.
            for (const int workers : {1, 3}) {
                const auto again = World::load(file, workers);
                ASSERT_TRUE(again) << again.error().message;
                EXPECT_EQ(again->to_json(), now) << engine << " " << workers;
                EXPECT_EQ(ask(*again), distances) << engine << " " << workers;
            }
            const auto undone = world->history().undo();
            ASSERT_TRUE(undone && *undone);
            EXPECT_EQ(world->to_json(), start) << engine << ": one step";
            const auto redone = world->history().redo();
            ASSERT_TRUE(redone && *redone);
            EXPECT_EQ(world->to_json(), now);
            EXPECT_EQ(ask(*world), distances);
            ASSERT_TRUE(*world->history().undo());
        }
    }
}

TEST(Parts, ThatAreLooseAreNoEditsOfTheWorldForCommands) {
    for (const std::string& engine : engines()) {
        Played p(engine, kPillar);
        p.apply(kSlit);
        p.run(5);
        const auto refused = p.play.apply(R"({"remove": "part1"})", "editor");
        ASSERT_FALSE(refused);
        EXPECT_THAT(refused.error().message, HasSubstr("editor: \"part1\" is a body's"));
        p.run(1);
        EXPECT_EQ(p.shown(kPartsCamera).instances.size(), 2u) << engine;
        // Kept by a world that is not the one that was played: refused whole.
        World other = parsed(R"({"format": 1, "edits": [{"id": "slit", "shape": "sphere"}]})");
        const std::string before = other.to_json();
        EXPECT_FALSE(p.play.keep(other));
        EXPECT_EQ(other.to_json(), before);
    }
}

}  // namespace

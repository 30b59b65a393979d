// SPDX-License-Identifier: MIT
// Starts threads.
// Plays of worlds that are being edited: what stopping, keeping and the end of the program leave.
#include <kiln/world.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "simulated.h"
#include "temp_folder.h"

#include <fstream>
#include <string>

using namespace kiln;
using scene::engines;
using scene::kSlit;
using testing::HasSubstr;

namespace {

constexpr const char* kPillarAndBall = R"({"format": 1, "field": {"voxel_size": 0.05},
  "edits": [
    {"id": "ground", "shape": "plane"},
    {"id": "pillar", "shape": "box", "half_extents": [0.3, 2, 0.3], "position": [0, 1.5, 0]},
    {"id": "ball", "shape": "sphere", "radius": 0.2, "position": [5, 1, 0]}],
  "bodies": [{"id": "b", "edits": ["ball"]}]})";
class Sessions : public testing::TestWithParam<std::string> {
protected:
    void SetUp() override {
        std::ofstream(file_) << kPillarAndBall;
        auto opened = World::open(file_);
        ASSERT_TRUE(opened) << opened.error().message;
        world_ = std::move(*opened);
        // The user's own step before.
        ASSERT_TRUE(
            world_.apply(R"({"add": {"id": "mine", "shape": "sphere", "radius": 0.1, "position": [-3, 1, 0]}})"));
        begun_ = world_.to_json();
        steps_ = world_.history().steps().size();
    }
    Play begin() {
        auto play = Play::begin(world_, {.backend = GetParam()});
        EXPECT_TRUE(play) << (play ? "" : play.error().message);
        return std::move(*play);
    }
    static void run(Play& play, int steps) {
        for (int i = 0; i < steps; ++i) {
            const auto done = play.step();
            ASSERT_TRUE(done) << done.error().message;
        }
    }

    TempFolder folder_;
    std::string file_ = (folder_ / "s.kiln.json").string();
    World world_;
    std::string begun_;
    size_t steps_ = 0;
};
INSTANTIATE_TEST_SUITE_P(Engines, Sessions, testing::ValuesIn(engines()), [](const auto& i) { return i.param; });

TEST_P(Sessions, StoppingRestoresTheBeginningAndLeavesABranch) {
    Play play = begin();
    ASSERT_TRUE(play.apply(kSlit));
    run(play, 30);
    EXPECT_TRUE(world_.find_edit("slit") && world_.find_edit("part1")) << "the world is told at once";
    ASSERT_TRUE(play.stop());
    EXPECT_EQ(world_.to_json(), begun_);
    const auto steps = world_.history().steps();
    ASSERT_EQ(steps.size(), steps_ + 1);
    EXPECT_EQ(steps.back().title, "play");
    EXPECT_FALSE(steps.back().done);
    ASSERT_TRUE(world_.history().go_to(steps.back().number));
    EXPECT_TRUE(world_.find_edit("slit") && world_.find_edit("part1"));
    ASSERT_TRUE(*world_.history().undo());
    EXPECT_EQ(world_.to_json(), begun_);
    EXPECT_TRUE(play.stop()) << "again: nothing";
    EXPECT_FALSE(play.keep()) << "what has ended is not kept";
}

TEST_P(Sessions, KeepingIsOneStepWithPosesThatIsTakenBackWhole) {
    Play play = begin();
    ASSERT_TRUE(play.apply(kSlit));
    run(play, 60);
    ASSERT_TRUE(play.keep());
    EXPECT_EQ(world_.history().steps().size(), steps_ + 1);
    EXPECT_NEAR(world_.find(*world_.find_edit("ball"))->node.transform.position.y, 0.2f, 0.01f) << "where it fell to";
    EXPECT_NEAR(world_.find(*world_.find_edit("part1"))->node.transform.position.y, 2.35f, 0.05f);
    const std::string now = world_.to_json();
    const auto again = World::load(file_);
    ASSERT_TRUE(again);
    EXPECT_EQ(again->to_json(), now) << "it is in the journal";
    ASSERT_TRUE(*world_.history().undo());
    EXPECT_EQ(world_.to_json(), begun_);
}

TEST_P(Sessions, AProgramThatEndsInPlayLeavesTheBeginningAndWhatWasDone) {
    Play play = begin();
    run(play, 5);
    {
        const auto untouched = World::load(file_);
        ASSERT_TRUE(untouched);
        EXPECT_EQ(untouched->to_json(), begun_) << "nothing was done yet";
    }
    ASSERT_TRUE(play.apply(kSlit));
    ASSERT_TRUE(play.apply(R"({"add": {"id": "late", "shape": "sphere", "radius": 0.3, "position": [-3, 2, 0]}})"));
    run(play, 30);
    // What another program reads while this one has neither stopped nor kept: all that a kill would leave.
    for (const int workers : {1, 3}) {
        const auto left = World::load(file_, workers);
        ASSERT_TRUE(left) << left.error().message;
        for (const char* id : {"mine", "slit", "late", "part1"}) EXPECT_TRUE(left->find_edit(id)) << id;
        EXPECT_EQ(left->find(*left->find_edit("ball"))->node.transform.position, (vec3{5, 1, 0}))
            << "bodies begin anew";
    }
}

TEST_P(Sessions, APlayThatIsLetGoIsStopped) {
    {
        Play play = begin();
        ASSERT_TRUE(play.apply(kSlit));
        run(play, 10);
    }
    EXPECT_EQ(world_.to_json(), begun_);
    // Nothing done, nothing to take back.
    {
        Play idle = begin();
        run(idle, 3);
    }
    EXPECT_EQ(world_.history().steps().size(), steps_ + 1);
}

}  // namespace

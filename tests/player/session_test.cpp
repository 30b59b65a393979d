// SPDX-License-Identifier: MIT
// A world that is played and dug at once: a block on a pillar.
#include "player/session.h"
#include "temp_folder.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace kiln::player {
namespace {

constexpr const char* kPillar = R"({"format": 1, "field": {"voxel_size": 0.1},
  "edits": [{"id": "ground", "shape": "plane"},
            {"id": "pillar", "shape": "box", "half_extents": [0.2, 1, 0.2], "position": [0, 1, 0]},
            {"id": "block", "shape": "box", "half_extents": [0.5, 0.3, 0.5], "position": [0, 2.2, 0]}],
  "cameras": {"main": {"position": [0, 1, 6], "target": [0, 1, 0]}}})";
constexpr vec3 kMiddle{0, 1, 0};  // of the pillar

class SessionOnAPillar : public testing::Test {
protected:
    SessionOnAPillar() : file_((folder_ / "pillar.kiln.json").string()) {
        std::ofstream(file_, std::ios::binary) << kPillar;
        open();
    }
    void open() {
        session_.reset();
        auto made = Session::open(file_, "");
        ASSERT_TRUE(made) << made.error().message;
        session_ = std::move(*made);
    }
    void ok(const Result<void>& done) { ASSERT_TRUE(done) << done.error().message; }
    void run(int steps) {
        for (int i = 0; i < steps; ++i) ok(session_->step());
    }
    void stroke(vec3 at = kMiddle) {
        session_->begin_stroke("dig");
        ok(session_->dig(at, 0.4f, false));
        ok(session_->dig(at + vec3{0.1f, 0, 0}, 0.4f, false));
        ok(session_->end_stroke());
    }

    const TempFolder folder_;
    std::string file_;
    std::unique_ptr<Session> session_;
};

TEST_F(SessionOnAPillar, WhatIsCutOffFallsAndUndoPutsTheWorldBack) {
    const uint64_t before = session_->world_hash();
    run(5);
    EXPECT_EQ(session_->counts().bodies, 0);
    stroke();
    EXPECT_EQ(session_->undo_depth(), 1);
    EXPECT_EQ(session_->world().edits().size(), 5u);
    run(20);
    EXPECT_EQ(session_->counts().parts, 1);
    EXPECT_EQ(session_->counts().bodies, 1);
    const uint64_t dug = session_->world_hash();
    EXPECT_NE(dug, before);

    auto undone = session_->undo();
    ASSERT_TRUE(undone && *undone);
    EXPECT_EQ(session_->world_hash(), before);
    EXPECT_EQ(session_->undo_depth(), 0);
    EXPECT_EQ(session_->behind(), 25);
    ok(session_->advance(0, 1e9));
    EXPECT_EQ(session_->steps(), 25);
    EXPECT_EQ(session_->counts().bodies, 0);
    ASSERT_TRUE(session_->undo());
    EXPECT_FALSE(*session_->undo());

    auto redone = session_->redo();
    ASSERT_TRUE(redone && *redone);
    EXPECT_EQ(session_->world_hash(), dug);
    ok(session_->advance(0, 1e9));
    run(1);
    EXPECT_EQ(session_->counts().bodies, 1);
    EXPECT_FALSE(*session_->redo());
}

TEST_F(SessionOnAPillar, APlayThatIsRunAgainIsWhereItWas) {
    run(3);
    stroke();
    run(12);
    const auto drop = [&] { return session_->play().cast({.origin = {0, 10, 0}, .direction = {0, -1, 0}})->t; };
    (void)session_->play().frame(Camera{});
    const float before = drop();
    run(1);
    (void)session_->play().frame(Camera{});
    EXPECT_NE(drop(), before);  // it falls
    const float now = drop();
    Edit ball;
    ball.node.shape = Sphere{.radius = 0.2f};
    ball.node.transform.position = {3, 3, 0};
    ok(session_->launch(ball, {}));
    run(1);
    ASSERT_TRUE(*session_->undo());
    EXPECT_EQ(session_->behind(), 17);
    while (session_->behind() > 0) run(1);
    EXPECT_EQ(session_->steps(), 17);
    EXPECT_EQ(session_->counts().parts, 1);
    (void)session_->play().frame(Camera{});
    const float later = drop();
    EXPECT_GT(later, now);
    // The same play, never interrupted.
    const std::unique_ptr<Session> interrupted = std::move(session_);
    std::filesystem::rename(file_, file_ + ".other");
    std::ofstream(file_, std::ios::binary) << kPillar;
    std::filesystem::remove(file_ + ".journal");
    open();
    run(3);
    stroke();
    run(14);
    (void)session_->play().frame(Camera{});
    EXPECT_EQ(drop(), later);
}

TEST_F(SessionOnAPillar, AStrokeThatCutsNothingLooseIsFilledInWhereTheBodiesAre) {
    run(3);
    const uint64_t before = session_->world_hash();
    stroke({3, 0, 3});
    run(2);
    const auto depth = [&] {
        (void)session_->play().frame(Camera{});
        return session_->play().cast({.origin = {3, 5, 3}, .direction = {0, -1, 0}})->t;
    };
    EXPECT_NEAR(depth(), 5.4f, 0.05f);
    ASSERT_TRUE(*session_->undo());
    EXPECT_EQ(session_->behind(), 0);
    EXPECT_EQ(session_->world_hash(), before);
    EXPECT_NEAR(depth(), 5, 1e-3f);
    ASSERT_TRUE(*session_->redo());
    run(1);
    EXPECT_NEAR(depth(), 5.4f, 0.05f);
    EXPECT_EQ(session_->undo_depth(), 1);
}

TEST_F(SessionOnAPillar, RestartBeginsWithTheGroundAsItWasLeft) {
    run(10);
    stroke();
    run(10);
    ok(session_->restart());
    EXPECT_EQ(session_->steps(), 0);
    run(1);
    EXPECT_EQ(session_->counts().parts, 1);  // cut before the first step
    ASSERT_TRUE(*session_->undo());
    run(1);
    EXPECT_EQ(session_->counts().parts, 0);
}

TEST_F(SessionOnAPillar, ABallIsABodyThatUndoTakesBack) {
    Edit ball;
    ball.node.shape = Sphere{.radius = 0.2f};
    ball.node.transform.position = {2, 3, 0};
    const uint64_t before = session_->world_hash();
    ok(session_->launch(ball, {0, 5, 0}));
    EXPECT_EQ(session_->counts().bodies, 1);
    EXPECT_EQ(session_->undo_depth(), 1);
    EXPECT_EQ(session_->world_hash(), before);
    run(10);
    (void)session_->play().frame(Camera{});
    const auto hit = session_->play().cast({.origin = {2, 10, 0}, .direction = {0, -1, 0}});
    ASSERT_TRUE(hit && hit->hit);
    const float t = 10 * (1 / 60.0f), expected = 3 + 5 * t - 9.81f * t * t / 2 + 0.2f;
    EXPECT_NEAR(hit->position.y, expected, 0.02f);
    ASSERT_TRUE(*session_->undo());
    ok(session_->advance(0, 1e9));
    EXPECT_EQ(session_->counts().bodies, 0);
}

TEST_F(SessionOnAPillar, ABallThatIsNoBallIsRefusedAndNothingStays) {
    Edit plane;
    plane.node.shape = Plane{};
    EXPECT_FALSE(session_->launch(plane, {}));
    Edit ball;
    ball.node.shape = Sphere{.radius = -1};
    EXPECT_FALSE(session_->launch(ball, {}));
    ball.node.shape = Sphere{.radius = 1};
    EXPECT_FALSE(session_->launch(ball, {0, std::numeric_limits<float>::quiet_NaN(), 0}));
    EXPECT_EQ(session_->counts().bodies, 0);
    EXPECT_EQ(session_->undo_depth(), 0);
    run(2);
}

TEST_F(SessionOnAPillar, AStrokeAtABodyCutsItInThePlayAloneUntilItIsKept) {
    Edit bar;
    bar.node.shape = Box{.half_extents = {1, 0.2f, 0.2f}};
    bar.node.transform.position = {4, 0.2f, 0};
    ok(session_->launch(bar, {}));
    run(10);
    (void)session_->play().frame(Camera{});
    const auto above = [&](float x) {
        auto met = session_->play().pick({.origin = {x, 4, 0}, .direction = {0, -1, 0}});
        EXPECT_TRUE(met && met->hit.hit);
        return *met;
    };
    const PlayHit there = above(4);
    EXPECT_EQ(there.body, "thrown1");
    EXPECT_NEAR(there.hit.t, 3.6f, 0.02f);
    EXPECT_EQ(above(8).body, "") << "the ground";
    const uint64_t before = session_->world_hash();
    session_->begin_stroke("dig");
    ok(session_->dig(there.hit.position - vec3{0, 0.2f, 0}, 0.4f, false, there.body));
    ok(session_->end_stroke());
    EXPECT_EQ(session_->world_hash(), before) << "the ground is whole";
    run(1);
    EXPECT_EQ(session_->counts().bodies, 2) << "it was cut in two";
    (void)session_->play().frame(Camera{});
    EXPECT_NEAR(above(4).hit.t, 4, 0.02f) << "nothing is in between, and the ground is not dug";
    EXPECT_NE(above(3.3f).body, above(4.7f).body);
    // Kept: two bodies of the world.
    ok(session_->keep());
    EXPECT_TRUE(session_->world().find_edit("part1"));
    EXPECT_TRUE(session_->world().find_edit("thrown1"));
    ASSERT_TRUE(*session_->undo());
    // Undone, the bar is whole again, where it was.
    ASSERT_TRUE(*session_->undo());
    ok(session_->advance(0, 1e9));
    EXPECT_EQ(session_->counts().bodies, 1);
    EXPECT_EQ(session_->steps(), 11);
    (void)session_->play().frame(Camera{});
    EXPECT_NEAR(above(4).hit.t, 3.6f, 0.02f);
    ASSERT_TRUE(*session_->redo());
    run(1);
    EXPECT_EQ(session_->counts().bodies, 2);
    // The body that it cut never came: a stroke without an aim is none, and the play goes on.
    ASSERT_TRUE(*session_->undo());
    ASSERT_TRUE(*session_->undo());
    ok(session_->advance(0, 1e9));
    EXPECT_EQ(session_->counts().bodies, 0);
}

TEST_F(SessionOnAPillar, WhoeverWalksDoesSoAgainWhenThePlayIsRunAgain) {
    EXPECT_FALSE(session_->walker());
    session_->walk({1, 0, 0}, 3);  // nobody is there
    ok(session_->enter({3, 0.01f, 0}));
    run(2);
    ASSERT_TRUE(session_->walker());
    EXPECT_TRUE(session_->walker()->on_floor);
    session_->walk({2, 5, 0}, 0);
    run(30);
    EXPECT_NEAR(session_->walker()->feet.x, 4, 0.01f);
    EXPECT_NEAR(session_->walker()->feet.y, 0, 0.02f);
    session_->walk({2, 0, 0}, 3);
    run(10);
    EXPECT_GT(session_->walker()->feet.y, 0.25f) << "it jumps";
    session_->walk({0, 0, -1}, 0);
    run(50);
    EXPECT_TRUE(session_->walker()->on_floor);
    // Dug away below, it falls.
    session_->begin_stroke("dig");
    ok(session_->dig(session_->walker()->feet, 0.8f, false));
    ok(session_->end_stroke());
    run(20);
    EXPECT_LT(session_->walker()->feet.y, -0.3f);
    // A throw that is undone runs all of it again.
    Edit ball;
    ball.node.shape = Sphere{.radius = 0.2f};
    ball.node.transform.position = {30, 3, 0};
    ok(session_->launch(ball, {}));
    run(3);
    ok(session_->advance(0, 1e9));
    const vec3 feet = session_->walker()->feet;
    ASSERT_TRUE(*session_->undo());
    session_->walk({9, 0, 0}, 0);  // not while it is run again
    ok(session_->advance(0, 1e9));
    ASSERT_TRUE(session_->walker());
    EXPECT_EQ(session_->walker()->feet, feet) << "bit for bit";
    ok(session_->restart());
    ASSERT_TRUE(session_->walker());
    EXPECT_NEAR(session_->walker()->feet.x, feet.x, 1e-6f) << "where it was";
    ok(session_->leave());
    EXPECT_FALSE(session_->walker());
    run(1);
}

// What a throw or an undo makes of the picture's field is what differs, not all of it.
TEST_F(SessionOnAPillar, AThrowAndItsUndoKeepTheField) {
    const auto bricks = [&] {
        auto frame = session_->play().frame(Camera{});
        EXPECT_TRUE(frame) << (frame ? "" : frame.error().message);
        return frame->field;
    };
    const auto first = bricks();
    Edit ball;
    ball.node.shape = Sphere{.radius = 0.2f};
    ball.node.transform.position = {60, 40, 0};  // far beyond what the field covers
    ok(session_->launch(ball, {1, 0, 0}));
    run(5);
    EXPECT_EQ(bricks(), first);
    stroke();
    run(5);
    const auto dug = bricks();
    EXPECT_NE(dug, first);
    ASSERT_TRUE(*session_->undo());
    ok(session_->advance(0, 1e9));
    const auto undone = bricks();
    ASSERT_TRUE(*session_->undo());
    ok(session_->advance(0, 1e9));
    EXPECT_EQ(bricks(), undone) << "run again without the ball, the field is what it was";
}

TEST_F(SessionOnAPillar, KeepMakesTheWorldWhatThePlayIsAndUndoGoesBackToTheDigs) {
    run(2);
    stroke();
    run(200);
    const uint64_t dug = session_->world_hash();
    ok(session_->keep());
    EXPECT_NE(session_->world_hash(), dug);
    EXPECT_TRUE(session_->world().find_edit("part1"));
    const uint64_t kept = session_->world_hash();
    ok(session_->keep());  // once more, of the same
    EXPECT_EQ(session_->world_hash(), kept);
    ASSERT_TRUE(*session_->undo() && *session_->undo());
    EXPECT_EQ(session_->world_hash(), dug);
    ASSERT_TRUE(*session_->redo());
    EXPECT_EQ(session_->world_hash(), kept);
    EXPECT_EQ(session_->behind(), 0);
}

TEST_F(SessionOnAPillar, WhatIsNotSavedIsInTheJournalAndSaidSo) {
    EXPECT_EQ(session_->farewell(), "");
    stroke();
    EXPECT_TRUE(session_->dirty());
    EXPECT_NE(session_->farewell().find("journal"), std::string::npos);
    const uint64_t dug = session_->world_hash();
    open();
    EXPECT_NE(session_->note(), "");
    EXPECT_EQ(session_->world_hash(), dug);
    stroke({0.05f, 1, 0});
    const auto saved = session_->save();
    ASSERT_TRUE(saved) << saved.error().message;
    EXPECT_EQ(*saved, file_);
    EXPECT_EQ(session_->farewell(), "");
    const uint64_t all = session_->world_hash();
    open();
    EXPECT_EQ(session_->note(), "");
    EXPECT_EQ(session_->world_hash(), all);
}

// What another program writes: a wall instead of the pillar and its block.
constexpr const char* kWall = R"({"format": 1, "field": {"voxel_size": 0.1},
  "edits": [{"id": "ground", "shape": "plane"},
            {"id": "wall", "shape": "box", "half_extents": [2, 1, 0.2], "position": [0, 1, 0]}]})";

TEST_F(SessionOnAPillar, AFileThatAnotherProgramWroteIsLoadedAgainAndThePlayBeginsAnew) {
    const uint64_t before = session_->world_hash();
    run(5);
    ok(session_->enter({3, 0.01f, 3}));
    stroke();
    ASSERT_TRUE(*session_->undo()) << "what is undone is no change that could be lost";
    ok(session_->advance(0, 1e9));
    EXPECT_FALSE(session_->dirty());
    write_bytes(file_, kPillar);
    EXPECT_FALSE(session_->look_at_files()) << "the same text, written again";
    EXPECT_EQ(session_->undo_depth(), 0);
    EXPECT_EQ(session_->steps(), 5);
    write_bytes(file_, kWall);
    ASSERT_TRUE(session_->look_at_files()) << session_->warning();
    EXPECT_FALSE(session_->look_at_files()) << "once";
    EXPECT_TRUE(session_->world().find_edit("wall"));
    EXPECT_FALSE(session_->world().find_edit("pillar"));
    EXPECT_EQ(session_->steps(), 0);
    EXPECT_FALSE(session_->dirty());
    EXPECT_EQ(session_->warning(), "");
    EXPECT_EQ(session_->farewell(), "");
    run(3);
    ASSERT_TRUE(session_->walker());
    EXPECT_NEAR(session_->walker()->feet.x, 3, 0.01f) << "who walks is still there";
    (void)session_->play().frame(Camera{});
    EXPECT_TRUE(session_->play().cast({.origin = {1.5f, 1, 5}, .direction = {0, 0, -1}})->hit) << "the play has it too";
    // It is edited as any other.
    stroke({1, 1, 0});
    const uint64_t dug = session_->world_hash();
    open();
    EXPECT_EQ(session_->world_hash(), dug) << "the journal has it";
    EXPECT_TRUE(session_->dirty()) << "and the file has not";
    ASSERT_TRUE(session_->save());
    EXPECT_FALSE(session_->look_at_files()) << "what is written here is no other program's";
    open();
    EXPECT_EQ(session_->world_hash(), dug);
    EXPECT_FALSE(session_->dirty());
    EXPECT_NE(dug, before);
}

TEST_F(SessionOnAPillar, AHalfWrittenFileIsOneErrorAndChangesNothing) {
    const uint64_t before = session_->world_hash();
    run(4);
    const std::string wall = kWall;
    for (const size_t length : {size_t{0}, wall.size() / 2, wall.size() - 1}) {
        write_bytes(file_, wall.substr(0, length));
        for (int i = 0; i < 2; ++i) {
            EXPECT_FALSE(session_->look_at_files());
            EXPECT_TRUE(session_->warning().starts_with(file_ + ":")) << session_->warning();
            EXPECT_EQ(session_->warning().find('\n'), std::string::npos);
        }
    }
    EXPECT_EQ(session_->world_hash(), before);
    EXPECT_EQ(session_->steps(), 4);
    run(1);
    // What cannot be played is no better than what cannot be read.
    write_bytes(file_, R"({"format": 1, "edits": [{"id": "ground", "shape": "plane"}],
        "bodies": [{"id": "b", "edits": ["ground"]}]})");
    EXPECT_FALSE(session_->look_at_files());
    EXPECT_NE(session_->warning().find("a body without end"), std::string::npos) << session_->warning();
    EXPECT_EQ(session_->world_hash(), before);
    write_bytes(file_, wall);
    EXPECT_TRUE(session_->look_at_files());
    EXPECT_EQ(session_->warning(), "");
    EXPECT_TRUE(session_->world().find_edit("wall"));
}

TEST_F(SessionOnAPillar, WhereBothHaveChangedNeitherIsLost) {
    const auto other = (folder_ / "pillar.other.kiln.json").string();
    stroke();
    const uint64_t dug = session_->world_hash();
    write_bytes(file_, kWall);
    EXPECT_FALSE(session_->look_at_files());
    EXPECT_NE(session_->warning().find("changed by another program"), std::string::npos) << session_->warning();
    EXPECT_EQ(session_->world_hash(), dug);
    EXPECT_EQ(bytes_of(file_), kWall);
    auto saved = session_->save();
    ASSERT_TRUE(saved) << saved.error().message;
    EXPECT_NE(saved->find(other), std::string::npos) << *saved;
    EXPECT_EQ(bytes_of(other), kWall);
    EXPECT_EQ(session_->warning(), "");
    EXPECT_EQ(session_->farewell(), "");
    open();
    EXPECT_EQ(session_->world_hash(), dug);
    EXPECT_EQ(session_->note(), "");
    // Saved before anyone has looked, and a name that is taken.
    stroke({0.05f, 1, 0});
    write_bytes(file_, kPillar);
    ASSERT_TRUE(session_->save());
    EXPECT_EQ(bytes_of(other), kWall);
    EXPECT_EQ(bytes_of(folder_ / "pillar.other-2.kiln.json"), kPillar);
    // Whoever takes all of theirs back gets the other's.
    stroke({-0.05f, 1, 0});
    write_bytes(file_, kWall);
    EXPECT_FALSE(session_->look_at_files());
    ASSERT_TRUE(*session_->undo());
    EXPECT_TRUE(session_->look_at_files());
    EXPECT_TRUE(session_->world().find_edit("wall"));
}

TEST_F(SessionOnAPillar, ChangesThatTheNextStartWouldNotFindAreLeftBesideTheScene) {
    const std::string mine = (folder_ / "pillar.unsaved.kiln.json").string();
    for (const bool gone : {false, true}) {
        stroke();
        const uint64_t dug = session_->world_hash();
        if (gone)
            std::filesystem::remove(file_);
        else
            write_bytes(file_, kWall);
        EXPECT_FALSE(session_->look_at_files());
        EXPECT_NE(session_->warning().find(gone ? "is gone" : "changed by another"), std::string::npos);
        const std::string farewell = session_->farewell();
        EXPECT_NE(farewell.find(mine), std::string::npos) << farewell;
        EXPECT_EQ(farewell.find("goes on from there"), std::string::npos) << farewell;
        session_.reset();
        const auto kept = Session::open(mine, "");
        ASSERT_TRUE(kept) << kept.error().message;
        EXPECT_EQ((*kept)->world_hash(), dug);
        if (gone) break;
        open();
        EXPECT_TRUE(session_->world().find_edit("wall")) << "as it was said";
        std::filesystem::remove(mine);
    }
}

TEST_F(SessionOnAPillar, WhatAnEarlierStartLeftInTheJournalIsNotLostToAnotherProgram) {
    stroke();
    const uint64_t dug = session_->world_hash();
    open();
    write_bytes(file_, kWall);
    EXPECT_FALSE(session_->look_at_files());
    EXPECT_EQ(session_->world_hash(), dug);
    EXPECT_NE(session_->farewell().find("pillar.unsaved.kiln.json"), std::string::npos);
}

// A cube of 1 m, or one that is twice as high.
std::string cube(int height) {
    std::string out;
    for (int i = 0; i < 8; ++i)
        out += "v " + std::to_string(i & 1) + " " + std::to_string((i >> 1 & 1) * height) + " " +
               std::to_string(i >> 2) + "\n";
    return out + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
}

TEST_F(SessionOnAPillar, AModelThatAnotherProgramWroteIsSeenWithItsScene) {
    const std::string model = (folder_ / "cube.obj").string();
    const auto high = [&] { return session_->play().cast({.origin = {0.5f, 1.5f, 5}, .direction = {0, 0, -1}})->hit; };
    write_bytes(model, cube(1));
    write_bytes(file_, R"({"format": 1, "field": {"voxel_size": 0.1}, "edits": [{"id": "ground", "shape": "plane"},
        {"id": "cube", "shape": "mesh", "file": "cube.obj", "resolution": 16}]})");
    open();
    run(2);
    EXPECT_FALSE(high());
    EXPECT_FALSE(session_->look_at_files());
    write_bytes(model, cube(2));
    ASSERT_TRUE(session_->look_at_files()) << session_->warning();
    EXPECT_EQ(session_->changed(), model);
    EXPECT_FALSE(session_->look_at_files()) << "once";
    EXPECT_EQ(session_->warning(), "");
    run(1);
    EXPECT_TRUE(high());
    // What is not whole is not shown, and said as long as it is so.
    write_bytes(model, "v 0 0\n");
    for (int i = 0; i < 2; ++i) {
        EXPECT_FALSE(session_->look_at_files());
        EXPECT_NE(session_->warning().find("cube.obj"), std::string::npos) << session_->warning();
    }
    // Nor is it forgotten for what is wrong with the scene meanwhile.
    const std::string scene = bytes_of(file_);
    write_bytes(file_, "{");
    EXPECT_FALSE(session_->look_at_files());
    EXPECT_EQ(session_->warning().find("cube.obj"), std::string::npos) << session_->warning();
    write_bytes(file_, scene);
    EXPECT_FALSE(session_->look_at_files());
    EXPECT_NE(session_->warning().find("cube.obj"), std::string::npos) << session_->warning();
    EXPECT_TRUE(high());
    std::filesystem::remove(model);
    EXPECT_FALSE(session_->look_at_files());
    EXPECT_NE(session_->warning().find("cube.obj is gone"), std::string::npos) << session_->warning();
    write_bytes(model, cube(2));
    EXPECT_FALSE(session_->look_at_files());
    EXPECT_EQ(session_->warning(), "");
    // With changes of our own it waits for them.
    stroke({3, 0, 0});
    write_bytes(model, cube(1));
    EXPECT_FALSE(session_->look_at_files());
    EXPECT_NE(session_->warning().find("your changes are not saved"), std::string::npos) << session_->warning();
    EXPECT_TRUE(high());
    ASSERT_TRUE(session_->save());
    ASSERT_TRUE(session_->look_at_files()) << session_->warning();
    run(1);
    EXPECT_FALSE(high());
    EXPECT_EQ(session_->world().edits().size(), 4u) << "ours and theirs";
}

TEST_F(SessionOnAPillar, ABundledSceneIsSavedBesideNothing) {
    const std::filesystem::path here = std::filesystem::current_path();
    std::filesystem::current_path(folder_.path());
    auto made = Session::open("tumble", "");
    ASSERT_TRUE(made) << made.error().message;
    (*made)->begin_stroke("dig");
    ok((*made)->dig({0, 0, 0}, 0.3f, false));
    EXPECT_NE((*made)->farewell().find("Ctrl+S"), std::string::npos);
    EXPECT_TRUE((*made)->save());
    EXPECT_TRUE(std::filesystem::exists("tumble.kiln.json"));
    auto other = Session::open("tumble", "");
    ASSERT_TRUE(other);
    const auto refused = (*other)->save();
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("is there already"), std::string::npos);
    // From then on the file is its own.
    write_bytes("tumble.kiln.json", kWall);
    EXPECT_TRUE((*made)->look_at_files());
    EXPECT_TRUE((*made)->world().find_edit("wall"));
    std::filesystem::current_path(here);
}

TEST_F(SessionOnAPillar, AFileThatAnotherProgramEditsIsPlayedAndNotWrittenOver) {
    auto other = Session::open(file_, "");
    ASSERT_TRUE(other) << other.error().message;
    EXPECT_NE((*other)->note().find("kept only by saving"), std::string::npos) << (*other)->note();
    (*other)->begin_stroke("dig");
    ok((*other)->dig(kMiddle, 0.3f, false));
    EXPECT_FALSE((*other)->save());
    EXPECT_NE((*other)->farewell(), "");
}

TEST(Session, BadScenesAreNamed) {
    const auto nothing = Session::open("/nonexistent/scene.kiln.json", "");
    ASSERT_FALSE(nothing);
    EXPECT_EQ(nothing.error().kind, ErrorKind::Input);
}

}  // namespace
}  // namespace kiln::player

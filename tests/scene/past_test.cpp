// SPDX-License-Identifier: MIT
// Starts threads.
// Undo beyond saves, in the program that saved and in later ones.
#include "scene/past.h"

#include "kept_scene.h"
#include "random_changes.h"
#include "temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace kiln {
namespace {

namespace fs = std::filesystem;
using scene::RandomChanges;
using testing::HasSubstr;

class Pasts : public testing::Test {
protected:
    void SetUp() override { write_bytes(scene_, kScene); }
    World open() {
        auto world = World::open(scene_, 1);
        EXPECT_TRUE(world) << world.error().message;
        return world ? std::move(*world) : World();
    }
    // Every state that a world's history can reach.
    static std::set<std::string> states_of(World& world) {
        std::set<std::string> out;
        History history = world.history();
        const uint32_t now = history.now();
        for (uint32_t step = 0; step <= history.steps().size(); ++step) {
            EXPECT_TRUE(history.go_to(step));
            out.insert(world.to_json());
        }
        EXPECT_TRUE(history.go_to(now));
        return out;
    }

    const TempFolder folder_;
    const fs::path scene_ = folder_ / "s.kiln.json", journal_ = folder_ / "s.kiln.json.journal",
                   history_ = folder_ / "s.kiln.json.history";
};

TEST_F(Pasts, EveryStateOfTheWorldCanBeReachedAfterAnyNumberOfSavesAndPrograms) {
    std::set<std::string> seen;
    RandomChanges random(8);
    for (int program = 0; program < 6; ++program) {
        World world = open();
        random.look(world);
        History history = world.history();
        seen.insert(world.to_json());
        for (int i = 0; i < 25; ++i) {
            const int what = random.below(12);
            if (what == 0) {
                ASSERT_TRUE(world.save(scene_));
            } else if (what == 1) {
                ASSERT_TRUE(history.undo());
                random.look(world);
            } else if (what == 2) {
                ASSERT_TRUE(history.redo());
                random.look(world);
            } else if (what == 3) {
                ASSERT_TRUE(history.go_to(uint32_t(random.below(int(history.steps().size()) + 1))));
                random.look(world);
            } else if (what == 4) {
                history.begin_group("stroke");
                for (int k = 0; k < 3; ++k) (void)random.one(world);
                ASSERT_TRUE(history.end_group());
            } else {
                (void)random.one(world);
            }
            seen.insert(world.to_json());
        }
        if (program % 2 == 0) {
            ASSERT_TRUE(world.save(scene_));
        }
    }
    World world = open();
    const std::set<std::string> states = states_of(world);
    // A state may be written another way than it was: as the file that was saved last writes what it has.
    std::vector<World> worlds;
    for (const std::string& state : states) worlds.push_back(std::move(*World::parse(state, "s.json")));
    for (const std::string& state : seen) {
        if (states.contains(state)) continue;
        const auto was = World::parse(state, "s.json");
        EXPECT_TRUE(std::any_of(worlds.begin(), worlds.end(), [&](const World& w) {
            return compare_scenes(w, *was).equal;
        })) << state;
    }
    EXPECT_EQ(World::load(scene_)->to_json(), world.to_json()) << "with its past it is what it is without";
}

TEST_F(Pasts, UndoAndRedoGoOnAcrossASaveAndAnotherProgram) {
    std::string second, third;
    {
        World world = open();
        ASSERT_TRUE(world.remove(*world.find_edit("a")));
        second = world.to_json();
        ASSERT_TRUE(world.add(ball("c", 1)));
        third = world.to_json();
        ASSERT_TRUE(world.save(scene_));
        ASSERT_TRUE(world.add(ball("d", 1)));
    }
    World world = open();
    History history = world.history();
    ASSERT_EQ(history.steps().size(), 3u);
    EXPECT_EQ(history.now(), 3u);
    ASSERT_TRUE(*history.undo());
    EXPECT_EQ(world.to_json(), third);
    ASSERT_TRUE(*history.undo());
    EXPECT_EQ(world.to_json(), second);
    ASSERT_TRUE(*history.undo());
    EXPECT_EQ(world.find(*world.find_edit("a"))->outline->width_px, 5);
    EXPECT_FALSE(*history.undo());
    EXPECT_EQ(World::load(scene_)->to_json(), world.to_json()) << "what was undone is in the journal";
    ASSERT_TRUE(*history.redo() && *history.redo());
    EXPECT_EQ(world.to_json(), third);
    const std::string told = World::load(scene_, 1, true)->history_json();
    EXPECT_THAT(told, HasSubstr("remove a"));
    EXPECT_THAT(told, HasSubstr("add c"));
    EXPECT_THAT(World::load(scene_)->history_json(), testing::Not(HasSubstr("\"add c\"")));
}

// What a kill while saving may leave.
TEST_F(Pasts, AKillAtAnyPointOfSavingLosesNoState) {
    World world = open();
    ASSERT_TRUE(world.add(ball("c", 1)));
    ASSERT_TRUE(world.save(scene_));
    ASSERT_TRUE(world.add(ball("d", 1)));
    const std::string scene_before = bytes_of(scene_), journal_before = bytes_of(journal_),
                      past_before = bytes_of(history_);
    ASSERT_TRUE(world.save(scene_));
    const std::string scene_after = bytes_of(scene_), journal_after = bytes_of(journal_),
                      past_after = bytes_of(history_);
    world = World();
    ASSERT_GT(past_after.size(), past_before.size());
    std::string marked;
    {
        write_bytes(journal_, journal_before);
        std::string bytes;
        auto file = RecordFile::open(journal_, bytes);
        const auto hash = hash128(std::as_bytes(std::span(scene_after.data(), scene_after.size())));
        ASSERT_TRUE(file && file->resume(read_records(bytes)) && file->append(scene::saved_record(hash)));
        marked = bytes_of(journal_);
    }
    const auto check = [&](const std::string& scene, const std::string& journal, const std::string& past) {
        write_bytes(scene_, scene);
        write_bytes(journal_, journal);
        write_bytes(history_, past);
        for (int program = 0; program < 2; ++program) {
            World again = open();
            EXPECT_EQ(again.edits().size(), size_t(4 + program));
            const uint32_t now = again.history().now();
            ASSERT_TRUE(again.history().go_to(0));
            EXPECT_EQ(again.edits().size(), 2u);
            EXPECT_FALSE(again.find_edit("c"));
            ASSERT_TRUE(again.history().go_to(now));
            EXPECT_TRUE(again.find_edit("d"));
            ASSERT_TRUE(again.add(ball("z" + std::to_string(program), 1)) && again.save(scene_));
        }
    };
    check(scene_before, marked, past_before);
    for (size_t n = past_before.size(); n < past_after.size(); n += 7)
        check(scene_before, marked, past_after.substr(0, n));  // while the past was being written
    check(scene_before, marked, past_after);                   // written, not renamed
    check(scene_after, marked, past_after);                    // renamed, not emptied
    check(scene_after, "", past_after);
    check(scene_after, journal_after, past_after);
}

TEST_F(Pasts, ADamagedOrForeignOneIsLeftOutAndBegunAnew) {
    std::string text;
    {
        World world = open();
        ASSERT_TRUE(world.add(ball("c", 1)));
        ASSERT_TRUE(world.save(scene_));
        ASSERT_TRUE(world.add(ball("d", 1)));
        text = world.to_json();
    }
    const std::string scene = bytes_of(scene_), journal = bytes_of(journal_), past = bytes_of(history_);
    for (size_t at = 0; at < past.size(); at += 11) {
        std::string broken = past;
        broken[at] = char(uint8_t(broken[at]) ^ uint8_t(1u << (at % 8)));
        write_bytes(history_, broken);
        const auto read = World::load(scene_, 1, true);
        ASSERT_TRUE(read) << at;
        ASSERT_EQ(read->to_json(), text) << at;
    }
    write_bytes(history_, past.substr(0, past.size() / 2));
    {
        World world = open();
        EXPECT_EQ(world.to_json(), text);
        EXPECT_EQ(world.history().steps().size(), 1u);
        ASSERT_TRUE(world.save(scene_));
    }
    World world = open();
    EXPECT_EQ(world.history().steps().size(), 1u) << "it goes back to the save before";
    // Of another scene.
    ASSERT_TRUE(world.save(scene_));
    world = World();
    const std::string other = "{\"format\": 1, \"edits\": [{\"id\": \"only\", \"shape\": \"sphere\"}]}";
    write_bytes(scene_, other);
    world = open();
    EXPECT_EQ(world.edits().size(), 1u);
    EXPECT_TRUE(world.history().steps().empty());
    ASSERT_TRUE(world.add(ball("e", 1)) && world.save(scene_));
    world = World();
    world = open();
    EXPECT_EQ(world.history().steps().size(), 1u);
}

// Where the scene file cannot be replaced, what the past has taken in is not taken in again.
TEST_F(Pasts, ASaveThatFailsAndOneThatDoesNotKeepEveryStepOnce) {
    {
        World world = open();
        ASSERT_TRUE(world.add(ball("c", 1)) && world.save(scene_));
        const std::string scene = bytes_of(scene_);
        fs::remove(scene_);
        fs::create_directory(scene_);
        for (const char* name : {"d", "e"}) {
            ASSERT_TRUE(world.add(ball(name, 1)));
            ASSERT_FALSE(world.save(scene_));
        }
        fs::remove(scene_);
        write_bytes(scene_, scene);
        ASSERT_TRUE(world.add(ball("f", 1)));
        ASSERT_TRUE(world.save(scene_));
    }
    World world = open();
    EXPECT_EQ(world.edits().size(), 6u);
    ASSERT_EQ(world.history().steps().size(), 4u);
    for (const uint32_t step : {0u, 4u, 2u, 1u, 3u}) {
        ASSERT_TRUE(world.history().go_to(step));
        EXPECT_EQ(world.edits().size(), 2u + step);
    }
}

TEST_F(Pasts, AWorldThatWasNeverChangedLeavesNoFile) {
    { World world = open(); }
    EXPECT_FALSE(fs::exists(history_));
    EXPECT_FALSE(fs::exists(journal_));
}

}  // namespace
}  // namespace kiln

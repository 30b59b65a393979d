// SPDX-License-Identifier: MIT
// Starts threads.
#include "scene/moved_files.h"

#include "temp_folder.h"

#include <kiln/world.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

namespace kiln {
namespace {

TEST(MovedFiles, LeadWhereTheyLed) {
    const TempFolder folder;
    const std::string old = (folder / "a/b").string(), here = (folder / "a").string();
    const std::string scene =
        R"({"meshes": [{"file": "m.glb"}, {"file": "/abs/n.obj", "id": "file"}], "x": [{"file": "../h.png", "k": [[1], {}]}]})";
    const std::string moved = scene::with_files_from(scene, old, here);
    EXPECT_NE(moved.find("\"file\": \"b/m.glb\""), std::string::npos) << moved;
    EXPECT_NE(moved.find("\"file\": \"/abs/n.obj\", \"id\": \"file\""), std::string::npos) << moved;
    EXPECT_NE(moved.find("\"file\": \"h.png\", \"k\": [[1], {}]"), std::string::npos) << moved;
    EXPECT_EQ(scene::with_files_from(scene, old, (folder / "a/b/../b/").string()), scene);
    EXPECT_EQ(scene::with_files_from("{\"x\":  1}", old, here), "{\"x\":  1}");
}

TEST(MovedFiles, ABundledSceneSavedHasItsModelsBesideIt) {
    const TempFolder folder;
    const auto world = World::load("workbench");
    ASSERT_TRUE(world) << world.error().message;
    const std::string file = (folder / "mine.kiln.json").string();
    ASSERT_TRUE(world->save(file));
    const auto again = World::load(file);
    ASSERT_TRUE(again) << again.error().message;
    const auto frame = again->frame();
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_FALSE(frame->meshes.empty());
    EXPECT_THAT(again->faults(), testing::IsEmpty());
    ASSERT_TRUE(world->save(file)) << "the same model is there";
    write_bytes(folder / "workbench.glb", "somebody's");
    const auto refused = world->save(file);
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message, testing::HasSubstr("workbench.glb: another file is there"));
    EXPECT_EQ(bytes_of(folder / "workbench.glb"), "somebody's");
}

// Saved to another folder, a scene of a file finds what it named.
TEST(MovedFiles, ASceneSavedElsewhereFindsItsModels) {
    const TempFolder folder;
    std::filesystem::create_directory(folder / "a");
    std::filesystem::create_directory(folder / "b");
    ASSERT_TRUE(World::load("workbench")->save((folder / "a/s.kiln.json").string()));
    ASSERT_TRUE(World::load((folder / "a/s.kiln.json").string())->save((folder / "b/s.kiln.json").string()));
    EXPECT_FALSE(std::filesystem::exists(folder / "b/workbench.glb"));
    const auto moved = World::load((folder / "b/s.kiln.json").string());
    ASSERT_TRUE(moved) << moved.error().message;
    const auto frame = moved->frame();
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_FALSE(frame->meshes.empty());
    EXPECT_THAT(moved->faults(), testing::IsEmpty());
}

TEST(MovedFiles, ARegionIsNoFile) {
    const std::string scene =
        R"({"edits": [{"file": "region:0.1:0,0,0:1,1,1:f"}, {"file": ""}, {"file": "m.obj"}], "file": 3})";
    const std::string moved = scene::with_files_from(scene, "a", "b");
    EXPECT_THAT(moved, testing::HasSubstr("\"region:0.1:0,0,0:1,1,1:f\""));
    EXPECT_THAT(moved, testing::HasSubstr("\"../a/m.obj\""));
    EXPECT_THAT(scene::files_named(scene, "a/"), testing::ElementsAre("a/m.obj"));
    EXPECT_THAT(scene::files_named("{", ""), testing::IsEmpty());
}

TEST(MovedFiles, AWorldKnowsWhatItIsReadFrom) {
    const TempFolder folder;
    const std::string scene = (folder / "s.kiln.json").string();
    write_bytes(folder / "f.vm", "a var-x\n");
    write_bytes(folder / "g.vm", "a var-x\n");
    write_bytes(scene, R"({"format": 1, "edits": [{"shape": "expression", "file": "f.vm"}]})");
    std::filesystem::create_symlink("f.vm", folder / "link.vm");
    const auto world = World::load(scene);
    ASSERT_TRUE(world) << world.error().message;
    EXPECT_TRUE(world->is_read_from(scene));
    EXPECT_THAT(world->files(), testing::ElementsAre((folder / "f.vm").string(), scene));
    EXPECT_TRUE(World::load("orbit")->files().empty());
    EXPECT_TRUE(world->is_read_from((folder / "../").string() + folder.path().filename().string() + "/s.kiln.json"));
    EXPECT_TRUE(world->is_read_from((folder / "f.vm").string()));
    EXPECT_TRUE(world->is_read_from((folder / "link.vm").string()));
    EXPECT_FALSE(world->is_read_from((folder / "g.vm").string()));
    EXPECT_FALSE(world->is_read_from((folder / "none").string()));
    EXPECT_FALSE(World().is_read_from(""));
    EXPECT_FALSE(World::load("orbit")->is_read_from("orbit"));
}

}  // namespace
}  // namespace kiln

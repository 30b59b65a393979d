// SPDX-License-Identifier: MIT
// A file that others write: what counts as another text, however fast it comes.
#include "player/watched_file.h"
#include "temp_folder.h"

#include <gtest/gtest.h>

namespace kiln::player {
namespace {

using State = WatchedFile::State;

TEST(WatchedFile, TellsOtherTextsFromTheOneThatIsKnown) {
    const TempFolder folder;
    const auto file = folder / "a";
    write_bytes(file, "one");
    WatchedFile watch(file.string());
    EXPECT_EQ(watch.look(), State::Same);
    write_bytes(file, "three");
    EXPECT_EQ(watch.look(), State::Changed);
    EXPECT_EQ(watch.look(), State::Changed) << "as long as it is another";
    write_bytes(file, "one");
    EXPECT_EQ(watch.look(), State::Same);
    std::filesystem::remove(file);
    EXPECT_EQ(watch.look(), State::Gone);
    // As programs do that write a new file and give it the old one's name.
    write_bytes(folder / "b", "two");
    std::filesystem::rename(folder / "b", file);
    EXPECT_EQ(watch.look(), State::Changed);
    watch.know(watch.found());
    EXPECT_EQ(watch.look(), State::Same);
}

TEST(WatchedFile, ATimeThatIsYoungDoesNotTell) {
    const TempFolder folder;
    const auto file = folder / "a";
    write_bytes(file, "one");
    // However long the test takes.
    const auto time = std::filesystem::last_write_time(file) + std::chrono::hours(1);
    std::filesystem::last_write_time(file, time);
    WatchedFile watch(file.string());
    write_bytes(file, "two");
    std::filesystem::last_write_time(file, time);  // a clock of wide steps
    EXPECT_EQ(watch.look(), State::Changed);
    // An old one does: the file is not read again and again.
    std::filesystem::last_write_time(file, time - std::chrono::hours(2));
    EXPECT_EQ(watch.look(), State::Changed);
    watch.know(watch.found());
    write_bytes(file, "six");
    std::filesystem::last_write_time(file, time - std::chrono::hours(2));
    EXPECT_EQ(watch.look(), State::Same);
}

TEST(WatchedFile, NamesBesideASceneAreFree) {
    const TempFolder folder;
    const std::string scene = (folder / "a.kiln.json").string();
    EXPECT_EQ(free_name_beside(scene, "other"), (folder / "a.other.kiln.json").string());
    write_bytes(folder / "a.other.kiln.json", "");
    write_bytes(folder / "a.other-2.kiln.json", "");
    EXPECT_EQ(free_name_beside(scene, "other"), (folder / "a.other-3.kiln.json").string());
    EXPECT_EQ(free_name_beside("scene.json", "mine"), "scene.json.mine");
}

}  // namespace
}  // namespace kiln::player

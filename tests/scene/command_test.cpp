// SPDX-License-Identifier: MIT
#include "scene/command.h"

#include "scene_text.h"
#include "temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace kiln {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

World two() {
    return std::move(*World::parse(
        scene::scene_with("{\"id\": \"a\", \"shape\": \"sphere\", \"radius\": 1, \"material\": \"clay\"},"
                          "{\"id\": \"b\", \"shape\": \"box\", \"position\": [3, 0, 0]}",
                          "\"materials\": {\"clay\": {}}, \"objects\": {\"ring\": {\"shape\": \"torus\"}}"),
        "s.json"));
}

TEST(Commands, ChangeAWorldAsItsFunctionsDo) {
    World world = two();
    const EditId a = *world.find_edit("a");
    ASSERT_TRUE(
        world.apply("{\"add\": {\"id\": \"c\", \"object\": \"ring\", \"material\": \"clay\"}, \"before\": \"b\"}"));
    EXPECT_EQ(world.edits()[1], *world.find_edit("c"));
    ASSERT_TRUE(world.apply("{\"change\": {\"id\": \"a\", \"shape\": \"box\", \"op\": \"subtract\"}}"));
    EXPECT_FALSE(world.find(a)->node.material) << "a whole edit: what it does not say is as never said";
    ASSERT_TRUE(world.apply("{\"change\": {\"id\": \"a\", \"position\": [0, 7, 0]}}"));
    EXPECT_EQ(world.find(a)->op, Op::Subtract) << "without a shape: some keys of it";
    EXPECT_EQ(world.find(a)->node.transform.position.y, 7);
    ASSERT_TRUE(world.apply("{\"change\": {\"id\": \"z\", \"hidden\": true}, \"was\": \"a\"}"));
    EXPECT_EQ(world.find_edit("z"), a);
    EXPECT_FALSE(world.find_edit("a"));
    ASSERT_TRUE(world.apply("{\"reorder\": \"z\"}"));
    EXPECT_EQ(world.edits()[2], a);
    ASSERT_TRUE(world.apply("{\"remove\": \"b\"}"));
    EXPECT_EQ(world.edits().size(), 2u);
    ASSERT_TRUE(world.apply("{\"materials\": {\"iron\": {\"metallic\": 1}}}"));
    EXPECT_EQ(world.material({1, 0})->metallic, 1);
    ASSERT_TRUE(
        world.apply("{\"objects\": {\"two\": {\"children\": [{\"object\": \"ring\"}, {\"shape\": \"sphere\"}]}}}"));
    ASSERT_TRUE(world.apply("{\"add\": {\"object\": \"two\"}}"));
    ASSERT_TRUE(world.apply("{\"lights\": [{\"type\": \"point\", \"intensity\": 3}]}"));
    EXPECT_EQ(world.lights.at(0).intensity, 3);
    ASSERT_TRUE(world.apply("{\"environment\": {\"intensity\": 2}}"));
    ASSERT_TRUE(world.apply("{\"environment\": null}"));
    EXPECT_FALSE(world.environment);
    ASSERT_TRUE(world.apply("{\"field\": {\"voxel_size\": 0.1}}"));
    EXPECT_EQ(world.field_settings.voxel_size, 0.1f);
    ASSERT_TRUE(world.apply("{\"cameras\": {\"main\": {}}}"));
    EXPECT_EQ(world.cameras.size(), 1u);
}

TEST(Commands, FaultsHaveAPlaceAndAMendAndChangeNothing) {
    World world = two();
    const std::string before = world.to_json();
    const std::pair<const char*, const char*> cases[] = {
        {"", "command:1:1: "},
        {"[]", "write a command such as"},
        {"{}", "an empty command"},
        {"{\"ad\": {}}", "did you mean \"add\"?"},
        {"{\"remove\": \"c\"}", "command:1:12: remove: there is no edit \"c\""},
        {"{\"remove\": 1}", "write a string"},
        {"{\"remove\": \"a\", \"before\": \"b\"}", "unknown key"},
        {"{\"reorder\": \"a\", \"before\": \"c\"}", "there is no edit \"c\""},
        {"{\"add\": {\"shape\": \"spher\"}}", "did you mean \"sphere\"?"},
        {"{\"add\": {\"id\": \"a\", \"shape\": \"sphere\"}}", "there is an edit of this name"},
        {"{\"add\": {\"id\": \"c\", \"shape\": \"sphere\", \"radius\": -1}}", "add.radius: -1 is out of range"},
        {"{\"change\": {\"shape\": \"sphere\"}}", "\"id\" is missing"},
        {"{\"change\": {\"id\": \"a\", \"half_extents\": [1, 1, 1]}}", "a sphere has no half_extents"},
        {"{\"materials\": {\"a\": {}, \"b\": {}}}", "one material by its name"},
        {"{\"materials\": {\"clay\": null}}", "still in use"},
        {"{\"objects\": {\"none\": null}}", "no such object"},
        {"{\"objects\": {\"me\": {\"object\": \"me\"}}}", "there is no object"},
        {"{\"lights\": [{\"type\": \"moon\"}]}", "command:1:22: lights[0].type: "},
        {"{\"field\": {\"cells\": 63}}", "power of two"},
    };
    for (const auto& [text, says] : cases) {
        const auto done = world.apply(text);
        ASSERT_FALSE(done) << text;
        EXPECT_THAT(done.error().message, HasSubstr(says)) << text;
        EXPECT_THAT(done.error().message, StartsWith("command")) << text;
        EXPECT_EQ(world.to_json(), before) << text;
    }
}

TEST(Commands, AFileOfThemIsReadByTimeAndItsFaultsHaveLines) {
    const TempFolder folder;
    const std::string path = (folder / "edits.jsonl").string();
    const auto read = [&](const std::string& text) {
        std::ofstream(path, std::ios::binary) << text;
        return read_timed_commands(path);
    };
    const auto commands = read(
        "{\"time\": 2, \"command\": {\"remove\": \"a\"}}\r\n\n{\"command\": {\"add\": {\"id\": \"c\", \"shape\": "
        "\"sphere\"}}, \"time\": 0.5}\n{\"time\": 2, \"command\": {\"remove\": \"nobody\"}}");
    ASSERT_TRUE(commands) << commands.error().message;
    ASSERT_EQ(commands->size(), 3u);
    EXPECT_EQ((*commands)[0].time, 0.5);
    EXPECT_EQ((*commands)[0].line, 3u);
    World world = two();
    ASSERT_TRUE(world.apply((*commands)[0]));
    ASSERT_TRUE(world.apply((*commands)[1]));
    EXPECT_FALSE(world.find_edit("a"));
    const auto late = world.apply((*commands)[2]);
    ASSERT_FALSE(late);
    EXPECT_THAT(late.error().message, StartsWith(path + ":4:35: command.remove: there is no edit \"nobody\""));
    EXPECT_EQ(late.error().kind, ErrorKind::Input);
    const std::pair<const char*, const char*> bad[] = {
        {"{\"time\": 1}\n", ":1:1: the key \"command\" is missing"},
        {"\n{\"command\": {\"remove\": \"a\"}}", ":2:1: the key \"time\" is missing"},
        {"{\"time\": -1, \"command\": {\"remove\": \"a\"}}", ":1:10: "},
        {"{\"time\": 1, \"command\": {\"remov\": \"a\"}}", "did you mean \"remove\"?"},
        {"{\"time\": 1, \"command\": {\"remove\": \"a\"}, \"x\": 1}", "unknown key"},
        {"[]", "no object"},
        {"{\"time\": 1,", ":1:"},
    };
    for (const auto& [text, says] : bad) {
        const auto fault = read(text);
        ASSERT_FALSE(fault) << text;
        EXPECT_THAT(fault.error().message, StartsWith(path + ":")) << text;
        EXPECT_THAT(fault.error().message, HasSubstr(says)) << text;
        EXPECT_EQ(fault.error().kind, ErrorKind::Input);
    }
    EXPECT_EQ(read_timed_commands("/nonexistent").error().kind, ErrorKind::Input);
}

std::string lines(const std::string& a, const std::string& b) {
    const auto first = World::parse(a, "a.json"), second = World::parse(b, "b.json");
    EXPECT_TRUE(first) << first.error().message;
    EXPECT_TRUE(second) << second.error().message;
    const SceneDifference d = compare_scenes(*first, *second);
    EXPECT_EQ(d.equal, d.lines.empty());
    EXPECT_EQ(d.equal, d.json.find("\"equal\": true") != std::string::npos);
    return d.lines;
}

TEST(SceneDiff, NeitherOrderOfKeysNorSpelledOutDefaultsCount) {
    EXPECT_EQ(
        lines(scene::scene_with("{\"id\": \"a\", \"shape\": \"sphere\", \"radius\": 1}"),
              scene::scene_with("{\"radius\": 1.0, \"op\": \"union\", \"scale\": [1, 1, 1], \"shape\": \"sphere\", "
                                "\"id\": \"a\", \"domain\": []}",
                                "\"field\": {}, \"physics\": {\"step\": 0.0166666667}, \"materials\": {}")),
        "");
}

TEST(SceneDiff, SaysWhatIsAddedRemovedChangedAndMoved) {
    const std::string a = scene::scene_with(
        "{\"id\": \"a\", \"shape\": \"sphere\", \"radius\": 1}, {\"id\": \"b\", \"shape\": \"box\"}, {\"id\": \"c\", "
        "\"shape\": \"box\"}, {\"id\": \"d\", \"shape\": \"box\"}",
        "\"materials\": {\"m\": {\"roughness\": 0.5}}, \"cameras\": {\"x\": {}, \"y\": {}}, \"lights\": [{\"type\": "
        "\"point\"}], \"bodies\": [{\"id\": \"body\", \"edits\": [\"a\"], \"density\": 5}]");
    const std::string b = scene::scene_with(
        "{\"id\": \"a\", \"shape\": \"sphere\", \"radius\": 2}, {\"id\": \"d\", \"shape\": \"box\"}, {\"id\": \"b\", "
        "\"shape\": \"box\"}, {\"id\": \"e\", \"shape\": \"box\"}",
        "\"materials\": {\"m\": {}, \"n\": {}}, \"cameras\": {\"y\": {}, \"x\": {\"fov_y_deg\": 30}}, \"environment\": "
        "{}, "
        "\"field\": {\"voxel_size\": 0.5}, \"bodies\": [{\"id\": \"body\", \"edits\": [\"a\"], \"density\": 6}], "
        "\"wind\": [1, 0, 0]");
    EXPECT_EQ(lines(a, a), "");
    EXPECT_EQ(lines(a, b),
              "field\n  ~ voxel_size default -> 0.5\n"
              "materials\n  ~ m: roughness 0.5 -> default\n  + n\n"
              "edits\n  - c\n  ~ a: radius 1 -> 2\n  + e\n  < d: now before b\n"
              "lights\n  - #1\n"
              "environment\n  +\n"
              "cameras\n  ~ x: fov_y_deg default -> 30\n  < y: is the first now\n"
              "bodies\n  ~ body: density 5 -> 6\n"
              "wind\n  ~ default -> [1,0,0]\n");
    const SceneDifference d = compare_scenes(*World::parse(a, "a"), *World::parse(b, "b"));
    EXPECT_THAT(d.json, HasSubstr("\"removed\": [\n      \"c\"\n    ]"));
    EXPECT_THAT(d.json, HasSubstr("\"radius\": {\n            \"a\": 1,"));
}

}  // namespace
}  // namespace kiln

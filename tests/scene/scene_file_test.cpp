// SPDX-License-Identifier: MIT
#include "scene/scene_file.h"

#include "base/format.h"
#include "scene/format.h"
#include "scene_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>

namespace kiln::scene {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

const char* const kMaterials =
    "\"materials\": {\"clay\": {\"base_color\": [0.7, 0.3, 0.2]}, \"glass\": {\"opacity\": 0.5}}";

struct BadScene {
    std::string text;
    const char* path;  // after the place
    const char* wrong;
    const char* right;
};

class EachBadScene : public testing::TestWithParam<BadScene> {};

TEST_P(EachBadScene, TellsPlaceFaultAndMend) {
    const auto& [text, path, wrong, right] = GetParam();
    const std::string message = fault_of(text);
    ASSERT_THAT(message, testing::MatchesRegex("s.json:[0-9]+:[0-9]+: .*")) << text;
    const std::string rest = message.substr(message.find(": ") + 2);
    EXPECT_THAT(rest, StartsWith(path)) << text;
    EXPECT_THAT(rest, HasSubstr(wrong)) << text;
    EXPECT_THAT(rest, HasSubstr(right)) << text;
    EXPECT_EQ(message.find('\n'), std::string::npos);
}

std::string with_object(const std::string& body, const std::string& placed = "a") {
    return scene_with("{\"object\": \"" + placed + "\"}", "\"objects\": {" + body + "}");
}

INSTANTIATE_TEST_SUITE_P(
    Scene, EachBadScene,
    testing::Values(
        BadScene{"[]", "[...] is an array", "write an object", "format"},
        BadScene{"{}", "the key \"format\"", "missing", "add it"},
        BadScene{"{\"format\": 2}", "format: ", "newer", "format 1"},
        BadScene{"{\"format\": \"1\"}", "format: ", "a string", "a number such as 1"},
        BadScene{"{\"format\": 1, \"edit\": []}", "edit: ", "unknown key", "did you mean \"edits\"?"},
        BadScene{"{\"format\": 1, \"edits\": {}}", "edits: ", "an object", "an array"},
        BadScene{scene_with("3"), "edits[0]: ", "a number", "an object such as"},
        BadScene{scene_with("{}"), "edits[0]: ", "neither a shape nor an object", "\"shape\": \"sphere\""},
        BadScene{scene_with("{\"shape\": \"spere\"}"), "edits[0].shape: ", "there is no shape \"spere\"",
                 "did you mean \"sphere\"?"},
        BadScene{scene_with("{\"shape\": \"mesh\", \"file\": \"a.obj\"}"), "edits[0].file: ", "a.obj: cannot be read",
                 "check the name"},
        BadScene{scene_with("{\"shape\": \"expression\"}"), "edits[0]: ", "needs its formula", "length(p) - 1"},
        BadScene{scene_with("{\"shape\": \"expression\", \"expression\": \"x\", \"file\": \"a.vm\"}"),
                 "edits[0].file: ", "in one place", "keep one"},
        BadScene{scene_with("{\"shape\": \"expression\", \"file\": \"a.png\"}"),
                 "edits[0].file: ", "not the name of a .vm", "name one"},
        BadScene{scene_with("{\"shape\": \"expression\", \"expression\": 5}"), "edits[0].expression: ", "5 is a number",
                 "length(p) - 1"},
        BadScene{scene_with("{\"shape\": \"expression\", \"expression\": \"x +\\n* y\"}"),
                 "edits[0].expression: ", "expression 2:1: a value is missing", "write one"},
        BadScene{scene_with("{\"shape\": \"expression\", \"expression\": \"floor(x)\"}"),
                 "edits[0].expression: ", "no bound of its slope", "\"lipschitz\""},
        BadScene{scene_with("{\"shape\": \"expression\", \"expression\": \"3*x\", \"lipschitz\": 2}"),
                 "edits[0].expression: ", "lipschitz 2 does not hold: at (", "use at least 3.03"},
        BadScene{scene_with("{\"shape\": \"expression\", \"expression\": \"x\", \"half_extents\": [1, 0, 1]}"),
                 "edits[0].half_extents", "out of range", "greater than 0"},
        BadScene{scene_with("{\"shape\": 5}"), "edits[0].shape: ", "5 is a number", "\"sphere\""},
        BadScene{scene_with("{\"shape\": \"sphere\", \"radius\": \"big\"}"), "edits[0].radius: ", "\"big\" is a string",
                 "a number such as 0.5"},
        BadScene{scene_with("{\"shape\": \"sphere\", \"radius\": null}"), "edits[0].radius: ", "null",
                 "leave the key out"},
        BadScene{scene_with("{\"shape\": \"sphere\", \"radius\": 0}"), "edits[0].radius: ", "0 is out of range",
                 "greater than 0"},
        BadScene{scene_with("{\"shape\": \"sphere\", \"radius\": -1}"), "edits[0].radius: ", "-1 is out of range",
                 "greater than 0"},
        BadScene{scene_with("{\"shape\": \"sphere\", \"radius\": 1e30}"), "edits[0].radius: ", "too large",
                 "at most 1e+09 metres"},
        BadScene{scene_with("{\"shape\": \"sphere\", \"radius\": 1e300}"), "edits[0].radius: ", "too large", "at most"},
        BadScene{scene_with("{\"shape\": \"sphere\", \"raduis\": 1}"), "edits[0].raduis: ", "unknown key",
                 "did you mean \"radius\"?"},
        BadScene{scene_with("{\"shape\": \"sphere\", \"half_extents\": [1, 1, 1]}"),
                 "edits[0].half_extents: ", "a sphere has no half_extents", "it has radius"},
        BadScene{scene_with("{\"shape\": \"box\", \"half_extents\": [1, 1]}"), "edits[0].half_extents: ", "2 numbers",
                 "must be 3"},
        BadScene{scene_with("{\"shape\": \"box\", \"half_extents\": 1}"), "edits[0].half_extents: ", "a number",
                 "3 numbers such as"},
        BadScene{scene_with("{\"shape\": \"box\", \"half_extents\": [1, 0, 1]}"),
                 "edits[0].half_extents[1]: ", "out of range", "greater than 0"},
        BadScene{scene_with("{\"shape\": \"prism\", \"sides\": 2.5}"), "edits[0].sides: ", "2.5", "whole number"},
        BadScene{scene_with("{\"shape\": \"prism\", \"sides\": 65}"), "edits[0].sides: ", "65 is out of range",
                 "[3, 64]"},
        BadScene{scene_with("{\"shape\": \"heightfield\"}"), "edits[0]: ", "needs a \"file\"", "PNG"},
        BadScene{scene_with("{\"shape\": \"sphere\", \"object\": \"a\"}"), "edits[0].object: ", "a shape and an object",
                 "keep one"},
        BadScene{scene_with("{\"children\": []}"), "edits[0].children: ", "no children", "\"objects\""},
        BadScene{scene_with("{\"object\": \"a\"}"), "edits[0].object: ", "there is no object \"a\"", "there are none"},
        BadScene{scene_with("{\"shape\": \"sphere\", \"material\": \"cla\"}", kMaterials),
                 "edits[0].material: ", "no material \"cla\"", "did you mean \"clay\"?"},
        BadScene{scene_with("{\"shape\": \"sphere\", \"op\": \"add\"}"), "edits[0].op: ", "\"add\" is not known",
                 "\"subtract\""},
        BadScene{scene_with("{\"shape\": \"sphere\", \"op\": \"paint\"}"), "edits[0]: ", "paint without a material",
                 "add \"material\""},
        BadScene{scene_with("{\"shape\": \"sphere\", \"blend_radius\": -0.1}"), "edits[0].blend_radius: ", "-0.1",
                 "not be negative"},
        BadScene{scene_with("{\"shape\": \"sphere\", \"position\": [0, 2e9, 0]}"),
                 "edits[0].position[1]: ", "too large", "metres"},
        BadScene{scene_with("{\"shape\": \"sphere\", \"rotation\": [0, 0, 0, 2]}"), "edits[0].rotation: ", "length 2",
                 "must be 1"},
        BadScene{scene_with("{\"shape\": \"sphere\", \"rotation\": [0, 0, 0, 0]}"), "edits[0].rotation: ", "length 0",
                 "must be 1"},
        BadScene{scene_with("{\"shape\": \"sphere\", \"rotation\": [0, 0, 1]}"), "edits[0].rotation: ", "3 numbers",
                 "quaternion"},
        BadScene{scene_with("{\"shape\": \"sphere\", \"scale\": [1, -1, 1]}"), "edits[0].scale[1]: ", "-1",
                 "greater than 0"},
        BadScene{scene_with("{\"shape\": \"sphere\", \"scale\": 1e9}"), "edits[0].scale: ", "1e+09", "between"},
        BadScene{scene_with("{\"shape\": \"sphere\", \"hidden\": 1}"), "edits[0].hidden: ", "1 is a number",
                 "true or false"},
        BadScene{scene_with("{\"shape\": \"sphere\", \"id\": \"\"}"), "edits[0].id: ", "empty id", "give it a name"},
        BadScene{scene_with("{\"shape\": \"sphere\", \"id\": \"a\"}, {\"shape\": \"box\", \"id\": \"a\"}"),
                 "edits[1].id: ", "edits[0] has this id", "choose another"},
        BadScene{scene_with("{\"shape\": \"sphere\", \"domain\": [{\"rate\": 1}]}"),
                 "edits[0].domain[0]: ", "\"warp\" is missing", "twist"},
        BadScene{scene_with("{\"shape\": \"sphere\", \"domain\": [{\"warp\": \"twits\"}]}"),
                 "edits[0].domain[0].warp: ", "there is no warp", "did you mean \"twist\"?"},
        BadScene{scene_with("{\"shape\": \"sphere\", \"domain\": [{\"warp\": \"mirror\", \"axis\": \"w\"}]}"),
                 "edits[0].domain[0].axis: ", "there is no axis", "x, y, z"},
        BadScene{scene_with("{\"shape\": \"sphere\", \"domain\": [{\"warp\": \"repeat\", \"spacing\": [0.1, 0, 0]}]}"),
                 "edits[0].domain[0]: ", "wider than the spacing", "larger spacing"},
        BadScene{scene_with("{\"shape\": \"plane\", \"domain\": [{\"warp\": \"twist\", \"rate\": 1}]}"),
                 "edits[0].domain[0]: ", "finite size", "bounded shape"},
        BadScene{with_object("\"a\": {\"object\": \"a\"}"), "objects.a.object: ", "contains itself: a -> a",
                 "take one"},
        BadScene{with_object("\"a\": {\"children\": [{\"object\": \"b\"}]}, \"b\": {\"object\": \"a\"}"),
                 "objects.b.object: ", "contains itself: a -> b -> a", "take one"},
        BadScene{with_object("\"a\": {\"children\": [{\"shape\": \"sphere\", \"op\": \"union\"}]}"),
                 "objects.a.children[0].op: ", "stands on the node with \"children\"", "move it"},
        BadScene{with_object("\"a\": {\"children\": []}"), "objects.a.children: ", "no children", "at least one"},
        BadScene{with_object("\"\": {\"shape\": \"sphere\"}", ""), "objects.", "empty name", "give it a name"},
        BadScene{"{\"format\": 1, \"materials\": {\"a\": {\"roughness\": 1.5}}}", "materials.a.roughness: ", "1.5",
                 "[0, 1]"},
        BadScene{"{\"format\": 1, \"materials\": {\"a\": {\"opacity\": 0}}}",
                 "materials.a.opacity: ", "0 is out of range", "(0, 1]"},
        BadScene{"{\"format\": 1, \"materials\": {\"a\": {\"color\": [1, 1, 1]}}}",
                 "materials.a.color: ", "unknown key", "base_color"},
        BadScene{"{\"format\": 1, \"field\": {\"voxel_size\": 0}}", "field.voxel_size: ", "0 is out of range",
                 "greater than 0"},
        BadScene{"{\"format\": 1, \"field\": {\"cells\": 63}}", "field.cells: ", "not a power of two", "use 32"},
        BadScene{"{\"format\": 1, \"field\": {\"bounds\": {\"min\": [0, 0, 0], \"max\": [1, 0, 1]}}}",
                 "field.bounds: ", "not below", "move them apart"},
        BadScene{"{\"format\": 1, \"field\": {\"bounds\": {\"min\": [0, 0, 0]}}}",
                 "field.bounds: ", "\"max\" is missing", "add it"},
        BadScene{"{\"format\": 1, \"lights\": [{\"type\": \"sun\"}]}", "lights[0].type: ", "\"sun\"",
                 "\"directional\""},
        BadScene{"{\"format\": 1, \"lights\": [{}]}", "lights[0]: ", "\"type\" is missing", "add it"},
        BadScene{"{\"format\": 1, \"lights\": [{\"type\": \"point\", \"direction\": [0, 1, 0]}]}",
                 "lights[0].direction: ", "a point light has no such key", "remove it"},
        BadScene{"{\"format\": 1, \"lights\": [{\"type\": \"spot\", \"inner_deg\": 40}]}",
                 "lights[0]: ", "inner_deg 40 is above", "must not be"},
        BadScene{"{\"format\": 1, \"lights\": [{\"type\": \"directional\", \"direction\": [0, 0, 0]}]}",
                 "lights[0].direction: ", "length 0", "such as"},
        BadScene{"{\"format\": 1, \"cameras\": {\"m\": {\"target\": [3, 2, 4]}}}", "cameras.m: ", "same point",
                 "move one"},
        BadScene{"{\"format\": 1, \"cameras\": {\"m\": {\"fov_y_deg\": 180}}}", "cameras.m.fov_y_deg: ", "180",
                 "[1, 170]"},
        BadScene{"{\"format\": 1, \"cameras\": {\"m\": {\"tone_map\": \"acse\"}}}", "cameras.m.tone_map: ", "\"acse\"",
                 "\"aces\""},
        BadScene{"{\"format\": 1, \"bodies\": [{\"id\": \"b\", \"edits\": [\"x\"]}]}",
                 "bodies[0].edits[0]: ", "no edit \"x\"", "there are none"},
        BadScene{"{\"format\": 1, \"bodies\": [{\"id\": \"b\"}]}", "bodies[0]: ", "either \"edits\" or a \"mesh\"",
                 "give it one"},
        BadScene{"{\"format\": 1, \"bodies\": [{\"id\": \"b\", \"mesh\": \"m\"}]}", "bodies[0].mesh: ", "no mesh",
                 "there are none"},
        BadScene{"{\"format\": 1, \"triggers\": [{\"id\": \"t\", \"object\": \"o\"}]}",
                 "triggers[0].object: ", "no object", "there are none"},
        BadScene{
            "{\"format\": 1, \"meshes\": [{\"id\": \"a\", \"file\": \"a.obj\"}, {\"id\": \"a\", \"file\": \"b.obj\"}]}",
            "meshes[1].id: ", "meshes[0] has this id", "choose another"},
        BadScene{"{\"format\": 1, \"cloths\": [{\"id\": \"c\", \"pinned\": \"left\"}]}",
                 "cloths[0].pinned: ", "\"left\"", "\"top\""},
        BadScene{"{\"format\": 1, \"fluids\": [{\"id\": \"f\"}]}", "fluids[0]: ", "\"box\" is missing", "add it"},
        BadScene{"{\"format\": 1, \"wind\": [0, 0]}", "wind: ", "2 numbers", "must be 3"},
        BadScene{"{\"format\": 1, \"physics\": {\"step\": 0}}", "physics.step: ", "0 is out of range", "(0, 1]"}));

TEST(SceneFile, PlacesCountLinesAndCharacters) {
    EXPECT_THAT(fault_of("{\n  \"format\": 1,\n  \"edits\": [\n    { \"shape\": \"sphere\", \"radius\": -1 }\n  ]\n}"),
                StartsWith("s.json:4:36: edits[0].radius: "));
}

TEST(SceneFile, ReadsEveryPartOfAnEdit) {
    auto s = read_scene(
        scene_with(
            "{\"id\": \"e\", \"shape\": \"torus\", \"major_radius\": 2, \"op\": \"subtract\", \"blend_radius\": 0.25,"
            "\"material_blend_radius\": 0.5, \"position\": [1, 2, 3], \"rotation\": [0, 0, 0.6, 0.8], \"scale\": 2,"
            "\"domain\": [{\"warp\": \"mirror\", \"axis\": \"z\"}, {\"warp\": \"twist\", \"rate\": 1.5}], "
            "\"material\": \"glass\","
            "\"dynamic\": true, \"hidden\": true, \"group\": \"g\"}",
            kMaterials),
        "s.json");
    ASSERT_TRUE(s) << s.error().message;
    const Edit& e = s->edits[0];
    EXPECT_EQ(e.name, "e");
    const auto& row = sdf::shape_rows()[e.node.shape.kind];
    EXPECT_EQ(row.name, "torus");
    EXPECT_EQ(e.node.shape.params[size_t(row.fields()[0].offset)], 2);
    EXPECT_EQ(e.node.shape.params[size_t(row.fields()[1].offset)], row.fields()[1].defaults[0]);
    EXPECT_EQ(e.op, Op::Subtract);
    EXPECT_EQ(e.blend_radius, 0.25f);
    EXPECT_EQ(e.material_blend_radius, 0.5f);
    EXPECT_EQ(e.node.transform, (Transform{{1, 2, 3}, {0, 0, 0.6f, 0.8f}, {2, 2, 2}}));
    ASSERT_EQ(e.node.domain.size(), 2u);
    EXPECT_EQ(e.node.domain[0].params[0], 2);
    EXPECT_EQ(e.node.domain[1].params[0], 1.5f);
    EXPECT_EQ(e.node.material.index, 1u);
    EXPECT_TRUE(e.dynamic && e.hidden);
    EXPECT_EQ(e.group, "g");
}

TEST(SceneFile, RotationsNearUnitLengthAreNormalised) {
    auto s = read_scene(scene_with("{\"shape\": \"sphere\", \"rotation\": [0, 0, 0.6004, 0.8]}"), "s.json");
    ASSERT_TRUE(s);
    const quat q = s->edits[0].node.transform.rotation;
    EXPECT_NEAR(q.z * q.z + q.w * q.w, 1, 1e-6);
}

TEST(SceneFile, EditsWithoutIdsGetFreeOnes) {
    auto s = read_scene(
        scene_with("{\"shape\": \"sphere\"}, {\"id\": \"sphere-1\", \"shape\": \"box\"}, {\"shape\": \"box\"}"),
        "s.json");
    ASSERT_TRUE(s);
    EXPECT_EQ(s->edits[0].name, "sphere-1-2");
    EXPECT_EQ(s->edits[2].name, "box-3");
}

TEST(SceneFile, TreesKeepTheirOrder) {
    auto s = read_scene(
        with_object("\"a\": {\"op\": \"subtract\", \"blend_radius\": 0.1, \"children\": ["
                    "{\"children\": [{\"shape\": \"box\"}, {\"shape\": \"torus\"}]}, {\"shape\": \"sphere\"}]}"),
        "s.json");
    ASSERT_TRUE(s) << s.error().message;
    const auto& nodes = s->objects[0].nodes;
    ASSERT_EQ(nodes.size(), 5u);
    EXPECT_EQ(nodes[0].op, Op::Subtract);
    ASSERT_EQ(nodes[0].children.size(), 2u);
    const Node& pair = nodes[nodes[0].children[0]];
    ASSERT_EQ(pair.children.size(), 2u);
    EXPECT_EQ(sdf::shape_rows()[nodes[pair.children[1]].shape.kind].name, "torus");
    EXPECT_EQ(sdf::shape_rows()[nodes[nodes[0].children[1]].shape.kind].name, "sphere");
}

TEST(SceneFile, DeepTreesAndLongChainsOfReferencesNeedNoStack) {
    constexpr int kDeep = 100000;
    std::string tree;
    for (int i = 0; i < kDeep; ++i) tree += "{\"children\":[";
    tree += "{\"shape\":\"sphere\"}";
    for (int i = 0; i < kDeep; ++i) tree += "]}";
    auto deep = World::parse(with_object("\"a\": " + tree), "s.json");
    ASSERT_TRUE(deep) << deep.error().message.substr(0, 300);
    EXPECT_NEAR(deep->distance({2, 0, 0}), 1.5f, 1e-5f);

    std::string chain = "\"o0\": {\"shape\": \"sphere\"}";
    for (int i = 1; i < kDeep; ++i)
        chain += ", \"o" + std::to_string(i) + "\": {\"object\": \"o" + std::to_string(i - 1) + "\"}";
    auto linked = World::parse(with_object(chain, "o" + std::to_string(kDeep - 1)), "s.json");
    ASSERT_TRUE(linked) << linked.error().message.substr(0, 300);
    EXPECT_NEAR(linked->distance({2, 0, 0}), 1.5f, 1e-5f);

    std::string ring = chain;
    ring.replace(ring.find("{\"shape\": \"sphere\"}"), 19, "{\"object\": \"o" + std::to_string(kDeep - 1) + "\"}");
    EXPECT_THAT(fault_of(with_object(ring, "o0")), HasSubstr("contains itself"));
}

TEST(SceneFile, DoublingObjectsAreRefusedNotExpanded) {
    std::string objects = "\"o0\": {\"shape\": \"sphere\"}";
    for (int i = 1; i <= 64; ++i) {
        const std::string inner = "{\"object\": \"o" + std::to_string(i - 1) + "\"}";
        objects += ", \"o" + std::to_string(i) + "\": {\"children\": [" + inner + ", " + inner + "]}";
    }
    EXPECT_THAT(fault_of(with_object(objects, "o64")), HasSubstr("fewer copies"));
}

TEST(SceneFile, SectionsOfLaterVersionsAreReadAndTold) {
    const std::string text = scene_with(
        "{\"id\": \"rock\", \"shape\": \"sphere\"}",
        "\"meshes\": [{\"id\": \"m\", \"file\": \"m.glb\", \"outline\": {\"color\": [1, 0, 0], \"width_px\": 2}}],"
        "\"bodies\": [{\"id\": \"b\", \"edits\": [\"rock\"]}, {\"id\": \"c\", \"mesh\": \"m\", \"collision\": "
        "\"convex\"}],"
        "\"cloths\": [{\"id\": \"f\", \"pinned\": [[0, 0], [3, 0]], \"size\": 2}], \"fluids\": [], \"wind\": [1, 0, 0],"
        "\"environment\": {\"file\": \"sky.exr\"}");
    auto s = read_scene(text, "s.json");
    ASSERT_TRUE(s) << s.error().message;
    EXPECT_THAT(s->undrawn, testing::ElementsAre("cloths"));
}

TEST(SceneFile, TheExampleOfTheFormatReads) {
    // What the format's page shows, without what this version has no shape for.
    std::ifstream in(std::string(KILN_SOURCE_DIR) + "/docs/scene-format.md");
    const std::string page((std::istreambuf_iterator<char>(in)), {});
    const size_t begin = page.find("```json\n");
    ASSERT_NE(begin, std::string::npos);
    const size_t end = page.find("```", begin + 8);
    EXPECT_EQ(fault_of(page.substr(begin + 8, end - begin - 8)), "");
}

// Where the page tells a table's keys: behind this, up to the next heading.
std::string_view place_in_documentation(const Table& table) {
    static const std::map<std::string_view, std::string_view> kPlaces = {
        {"scene", "## Top level"},         {"field", "## `field`"},       {"bounds", "## Boxes"},
        {"material", "## `materials`"},    {"light", "## `lights`"},      {"environment", "## `environment`"},
        {"camera", "## `cameras`"},        {"edit", "## `edits`"},        {"node", "## `objects`"},
        {"outline", "### `outline`"},      {"mesh", "### `meshes`"},      {"physics", "### `physics`"},
        {"body", "### `bodies`"},          {"trigger", "### `triggers`"}, {"wish", "An entry of `path`"},
        {"character", "### `characters`"}, {"cloth", "### `cloths`"},     {"fluid", "### `fluids`"}};
    const auto found = kPlaces.find(table.name);
    return found == kPlaces.end() ? std::string_view{} : found->second;
}

TEST(SceneFile, EveryKeyOfTheTablesIsInTheDocumentation) {
    std::ifstream in(std::string(KILN_SOURCE_DIR) + "/docs/scene-format.md");
    const std::string page((std::istreambuf_iterator<char>(in)), {});
    std::vector<const Table*> tables{&kSceneTable};
    for (size_t i = 0; i < tables.size(); ++i) {
        const Table& table = *tables[i];
        const std::string_view place = place_in_documentation(table);
        const size_t begin = place.empty() ? std::string::npos : page.find("\n" + std::string(place));
        ASSERT_NE(begin, std::string::npos) << "no place for " << table.name;
        const std::string part = page.substr(begin, page.find("\n#", begin + 1) - begin);
        for (const KeyRow& row : table.rows) {
            if (row.table != nullptr && std::ranges::count(tables, row.table) == 0) tables.push_back(row.table);
            // As the schema has it.
            const bool number = row.type == KeyType::Numbers;
            const std::string unit = number && row.numbers.unit != "1" ? formatted(" ({})", row.numbers.unit) : "";
            const std::string_view range = number && row.numbers.range != "any" ? row.numbers.range : "";
            EXPECT_THAT(part, HasSubstr(formatted("\n| `{}` | {}{} | {} |", row.name, row.doc, unit, range)))
                << table.name;
            const std::string line = formatted("\n| `{}` | {}", row.name, row.doc);
            const size_t at = std::min(part.find(line), part.size());
            EXPECT_EQ(part.substr(at, part.find('\n', at + 1) - at).ends_with("| required |"), row.required)
                << row.name;
            for (const std::string_view word : row.choices) {
                const std::string prose = formatted("`{}`", word);
                EXPECT_TRUE(row.doc.find(word) != std::string_view::npos || part.find(prose) != std::string::npos)
                    << table.name << " " << row.name << ": " << word;
            }
        }
    }
    EXPECT_EQ(tables.size(), 18u);
    for (const auto rows : {sdf::shape_rows(), sdf::warp_rows()})
        for (const sdf::KindRow& row : rows) {
            EXPECT_THAT(page, HasSubstr("`" + std::string(row.name) + "`"));
            for (const sdf::FieldRow& field : row.fields())
                if (field.range != "internal") {
                    EXPECT_THAT(page, HasSubstr("`" + std::string(field.name) + "`")) << row.name;
                }
        }
}

}  // namespace
}  // namespace kiln::scene

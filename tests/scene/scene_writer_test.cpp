// SPDX-License-Identifier: MIT
#include "scene/scene_file.h"

#include "scene/bundled.h"
#include "scene_text.h"
#include "sdf/tables.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace kiln::scene {
namespace {

using testing::HasSubstr;

std::string saved(const std::string& text) {
    auto world = World::parse(text, "s.json");
    EXPECT_TRUE(world) << world.error().message;
    return world ? world->to_json() : std::string();
}

TEST(SceneWriter, SavingTwiceGivesTheSameBytes) {
    for (const BundledScene& scene : bundled_files()) {
        const std::string once = saved(std::string(scene.json));
        EXPECT_EQ(saved(once), once) << scene.name;
    }
}

TEST(SceneWriter, KeepsKeyOrderDefaultsAndForms) {
    const std::string text =
        "{\n"
        "  \"edits\": [{ \"op\": \"union\", \"scale\": 2, \"shape\": \"sphere\", \"id\": \"a\", \"radius\": 0.1, "
        "\"blend_radius\": 0 }],\n"
        "  \"cameras\": { \"b\": { \"position\": [1, 2, 3] }, \"a\": { \"fov_y_deg\": 30 } },\n"
        "  \"format\": 1,\n"
        "  \"wind\": [1, 0, 0.1],\n"
        "  \"materials\": { \"z\": { \"metallic\": 0 }, \"y\": {} },\n"
        "  \"lights\": [{ \"intensity\": 20, \"type\": \"point\" }],\n"
        "  \"bodies\": [{ \"id\": \"rock\", \"edits\": [\"a\"], \"density\": 2000 }]\n"
        "}\n";
    EXPECT_EQ(saved(text), text);
}

TEST(SceneWriter, ChangesAreWrittenInPlace) {
    auto world = World::parse(scene_with("{\"material\": \"m\", \"radius\": 1, \"shape\": \"sphere\", \"id\": \"a\"}, "
                                         "{\"shape\": \"box\", \"id\": \"b\"}",
                                         "\"materials\": {\"m\": {}}"),
                              "s.json");
    ASSERT_TRUE(world);
    const EditId a = *world->find_edit("a");
    Edit edit = *world->find(a);
    edit.op = Op::Subtract;
    edit.node.shape = Torus{.major_radius = 2, .minor_radius = 0.5f};
    ASSERT_TRUE(world->change(a, edit));
    ASSERT_TRUE(world->remove(*world->find_edit("b")));
    Edit c;
    c.name = "c";
    c.node.shape = Sphere{.radius = 3};
    ASSERT_TRUE(world->add(c));
    world->cameras.emplace_back("near", Camera{.fov_y_deg = 20});
    const std::string out = world->to_json();
    EXPECT_THAT(out, HasSubstr("{ \"material\": \"m\", \"shape\": \"torus\", \"id\": \"a\", \"major_radius\": 2, "
                               "\"minor_radius\": 0.5, \"op\": \"subtract\" }"));
    EXPECT_THAT(out, testing::Not(HasSubstr("\"b\"")));
    EXPECT_THAT(out, HasSubstr("{ \"id\": \"c\", \"shape\": \"sphere\", \"radius\": 3 }"));
    EXPECT_THAT(out, HasSubstr("\"near\": { \"fov_y_deg\": 20 }"));
    EXPECT_EQ(saved(out), out);
}

TEST(SceneWriter, WorldsMadeByCodeSaveAndLoad) {
    World world;
    const MaterialId clay = world.add_material("clay", {.base_color = {0.7f, 0.3f, 0.2f}});
    Object washer;
    washer.name = "washer";
    washer.nodes.resize(3);
    washer.nodes[0].kind = Node::Kind::Fold;
    washer.nodes[0].op = Op::Subtract;
    washer.nodes[0].children = {1, 2};
    washer.nodes[1].shape = Cylinder{.half_height = 0.1f, .radius = 0.4f};
    washer.nodes[2].shape = Cylinder{.half_height = 0.2f, .radius = 0.2f};
    washer.nodes[2].domain.push_back(Mirror{.axis = 1});
    const auto object = world.add_object(washer);
    ASSERT_TRUE(object) << object.error().message;
    Edit placed;
    placed.node.kind = Node::Kind::Object;
    placed.node.object = *object;
    placed.node.material = clay;
    ASSERT_TRUE(world.add(placed));
    world.field_settings.voxel_size = 0.01f;
    world.field_settings.bounds = Box3{{-1, -1, -1}, {1, 1, 1}};
    world.lights.push_back({.kind = Light::Kind::Spot, .direction = {0, -1, 0}, .position = {0, 3, 0}});
    world.environment = Environment{.color = {0, 0, 0}};
    const std::string text = world.to_json();
    auto again = World::parse(text, "s.json");
    ASSERT_TRUE(again) << again.error().message << "\n" << text;
    EXPECT_EQ(again->to_json(), text);
    EXPECT_EQ(again->field_settings.bounds, world.field_settings.bounds);
    for (const vec3 p : {vec3{0, 0, 0}, vec3{0.3f, 0, 0}, vec3{1, 1, 1}})
        EXPECT_EQ(again->distance(p), world.distance(p));
}

RC_GTEST_PROP(SceneWriter, AnyEditReadsBackAsItself, (uint32_t seed)) {
    // A random legal edit of any shape with any warp that stands alone.
    const auto unit = [&] { return float((seed = seed * 1664525u + 1013904223u) >> 8) / float(1 << 24); };
    World world;
    const MaterialId material = world.add_material("m", {});
    const auto fill = [&](const sdf::KindRow& row, std::array<float, kMaxParams>& params) {
        for (const sdf::FieldRow& f : row.fields())
            for (int k = 0; k < f.arity; ++k) {
                float v = f.defaults[size_t(k)];
                if (f.range == "> 0" || f.range == "any") v *= 0.5f + unit();
                params[size_t(f.offset + k)] = v;
            }
    };
    Edit edit;
    edit.name = "e";
    do {
        edit.node.shape.kind = uint16_t(unit() * float(sdf::shape_rows().size()));
    } while (sdf::shape_rows()[edit.node.shape.kind].how == sdf::KindRow::Sampled ||
             sdf::shape_rows()[edit.node.shape.kind].how == sdf::KindRow::Formula);
    fill(sdf::shape_rows()[edit.node.shape.kind], edit.node.shape.params);
    edit.node.transform.position = {unit(), -unit(), unit() * 100};
    edit.node.transform.rotation = axis_angle({0, 1, 0}, unit());
    edit.node.transform.scale = {0.1f + unit(), 0.1f + unit(), 0.1f + unit()};
    edit.op = Op(int(unit() * 3.99f));
    edit.blend_radius = unit();
    edit.node.material = material;
    if (!world.add(edit)) return;
    auto again = World::parse(world.to_json(), "s.json");
    RC_ASSERT(bool(again));
    const Edit* read = again->find(*again->find_edit("e"));
    RC_ASSERT(read->node.shape == edit.node.shape);
    RC_ASSERT(read->node.transform.position == edit.node.transform.position);
    RC_ASSERT(read->node.transform.scale == edit.node.transform.scale);
    RC_ASSERT(read->op == edit.op);
    RC_ASSERT(again->to_json() == world.to_json());
}

}  // namespace
}  // namespace kiln::scene

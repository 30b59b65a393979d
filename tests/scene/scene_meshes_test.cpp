// SPDX-License-Identifier: MIT
// Starts threads.
// Meshes of scenes: what a frame gets of them, and that one that cannot be read takes nothing with it.
#include "model/drawable.h"
#include "temp_folder.h"

#include <kiln/world.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

namespace kiln {
namespace {

using testing::HasSubstr;

constexpr std::string_view kTetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

World load(const TempFolder& folder, const std::string& meshes) {
    std::ofstream(folder / "tet.obj") << kTetrahedron;
    std::ofstream(folder / "broken.glb") << "glTF and no more";
    std::ofstream(folder / "s.kiln.json")
        << "{\"format\":1,\"materials\":{\"red\":{\"base_color\":[0.9,0.1,0.1],\"roughness\":0.2}},"
           "\"edits\":[{\"shape\":\"sphere\"}],\n\"meshes\":["
        << meshes << "]}";
    auto world = World::load((folder / "s.kiln.json").string());
    EXPECT_TRUE(world) << (world ? "" : world.error().message);
    return std::move(*world);
}

TEST(SceneMeshes, AFrameHoldsThemWhereTheSceneHasThem) {
    const TempFolder folder;
    const World world =
        load(folder,
             "{\"id\":\"a\",\"file\":\"tet.obj\",\"position\":[1,2,3],\"scale\":2,\"material\":\"red\"},"
             "{\"id\":\"b\",\"file\":\"tet.obj\"},{\"id\":\"c\",\"file\":\"tet.obj\",\"hidden\":true}");
    EXPECT_TRUE(world.faults().empty());
    const auto frame = world.frame();
    ASSERT_TRUE(frame);
    ASSERT_EQ(frame->meshes.size(), 2u);
    EXPECT_EQ(frame->meshes[0].transform.position, (vec3{1, 2, 3}));
    EXPECT_EQ(frame->meshes[0].transform.scale, (vec3{2, 2, 2}));
    EXPECT_EQ(frame->meshes[0].before, frame->meshes[0].transform);
    EXPECT_EQ(frame->meshes[0].model->surfaces[0].base_color, (vec4{0.9f, 0.1f, 0.1f, 1}));
    EXPECT_EQ(frame->meshes[1].model->surfaces[0].base_color, (vec4{0.5f, 0.5f, 0.5f, 1}));
    EXPECT_EQ(frame->meshes[1].model->triangle_count(), 4u);
    EXPECT_THAT(world.inspect_json(), HasSubstr("\"triangles\": 4"));
    // Saving keeps them.
    EXPECT_THAT(world.to_json(), HasSubstr("\"material\": \"red\""));
}

TEST(SceneMeshes, OneThatCannotBeReadIsAnErrorWithItsPlaceAndTheRestIsDrawn) {
    const TempFolder folder;
    const World world = load(folder,
                             "{\"id\":\"a\",\"file\":\"none.glb\"},{\"id\":\"b\",\"file\":\"tet.obj\"},\n"
                             "{\"id\":\"c\",\"file\":\"broken.glb\"}");
    ASSERT_EQ(world.faults().size(), 2u);
    EXPECT_THAT(world.faults()[0], HasSubstr("s.kiln.json:2:28: meshes[0].file: "));
    EXPECT_THAT(world.faults()[0], HasSubstr("none.glb: cannot be read"));
    EXPECT_THAT(world.faults()[1], HasSubstr("s.kiln.json:3:18: meshes[2].file: "));
    EXPECT_THAT(world.faults()[1], HasSubstr("not a glTF file that can be read"));
    const auto frame = world.frame();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->meshes.size(), 1u);
}

TEST(SceneMeshes, AMaterialThatIsNotThereIsRefused) {
    const TempFolder folder;
    std::ofstream(folder / "s.kiln.json") << "{\"format\":1,\"materials\":{\"red\":{}},\"meshes\":[{\"id\":\"a\","
                                             "\"file\":\"x.glb\",\"material\":\"rod\"}]}";
    const auto world = World::load((folder / "s.kiln.json").string());
    ASSERT_FALSE(world);
    EXPECT_THAT(world.error().message, HasSubstr("meshes[0].material: "));
    EXPECT_THAT(world.error().message, HasSubstr("did you mean \"red\""));
}

TEST(SceneMeshes, TheWorkbenchComesWithItsEngine) {
    const auto world = World::load("workbench");
    ASSERT_TRUE(world);
    EXPECT_TRUE(world->faults().empty());
    auto frame = world->frame();
    ASSERT_TRUE(frame);
    ASSERT_EQ(frame->meshes.size(), 1u);
    const model::Drawable& engine = *frame->meshes[0].model;
    EXPECT_TRUE(engine.notes.empty());
    EXPECT_EQ(engine.duration, 2);
    // The first piston goes up and down by the throw of the crank, and the rod's end stays in it.
    for (const double t : {0.0, 0.25, 0.5, 1.1}) {
        const auto places = model::pose(engine, t);
        dvec3 rod{}, piston{};
        for (size_t n = 0; n < engine.nodes.size(); ++n) {
            if (engine.nodes[n].name == "rod") rod = model::transform_point(places[n], {0, 0.34, 0});
            if (engine.nodes[n].name == "piston") piston = model::transform_point(places[n], {0, 0, 0});
        }
        EXPECT_NEAR(rod.x, piston.x, 2e-3) << t;
        EXPECT_NEAR(rod.y, piston.y, 2e-3) << t;
    }
}

}  // namespace
}  // namespace kiln

// SPDX-License-Identifier: MIT

#include "scene/format.h"

#include "scene/scene_file.h"

#include <kiln/renderer.h>
#include <kiln/world.h>

#include <cstddef>

namespace kiln::scene {

namespace {

using sdf::FieldRow;

// Index of a float member in its struct, as FieldRow::offset counts.
#define KILN_AT(type, member) int(offsetof(type, member) / sizeof(float))
constexpr int kKept = -1;

constexpr KeyRow number(std::string_view name, int at, float value, std::string_view unit, std::string_view range,
                        std::string_view doc, uint8_t kinds = 0xff) {
    return {name, KeyType::Numbers, doc,   FieldRow{name, 1, at, {value, 0, 0}, unit, range, doc},
            {},   nullptr,          false, kinds};
}
constexpr KeyRow numbers(std::string_view name, int arity, int at, std::array<float, 3> values, std::string_view unit,
                         std::string_view range, std::string_view doc, uint8_t kinds = 0xff) {
    return {name, KeyType::Numbers, doc,   FieldRow{name, arity, at, values, unit, range, doc},
            {},   nullptr,          false, kinds};
}
constexpr KeyRow plain(std::string_view name, KeyType type, std::string_view doc) { return {name, type, doc}; }
constexpr KeyRow needed(KeyRow row) {
    row.required = true;
    return row;
}
constexpr KeyRow choice(std::string_view name, std::span<const std::string_view> choices, std::string_view doc) {
    return {name, KeyType::Choice, doc, {}, choices};
}
constexpr KeyRow inside(std::string_view name, KeyType type, const Table& table, std::string_view doc) {
    return {name, type, doc, {}, {}, &table};
}

constexpr std::string_view kOps[] = {"union", "subtract", "intersect", "paint"};
constexpr std::string_view kLights[] = {"directional", "point", "spot"};
constexpr std::string_view kToneMaps[] = {"none", "exponential", "aces", "neutral", "agx"};
constexpr std::string_view kBloomKinds[] = {"pyramid", "gaussian"};
constexpr std::string_view kAxes[] = {"x", "y", "z"};
constexpr std::string_view kMotions[] = {"static", "kinematic", "dynamic"};
constexpr std::string_view kCollisions[] = {"convex", "triangles"};
constexpr std::string_view kSurfaces[] = {"own", "materials"};
constexpr uint8_t kSun = 1, kBulbs = 6, kSpot = 4, kAimed = 5;

constexpr KeyRow kBoundsRows[] = {
    needed(numbers("min", 3, kKept, {-1, -1, -1}, "m", "any", "lowest corner")),
    needed(numbers("max", 3, kKept, {1, 1, 1}, "m", "any", "highest corner, above min on every axis")),
};
constexpr KeyRow kFieldRows[] = {
    number("voxel_size", KILN_AT(FieldSettings, voxel_size), 0.02f, "m", "> 0",
           "finest voxel; left out: the longest finite side / 256"),
    number("levels", kKept, 1, "1", "integer [1, 16]", "levels of detail, each with voxels twice as large"),
    number("cells", kKept, 64, "1", "integer [8, 512]", "bricks a side per level, a power of two"),
    inside(
        "bounds", KeyType::Object, kBoundsTable,
        "what the field covers; left out: the finite edits, inflated by 10 %, and as far as they blend with a ground"),
    plain("distance_8bit", KeyType::Bool, "bricks store distance in 8 bits instead of 16"),
};
constexpr KeyRow kMaterialRows[] = {
    numbers("base_color", 3, KILN_AT(Material, base_color), {0.5f, 0.5f, 0.5f}, "1", "[0, 1]", "linear Rec. 709"),
    number("roughness", KILN_AT(Material, roughness), 0.7f, "1", "[0, 1]", "perceptual: 0 is a mirror"),
    number("metallic", KILN_AT(Material, metallic), 0, "1", "[0, 1]", "1 for metals"),
    numbers("emissive", 3, KILN_AT(Material, emissive), {0, 0, 0}, "cd/m²", ">= 0",
            "light that the surface gives off, linear"),
    number("opacity", KILN_AT(Material, opacity), 1, "1", "(0, 1]",
           "share of light that does not go in; below 1 the rest goes through, bent and dimmed as the next three say"),
    number("ior", KILN_AT(Material, ior), 1.5f, "1", "[1, 4]",
           "index of refraction: glass 1.5, water 1.33, 1 bends nothing"),
    numbers("attenuation_color", 3, KILN_AT(Material, attenuation_color), {1, 1, 1}, "1", "[0, 1]",
            "what is left of white light after attenuation_distance inside, linear"),
    number("attenuation_distance", KILN_AT(Material, attenuation_distance), 0, "m", ">= 0",
           "0: nothing is lost inside"),
    number("friction", KILN_AT(Material, friction), 0.5f, "1", ">= 0", "of bodies that touch it"),
    number("restitution", KILN_AT(Material, restitution), 0, "1", "[0, 1]", "bounce: 1 loses nothing"),
    number("rolling_friction", KILN_AT(Material, rolling_friction), 0, "1", ">= 0",
           "tangent of the slope on which a ball begins to roll: sand 0.3, rock 0.05, steel 0.001"),
};

constexpr KeyRow kOutlineRows[] = {
    numbers("color", 3, KILN_AT(Outline, color), {1, 0.6f, 0}, "1", "[0, 1]", "linear Rec. 709"),
    number("width_px", KILN_AT(Outline, width_px), 3, "px", "(0, 64]", "width on the screen"),
};

#define KILN_NODE_ROWS                                                                                      \
    plain("shape", KeyType::Node, "a shape's name; its sizes are keys beside it"),                          \
        plain("object", KeyType::Node, "name of an object to place here"),                                  \
        numbers("position", 3, kKept, {0, 0, 0}, "m", "any", "of the local origin, in the parent's space"), \
        plain("rotation", KeyType::Rotation, "quaternion [x, y, z, w]"),                                    \
        plain("scale", KeyType::Scale, "a number or three, > 0"),                                           \
        plain("domain", KeyType::Node, "warps, from the bare shape outwards"),                              \
        plain("material", KeyType::Text, "name of a material; left out: the parent's, or what is there")

constexpr KeyRow kEditRows[] = {
    plain("id", KeyType::Text, "unique name; made up when left out"),
    KILN_NODE_ROWS,
    choice("op", kOps, "how the edit acts on all before it; left out: union"),
    number("blend_radius", kKept, 0, "m", ">= 0", "world metres: the difference of distances where blending begins"),
    number("material_blend_radius", kKept, 0, "m", ">= 0", "the same for materials; left out: blend_radius"),
    plain("dynamic", KeyType::Bool, "a hint that it moves often; never changes the picture"),
    plain("hidden", KeyType::Bool, "kept in the list, acts on nothing"),
    plain("group", KeyType::Text, "name of a group, for editors"),
    inside("outline", KeyType::Object, kOutlineTable, "a line around it on the screen"),
};
constexpr KeyRow kNodeRows[] = {
    KILN_NODE_ROWS,
    choice("op", kOps, "with children: how they fold, from left to right; left out: union"),
    number("blend_radius", kKept, 0, "m", ">= 0", "with children: of the fold, in the object's units"),
    number("material_blend_radius", kKept, 0, "m", ">= 0",
           "with children: the same for materials; left out: blend_radius"),
    plain("children", KeyType::Node, "nodes that fold from left to right"),
};

constexpr KeyRow kMeshRows[] = {
    needed(plain("id", KeyType::Text, "unique name")),
    needed(plain("file", KeyType::Text, ".glb, .gltf, .obj, .stl or .ply, relative to the scene file")),
    numbers("position", 3, kKept, {0, 0, 0}, "m", "any", "of the mesh's origin"),
    plain("rotation", KeyType::Rotation, "quaternion [x, y, z, w]"),
    plain("scale", KeyType::Scale, "a number or three, > 0"),
    plain("material", KeyType::Text, "name of a material instead of the file's; files without any are grey"),
    plain("hidden", KeyType::Bool, "kept, not drawn"),
    plain("group", KeyType::Text, "name of a group, for editors"),
    inside("outline", KeyType::Object, kOutlineTable, "a line around it on the screen"),
};
constexpr KeyRow kLightRows[] = {
    needed(choice("type", kLights, "kind of light: directional, point or spot")),
    numbers("color", 3, KILN_AT(Light, color), {1, 1, 1}, "1", ">= 0", "linear; scales the light"),
    numbers("direction", 3, KILN_AT(Light, direction), {-0.4f, -1, -0.3f}, "1", "any",
            "where the light goes; any length above 0", kAimed),
    numbers("position", 3, KILN_AT(Light, position), {0, 0, 0}, "m", "any", "of the lamp", kBulbs),
    number("illuminance", KILN_AT(Light, illuminance), 3, "lx", ">= 0", "on a surface that faces it", kSun),
    number("angular_diameter_deg", KILN_AT(Light, angular_diameter_deg), 0.53f, "deg", "[0, 90]",
           "disc seen from the ground; 0 for hard shadows", kSun),
    number("intensity", KILN_AT(Light, intensity), 20, "cd", ">= 0", "candela", kBulbs),
    number("range", KILN_AT(Light, range), 0, "m", ">= 0", "where the light has faded to nothing; 0 for no limit",
           kBulbs),
    number("radius", KILN_AT(Light, radius), 0, "m", ">= 0", "of the lamp; 0 for hard shadows", kBulbs),
    number("inner_deg", KILN_AT(Light, inner_deg), 15, "deg", "[0, 90]", "half angle of full light", kSpot),
    number("outer_deg", KILN_AT(Light, outer_deg), 25, "deg", "(0, 90]", "half angle where it ends, at least inner_deg",
           kSpot),
};
constexpr KeyRow kEnvironmentRows[] = {
    numbers("color", 3, KILN_AT(Environment, color), {0.5f, 0.6f, 0.8f}, "cd/m²", ">= 0", "radiance of a constant sky"),
    plain("file", KeyType::Text, "equirectangular OpenEXR image instead of the colour, its centre towards -Z"),
    number("intensity", KILN_AT(Environment, intensity), 1, "1", ">= 0", "multiplies it"),
};
constexpr KeyRow kCameraRows[] = {
    numbers("position", 3, KILN_AT(Camera, position), {3, 2, 4}, "m", "any", "of the eye"),
    numbers("target", 3, KILN_AT(Camera, target), {0, 0, 0}, "m", "any", "point in the middle of the picture"),
    numbers("up", 3, KILN_AT(Camera, up), {0, 1, 0}, "1", "any", "direction that is up in the picture"),
    number("fov_y_deg", KILN_AT(Camera, fov_y_deg), 45, "deg", "[1, 170]", "vertical field of view"),
    number("exposure", KILN_AT(Camera, exposure), 1, "1", "> 0", "linear multiplier before the tone map"),
    choice("tone_map", kToneMaps, "from light to the screen: none, exponential, aces, neutral or agx; left out: aces"),
    plain("auto_exposure", KeyType::Bool, "the picture's middle luminance becomes middle grey; exposure corrects it"),
    number("bloom", KILN_AT(Camera, bloom), 0, "1", "[0, 1]", "share of the light that the lens scatters"),
    number("bloom_size", KILN_AT(Camera, bloom_size), 0.1f, "1", "(0, 1]", "the widest glow, of the picture's height"),
    number("bloom_threshold", KILN_AT(Camera, bloom_threshold), 1, "1", ">= 0",
           "gaussian: what is brighter, exposed, glows"),
    choice("bloom_kind", kBloomKinds,
           "pyramid: glow of many sizes; gaussian: a blur of what is bright; left out: pyramid"),
};
constexpr KeyRow kPhysicsRows[] = {
    numbers("gravity", 3, KILN_AT(ScenePhysics, gravity), {0, -9.81f, 0}, "m/s²", "any", "acceleration"),
    number("step", KILN_AT(ScenePhysics, step), 0.0166666667f, "s", "(0, 1]", "fixed time step"),
    number("friction", KILN_AT(ScenePhysics, friction), 0.5f, "1", ">= 0", "of the world where no material says"),
    number("restitution", KILN_AT(ScenePhysics, restitution), 0, "1", "[0, 1]", "of the world where no material says"),
    number("rolling_friction", KILN_AT(ScenePhysics, rolling_friction), 0, "1", ">= 0",
           "of the world where no material says"),
};
constexpr KeyRow kBodyRows[] = {
    needed(plain("id", KeyType::Text, "unique name")),
    plain("edits", KeyType::TextList, "ids of the edits that are its shape"),
    plain("mesh", KeyType::Text, "id of the mesh that is its shape"),
    choice("collision", kCollisions,
           "of a mesh: convex or triangles; either collides as the solid that it bounds, triangles only where it is "
           "static"),
    choice("motion", kMotions, "static, kinematic or dynamic; left out: dynamic"),
    number("density", KILN_AT(SceneBody::Numbers, density), 1000, "kg/m³", "> 0", "of its solid"),
    number("friction", KILN_AT(SceneBody::Numbers, friction), 0.5f, "1", ">= 0", "of its surface"),
    number("restitution", KILN_AT(SceneBody::Numbers, restitution), 0, "1", "[0, 1]", "of its surface"),
    number("linear_damping", KILN_AT(SceneBody::Numbers, linear_damping), 0, "1/s", ">= 0", "share of velocity lost"),
    number("angular_damping", KILN_AT(SceneBody::Numbers, angular_damping), 0, "1/s", ">= 0", "share of spin lost"),
    plain("continuous", KeyType::Bool, "swept collision, for fast small bodies"),
    numbers("linear_velocity", 3, KILN_AT(SceneBody::Numbers, linear_velocity), {0, 0, 0}, "m/s", "any",
            "at the start, of the centre of mass"),
    numbers("angular_velocity", 3, KILN_AT(SceneBody::Numbers, angular_velocity), {0, 0, 0}, "rad/s", "any",
            "at the start"),
    number("rolling_friction", KILN_AT(SceneBody::Numbers, rolling_friction), 0, "1", ">= 0", "of its surface"),
    choice("surface", kSurfaces, "what it touches with: own, or materials where they say what it is; left out: own"),
    plain("settles", KeyType::Bool, "becomes ground where it has slept for two seconds, as what is cut loose does"),
};
constexpr KeyRow kTriggerRows[] = {
    needed(plain("id", KeyType::Text, "unique name")),
    needed(plain("object", KeyType::Text, "name of the object that is its region")),
    numbers("position", 3, KILN_AT(Transform, position), {0, 0, 0}, "m", "any", "of the object's origin"),
    plain("rotation", KeyType::Rotation, "quaternion [x, y, z, w]"),
    plain("scale", KeyType::Scale, "a number or three, > 0"),
};
constexpr KeyRow kWishRows[] = {
    needed(number("time", KILN_AT(SceneCharacter::Wish, time), 0, "s", ">= 0", "from when on it is wished")),
    numbers("direction", 3, KILN_AT(SceneCharacter::Wish, direction), {0, 0, 0}, "1", "any",
            "to walk in: its level part, of length 1 at most; 0 stands"),
    number("jump", KILN_AT(SceneCharacter::Wish, jump), 0, "m/s", ">= 0", "upwards, once, if it stands then"),
};
constexpr KeyRow kCharacterRows[] = {
    needed(plain("id", KeyType::Text, "unique name")),
    numbers("position", 3, KILN_AT(SceneCharacter::Numbers, position), {0, 0, 0}, "m", "any", "of its feet"),
    number("radius", KILN_AT(SceneCharacter::Numbers, radius), 0.3f, "m", "> 0", "of its capsule"),
    number("height", KILN_AT(SceneCharacter::Numbers, height), 1.7f, "m", "> 0", "of its capsule, from end to end"),
    number("speed", KILN_AT(SceneCharacter::Numbers, speed), 1.5f, "m/s", ">= 0", "of its walk"),
    number("step_height", KILN_AT(SceneCharacter::Numbers, step_height), 0.3f, "m", ">= 0", "that it steps onto"),
    number("steepest_deg", KILN_AT(SceneCharacter::Numbers, steepest_deg), 50, "deg", "[0, 89]",
           "of a floor that it stands on"),
    numbers("linear_velocity", 3, KILN_AT(SceneCharacter::Numbers, linear_velocity), {0, 0, 0}, "m/s", "any",
            "at the start; it is what it falls or rises with"),
    inside("path", KeyType::List, kWishTable, "what it wishes, by time; each holds until the next"),
};
constexpr KeyRow kClothRows[] = {
    needed(plain("id", KeyType::Text, "unique name")),
    numbers("size", 2, kKept, {1, 1, 0}, "m", "> 0", "along local X and Z"),
    numbers("resolution", 2, kKept, {32, 32, 0}, "1", "integer [2, 4096]", "points along X and Z"),
    numbers("position", 3, kKept, {0, 0, 0}, "m", "any", "of its centre"),
    plain("rotation", KeyType::Rotation, "quaternion [x, y, z, w]"),
    plain("pinned", KeyType::Pinned, "top (the -Z edge), corners (of that edge) or a list of [i, j]"),
    number("mass_per_area", kKept, 0.2f, "kg/m²", "> 0", "mass of a square metre"),
    number("stretch_compliance", kKept, 0, "m/N", ">= 0", "0 does not stretch"),
    number("bend_compliance", kKept, 1e-4f, "1/N", ">= 0", "0 does not bend"),
    number("damping", kKept, 0, "1/s", ">= 0", "share of velocity lost"),
    number("friction", kKept, 0.3f, "1", ">= 0", "on what it touches"),
    number("tear_strain", kKept, 0, "1", ">= 0", "strain at which it tears; 0 never"),
};
constexpr KeyRow kFluidRows[] = {
    needed(plain("id", KeyType::Text, "unique name")),
    needed(inside("box", KeyType::Object, kBoundsTable, "filled at the start")),
    number("particle_radius", kKept, 0.01f, "m", "> 0", "half the spacing of particles"),
    number("density", kKept, 1000, "kg/m³", "> 0", "at rest"),
    number("viscosity", kKept, 0.001f, "Pa s", ">= 0", "dynamic viscosity"),
    number("surface_tension", kKept, 0.07f, "N/m", ">= 0", "of its surface"),
    numbers("color", 3, kKept, {0.3f, 0.6f, 0.8f}, "1", "[0, 1]", "linear Rec. 709"),
    plain("emitters", KeyType::List, "where particles come from: a list of anything, kept as it is"),
    plain("drains", KeyType::List, "where particles go: a list of anything, kept as it is"),
};
constexpr KeyRow kSceneRows[] = {
    plain("$schema", KeyType::Text, "where the schema is, for text editors"),
    needed(number("format", kKept, 1, "1", "integer [1, 1]", "version of the format")),
    plain("description", KeyType::Text, "one line about the scene"),
    inside("field", KeyType::Object, kFieldTable, "resolution and extent of the bricks"),
    inside("materials", KeyType::Map, kMaterialTable, "surfaces by name"),
    inside("objects", KeyType::Map, kNodeTable, "reusable trees by name; drawn only where an edit places them"),
    inside("edits", KeyType::List, kEditTable, "the world: each acts on all before it"),
    inside("meshes", KeyType::List, kMeshTable, "triangle meshes"),
    inside("lights", KeyType::List, kLightTable, "left out: a sun, unless an image of the sky has its own"),
    inside("environment", KeyType::Object, kEnvironmentTable,
           "the sky; left out: a clear one, with the disc of the first sun"),
    inside("cameras", KeyType::Map, kCameraTable, "by name, the first is the default; left out: the scene is framed"),
    inside("physics", KeyType::Object, kPhysicsTable, "of the whole world"),
    inside("bodies", KeyType::List, kBodyTable, "rigid bodies"),
    inside("triggers", KeyType::List, kTriggerTable, "regions that tell who enters and leaves"),
    inside("characters", KeyType::List, kCharacterTable, "capsules that walk"),
    inside("cloths", KeyType::List, kClothTable, "rectangles of cloth"),
    inside("fluids", KeyType::List, kFluidTable, "particle fluids"),
    numbers("wind", 3, kKept, {0, 0, 0}, "m/s", "any", "on cloth and fluid"),
};

}  // namespace

const std::span<const std::string_view> kOpNames = kOps, kLightNames = kLights, kToneMapNames = kToneMaps,
                                        kBloomKindNames = kBloomKinds, kAxisNames = kAxes, kMotionNames = kMotions;

const Table kSceneTable{"scene", "A Kiln scene, format 1", kSceneRows};
const Table kFieldTable{"field", "Resolution and extent of the field", kFieldRows};
const Table kBoundsTable{"bounds", "A box in world metres", kBoundsRows};
const Table kMaterialTable{"material", "glTF 2.0 metallic-roughness, linear", kMaterialRows};
const Table kLightTable{"light", "A light", kLightRows};
const Table kEnvironmentTable{"environment", "The sky", kEnvironmentRows};
const Table kCameraTable{"camera", "A camera", kCameraRows};
const Table kEditTable{"edit", "A shape or an object, and how it acts on all edits before it", kEditRows};
const Table kNodeTable{"node", "A shape, an object, or a fold of children", kNodeRows};
const Table kOutlineTable{"outline", "A line around something on the screen", kOutlineRows};
const Table kMeshTable{"mesh", "A triangle mesh", kMeshRows};
const Table kPhysicsTable{"physics", "Physics of the world", kPhysicsRows};
const Table kBodyTable{"body", "A rigid body", kBodyRows};
const Table kTriggerTable{"trigger", "A region that tells who enters and leaves", kTriggerRows};
const Table kWishTable{"wish", "Where a character wishes to go", kWishRows};
const Table kCharacterTable{"character", "An upright capsule that walks", kCharacterRows};
const Table kClothTable{"cloth", "A rectangle of cloth in its local XZ plane", kClothRows};
const Table kFluidTable{"fluid", "A particle fluid", kFluidRows};

const KeyRow* find_row(const Table& table, std::string_view key) {
    for (const KeyRow& row : table.rows)
        if (row.name == key) return &row;
    return nullptr;
}

}  // namespace kiln::scene

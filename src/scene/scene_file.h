// SPDX-License-Identifier: MIT
// Scene files: NAME.kiln.json to data and back. Nothing is compiled or drawn here.
#pragma once

#include "scene/json_source.h"
#include "sdf/program.h"

#include <kiln/world.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

namespace kiln::scene {

/// From names to numbers; asked with string views.
struct TextHash {
    using is_transparent = void;
    size_t operator()(std::string_view text) const { return std::hash<std::string_view>()(text); }
};
using NameNumbers = std::unordered_map<std::string, uint32_t, TextHash, std::equal_to<>>;

/// Section "physics". Frictions and restitution are those of the world's surface.
struct ScenePhysics {
    vec3 gravity{0, -9.81f, 0};
    float step = 0.0166666667f;  ///< seconds
    float friction = 0.5f, restitution = 0, rolling_friction = 0;
};

/// An entry of "bodies".
struct SceneBody {
    static constexpr JsonIndex kNowhere = UINT32_MAX;
    struct Numbers {
        float density = 1000, friction = 0.5f, restitution = 0, linear_damping = 0, angular_damping = 0;
        vec3 linear_velocity{}, angular_velocity{};
        float rolling_friction = 0;
    };
    enum class Motion : uint8_t { Static, Kinematic, Dynamic };
    std::string id;
    std::vector<std::string> edits;  ///< names; empty for the body of a mesh
    std::string mesh;                ///< the id of one of `meshes`; empty for the body of edits
    Motion motion = Motion::Dynamic;
    bool continuous = false;
    Numbers numbers;
    JsonIndex place = kNowhere;
    std::string collision{};    ///< as the file says it
    bool of_materials = false;  ///< its surface is that of its materials, where they say what it is
    bool settles = false;       ///< it becomes ground where it has slept for a while, as what was cut loose does
};

/// An entry of "triggers".
struct SceneTrigger {
    std::string id;
    ObjectId object;
    Transform transform;
    JsonIndex place = 0;
};

/// An entry of "characters".
struct SceneCharacter {
    struct Numbers {
        vec3 position{};  ///< of its feet
        float radius = 0.3f, height = 1.7f, speed = 1.5f, step_height = 0.3f, steepest_deg = 50;
        vec3 linear_velocity{};  ///< at the start
    };
    struct Wish {
        float time = 0;
        vec3 direction{};
        float jump = 0;
    };
    std::string id;
    Numbers numbers;
    std::vector<Wish> path;  ///< by ascending time
    JsonIndex place = SceneBody::kNowhere;
};

/// An entry of "meshes". Saving keeps it as its file has it.
struct SceneMesh {
    std::string id, file;
    std::string material;  ///< of the scene, instead of the file's; empty: the file's own
    Transform transform;
    bool hidden = false;
    JsonIndex place = SceneBody::kNowhere;
    std::optional<Outline> outline{};
    std::string group{};
};

/// A scene as data. `source` is the document it came from (empty for worlds made by code): saving keeps its key order, its
/// sections that the engine does not act on yet, and how it wrote what has two forms.
struct SceneData {
    /// What a program may change freely: World's public members.
    struct Stage {
        FieldSettings field;
        std::vector<Light> lights;
        std::optional<Environment> environment;
        std::vector<std::pair<std::string, Camera>> cameras;
    };

    JsonDocument source;
    std::string folder;  ///< paths in the scene are relative to it; empty: the current folder
    std::string description;
    Stage stage;
    std::vector<std::pair<std::string, Material>> materials;  ///< MaterialId::index refers here
    /// By material: what its file says nothing of, so that the scene's own counts. Those added later say everything.
    struct Silent {
        bool friction = false, restitution = false, rolling_friction = false;
    };
    std::vector<Silent> silent;
    std::vector<Object> objects;  ///< ObjectId::index refers here
    std::vector<Edit> edits;
    NameNumbers material_numbers, object_numbers;
    ScenePhysics physics;
    std::vector<SceneBody> bodies;
    std::vector<SceneTrigger> triggers;
    std::vector<SceneCharacter> characters;
    std::vector<SceneMesh> meshes;

    // Where things stand in `source`; kNowhere for what was added later.
    static constexpr JsonIndex kNowhere = UINT32_MAX;
    std::vector<JsonIndex> edit_places;
    std::vector<std::vector<JsonIndex>> object_places;  ///< by object, by node

    /// Sections with content that this version keeps but does not draw, "bodies", "cloths", …
    std::vector<std::string> undrawn;
};

/// Errors read "NAME:LINE:COLUMN: path.to.key: what is wrong; what would be right".
Result<SceneData> read_scene(std::string text, const std::string& name);
/// Reads one member of an object that is no whole scene into `scene.stage`: field, lights, environment or cameras.
std::optional<Error> read_section(SceneData& scene, const JsonDocument& doc, JsonIndex object, JsonIndex section);

/// An edit, and where it stands in the scene's source.
struct PlacedEdit {
    const Edit* edit;
    JsonIndex place;
};
/// The scene as it is saved, its edits given apart. Canonical: reading it and writing it again gives the same bytes.
std::string write_scene(const SceneData& scene, const SceneData::Stage& stage, std::span<const PlacedEdit> edits);
std::string write_scene(const SceneData& scene, const SceneData::Stage& stage);
/// The same as if it had been made by code: no default is spelled out, keys stand in the order of the tables. Sections that are only kept
/// are as they were.
JsonDocument plain_document(const SceneData& scene, const SceneData::Stage& stage, std::span<const PlacedEdit> edits);

/// A fault of one edit or object given by code; nothing when the reader would accept it.
std::optional<Error> check_edit(const Edit& edit, size_t objects, size_t materials);
std::optional<Error> check_object(const Object& object, size_t objects, size_t materials);
std::optional<Error> check_material(const std::string& name, const Material& material);

/// The edit as it reads back from a file: unit rotation, no -0, nothing in what no key holds. Worlds hold such edits only, so that one
/// read from a file or a journal has the same bits as the one that was written.
void make_canonical(Edit& edit);
void make_canonical(Object& object);
void make_canonical(Material& material);

}  // namespace kiln::scene

// SPDX-License-Identifier: MIT
// Commands: every change of a world as data. Their JSON is made and read by the tables and texts of the scene format, so a command holds
// an edit, a material or a section exactly as a scene does:
//   {"add": EDIT, "before": ID}       {"change": EDIT, "was": ID}     {"remove": ID}     {"reorder": ID, "before": ID}
//   {"materials": {NAME: MATERIAL}}   {"objects": {NAME: TREE}}       null takes the last one away again
//   {"field": …}  {"lights": […]}  {"environment": … or null}  {"cameras": {…}}          the whole section
//   {"meshes": […]}  {"bodies": […]}  {"characters": […]}                                likewise
#pragma once

#include "scene/scene_file.h"

#include <kiln/world.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace kiln::scene {

enum class CommandKind : uint8_t {
    Add,
    Change,
    Remove,
    Reorder,
    Material,
    Object,
    Field,
    Lights,
    Environment,
    Cameras,
    Meshes,
    Bodies,
    Characters
};
/// The key that says which it is: "add", …, "materials", ….
std::string_view command_key(CommandKind kind);

/// A command as it was read.
struct Command {
    CommandKind kind = CommandKind::Add;
    std::string id;                    ///< of the edit (Change: before it), of the material or object
    std::string before;                ///< Add, Reorder: the edit to stand before; empty: at the end
    std::unique_ptr<Edit> edit;        ///< Add, Change
    std::optional<Material> material;  ///< none: taken away
    std::optional<Object> object;      ///< none: taken away
    SceneData::Stage stage;            ///< the section of Field, Lights, Environment or Cameras
    std::vector<SceneMesh> meshes{};   ///< Meshes, Bodies, Characters
    std::vector<SceneBody> bodies{};
    std::vector<SceneCharacter> characters{};
};

/// What the names in a command mean.
struct CommandNames {
    const NameNumbers& materials;
    const NameNumbers& objects;
    std::function<const Edit*(std::string_view)> edit;  ///< null: there is none
    const SceneData* scene = nullptr;                   ///< whose meshes, bodies and characters are meant
};

/// Errors are those of scenes: "NAME:LINE:COLUMN: add.radius: what; what would be right".
Result<Command> read_command(std::string text, const std::string& name, const CommandNames& names);
/// The command at a value of a document.
Result<Command> read_command(const JsonDocument& doc, JsonIndex at, const CommandNames& names);

/// What is wrong with it whatever world it is for; nothing where a world must say.
std::optional<Error> command_fault(const JsonDocument& doc, JsonIndex at);

/// A command to be written. What it holds of materials and objects is named by `scene`.
struct CommandView {
    CommandKind kind;
    std::string_view id{}, before{};     ///< as in Command
    const Edit* edit = nullptr;          ///< Add, Change
    const Material* material = nullptr;  ///< null: taken away
    const Object* object = nullptr;      ///< null: taken away
};
/// One line without its end.
std::string write_command(const SceneData& scene, const SceneData::Stage& stage, const CommandView& command);

}  // namespace kiln::scene

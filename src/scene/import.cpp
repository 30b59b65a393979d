// SPDX-License-Identifier: MIT
// A model file becomes a scene with one mesh edit. The model stays where it is; the scene names it relative to itself.

#include "scene/framing.h"
#include "scene/world_impl.h"

#include "model/triangles.h"

#include <filesystem>
#include <numbers>

namespace kiln {

Result<World> World::import(const std::string& model, const std::string& scene, const ImportSettings& settings) {
    namespace fs = std::filesystem;
    if (fs::path(model).extension() == ".csg")
        return Error{model + ": OpenSCAD trees come with a later version; export the model as .stl", ErrorKind::Usage};
    if (!model::has_model_ending(model))
        return Error{
            model + ": not a kind of model that is read; the name must end in " + std::string(model::kModelEndings),
            ErrorKind::Usage};
    if (!(settings.unit >= 1e-6f && settings.unit <= 1e6f))
        return Error{"import: a unit is between 0.000001 and 1000000 metres", ErrorKind::Usage};
    if (settings.resolution < 8 || settings.resolution > 512)
        return Error{"import: resolution must be in [8, 512]", ErrorKind::Usage};

    World world;
    std::error_code failed;
    const fs::path file = fs::absolute(model, failed);
    fs::path relative = fs::proximate(file, fs::absolute(scene, failed).parent_path(), failed);
    if (failed || relative.empty()) relative = file;
    if (const size_t slash = scene.find_last_of('/'); slash != std::string::npos)
        world.impl_->data.folder = scene.substr(0, slash + 1);

    Edit edit;
    edit.name = file.stem().string();
    edit.node.shape = SampledMesh{.resolution = float(settings.resolution)};
    edit.node.shape.data = relative.generic_string();
    edit.node.transform.scale = {settings.unit, settings.unit, settings.unit};
    // From +Z up to +Y up: a quarter turn about X.
    constexpr float kHalf = std::numbers::sqrt2_v<float> / 2;
    if (settings.z_up) edit.node.transform.rotation = {-kHalf, 0, 0, kHalf};
    edit.node.material = world.add_material(edit.name, Material{});
    const std::string edit_place = edit.name + ": ";
    if (auto added = world.add(std::move(edit)); !added) {
        std::string message = added.error().message;
        if (message.starts_with(edit_place)) message.erase(0, edit_place.size());  // the caller knows of no edit
        return Error{std::move(message), ErrorKind::Input};
    }
    world.cameras.emplace_back("main", scene::framing_camera(world.bounds()));
    return world;
}

}  // namespace kiln

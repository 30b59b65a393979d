// SPDX-License-Identifier: MIT
#include "scene/scene_meshes.h"

#include "scene/bundled.h"

#include <map>

namespace kiln::scene {
namespace {

// The same model in one of the scene's materials.
std::shared_ptr<const model::Drawable> painted(const model::Drawable& drawable, const Material& m) {
    auto out = std::make_shared<model::Drawable>(drawable);
    for (model::Surface& s : out->surfaces) {
        const bool two = s.double_sided;
        s = {};
        s.double_sided = two;
        s.base_color = {m.base_color.x, m.base_color.y, m.base_color.z, m.opacity};
        s.blend = m.opacity < 1;
        s.metallic = m.metallic;
        s.roughness = m.roughness;
        s.emissive = m.emissive;
    }
    for (model::Vertex& v : out->vertices) v.color = {1, 1, 1, 1};
    return out;
}

}  // namespace

SceneMeshes load_meshes(const SceneData& scene) {
    SceneMeshes out;
    std::map<std::string, Result<std::shared_ptr<const model::Drawable>>> files;
    for (const SceneMesh& mesh : scene.meshes) {
        auto known = files.find(mesh.file);
        if (known == files.end()) {
            const std::string path = mesh.file.starts_with('/') ? mesh.file : scene.folder + mesh.file;
            const auto bundled = bundled_model(scene, mesh.file);
            auto read = bundled.empty()
                            ? model::read_drawable(path)
                            : model::parse_gltf_drawable(
                                  {reinterpret_cast<const char*>(bundled.data()), bundled.size()}, mesh.file, "");
            if (read) {
                out.notes.insert(out.notes.end(), read->notes.begin(), read->notes.end());
                known = files.emplace(mesh.file, std::make_shared<const model::Drawable>(std::move(*read))).first;
            } else {
                known = files.emplace(mesh.file, read.error()).first;
            }
        }
        if (!known->second) {
            const std::string& why = known->second.error().message;
            if (mesh.place == SceneData::kNowhere) {
                out.faults.push_back(mesh.id + ": " + why);
            } else {
                const auto at = scene.source.find(mesh.place, "file");
                out.faults.push_back(scene.source.error(at ? *at : mesh.place, why).message);
            }
            out.models.emplace_back();
            continue;
        }
        const auto material =
            mesh.material.empty() ? scene.material_numbers.end() : scene.material_numbers.find(mesh.material);
        out.models.push_back(material == scene.material_numbers.end()
                                 ? *known->second
                                 : painted(**known->second, scene.materials[material->second].second));
    }
    return out;
}

std::vector<MeshInstance> SceneMeshes::instances(const SceneData& scene) const {
    std::vector<MeshInstance> out;
    for (size_t i = 0; i < models.size(); ++i)
        if (drawn(scene, i))
            out.push_back({models[i], scene.meshes[i].transform, scene.meshes[i].transform, scene.meshes[i].outline});
    return out;
}

Box3 SceneMeshes::bounds(const SceneData& scene) const {
    Box3 out;
    for (const MeshInstance& mesh : instances(scene)) {
        const Box3 b = model::bounds_of(*mesh.model);
        const model::Matrix place = model::matrix_of(mesh.transform);
        for (int corner = 0; corner < 8 && !b.empty(); ++corner) {
            const dvec3 q = model::transform_point(
                place, {double(corner & 1 ? b.max.x : b.min.x), double(corner & 2 ? b.max.y : b.min.y),
                        double(corner & 4 ? b.max.z : b.min.z)});
            const vec3 at{float(q.x), float(q.y), float(q.z)};
            out = box_union(out, {at, at});
        }
    }
    return out;
}

}  // namespace kiln::scene

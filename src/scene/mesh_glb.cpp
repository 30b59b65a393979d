// SPDX-License-Identifier: MIT
// The container is a header and two chunks, so it is written here: a glTF library would add images and copies of every buffer.
#include "scene/mesh_file.h"

#include <kiln/world.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <bit>
#include <cstring>

namespace kiln::scene {
namespace {

using Json = nlohmann::ordered_json;

static_assert(std::endian::native == std::endian::little, "glTF, STL and PLY below are little-endian");

enum : int { kFloat = 5126, kUnsigned = 5125, kVertices = 34962, kIndices = 34963 };

class Body {
public:
    Json views = Json::array(), accessors = Json::array();

    template <typename T>
    size_t view(const std::vector<T>& values, int target) {
        views.push_back({{"buffer", 0},
                         {"byteOffset", bytes_.size()},
                         {"byteLength", values.size() * sizeof(T)},
                         {"target", target}});
        bytes_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
        return views.size() - 1;
    }
    size_t accessor(size_t view, size_t offset, int component, size_t count, const char* type) {
        accessors.push_back({{"bufferView", view},
                             {"byteOffset", offset},
                             {"componentType", component},
                             {"count", count},
                             {"type", type}});
        return accessors.size() - 1;
    }
    template <typename T>
    size_t attribute(const std::vector<T>& values) {
        return accessor(view(values, kVertices), 0, kFloat, values.size(), sizeof(T) == 4 ? "SCALAR" : "VEC3");
    }
    const std::string& bytes() const { return bytes_; }

private:
    std::string bytes_;
};

Json three(vec3 v) { return {v.x, v.y, v.z}; }

Json material_json(const MeshPart& part, const std::string& name) {
    const Material& m = part.material;
    const auto unit = [](float v) { return std::clamp(v, 0.0f, 1.0f); };
    const vec3 base = part.blended ? vec3{1, 1, 1} : m.base_color;
    Json out{{"name", name},
             {"pbrMetallicRoughness",
              {{"baseColorFactor", {unit(base.x), unit(base.y), unit(base.z), unit(m.opacity)}},
               {"metallicFactor", unit(m.metallic)},
               {"roughnessFactor", unit(m.roughness)}}}};
    const float most = std::max({m.emissive.x, m.emissive.y, m.emissive.z});
    if (most > 0) {
        out["emissiveFactor"] = three(most > 1 ? m.emissive / most : m.emissive);
        if (most > 1) out["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = most;
    }
    if (m.opacity < 1) out["alphaMode"] = "BLEND";
    return out;
}

void append_word(std::string& out, uint32_t word) { out.append(reinterpret_cast<const char*>(&word), 4); }

}  // namespace

Result<std::string> encode_glb(const Mesh& mesh) {
    Body body;
    const bool blended = std::any_of(mesh.parts.begin(), mesh.parts.end(), [](const MeshPart& p) { return p.blended; });
    Json attributes{{"POSITION", body.attribute(mesh.positions)}};
    Box3 box;
    for (const vec3 p : mesh.positions) box = box_union(box, {p, p});
    body.accessors[0]["min"] = three(box.min);
    body.accessors[0]["max"] = three(box.max);
    if (!mesh.normals.empty()) {
        // Unit length is the format's law: where the field has no gradient any direction is as good.
        std::vector<vec3> normals = mesh.normals;
        for (vec3& n : normals)
            if (n == vec3{}) n = {0, 1, 0};
        attributes["NORMAL"] = body.attribute(normals);
    }
    Json seam_attributes = attributes;
    if (blended) {
        seam_attributes["COLOR_0"] = body.attribute(mesh.colors);
        seam_attributes["_ROUGHNESS"] = body.attribute(mesh.roughness);
        seam_attributes["_METALLIC"] = body.attribute(mesh.metallic);
    }
    const size_t indices = body.view(mesh.triangles, kIndices);
    Json primitives = Json::array(), materials = Json::array();
    const std::vector<std::string> names = part_names(mesh);
    bool strength = false;
    for (size_t i = 0; i < mesh.parts.size(); ++i) {
        const MeshPart& part = mesh.parts[i];
        materials.push_back(material_json(part, names[i]));
        strength = strength || materials.back().contains("extensions");
        primitives.push_back(
            {{"attributes", part.blended ? seam_attributes : attributes},
             {"indices", body.accessor(indices, size_t(part.first) * 12, kUnsigned, size_t(part.count) * 3, "SCALAR")},
             {"material", i}});
    }
    Json json{{"asset", {{"version", "2.0"}, {"generator", "Kiln " + std::string(version())}}}};
    if (strength) json["extensionsUsed"] = {"KHR_materials_emissive_strength"};
    json["scene"] = 0;
    json["scenes"] = {{{"nodes", {0}}}};
    json["nodes"] = {{{"name", "world"}, {"mesh", 0}}};
    json["meshes"] = {{{"name", "world"}, {"primitives", primitives}}};
    json["materials"] = materials;
    json["accessors"] = body.accessors;
    json["bufferViews"] = body.views;
    json["buffers"] = {{{"byteLength", body.bytes().size()}}};

    std::string text = json.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const uint64_t total = 12 + 8 + text.size() + 8 + body.bytes().size();
    if (total > UINT32_MAX)
        return Error{"a .glb holds at most 4 GiB; choose larger cells, or write .ply", ErrorKind::Failed};
    std::string out;
    out.reserve(size_t(total));
    append_word(out, 0x46546c67);  // "glTF"
    append_word(out, 2);
    append_word(out, uint32_t(total));
    append_word(out, uint32_t(text.size()));
    append_word(out, 0x4e4f534a);  // "JSON"
    out += text;
    append_word(out, uint32_t(body.bytes().size()));
    append_word(out, 0x004e4942);  // "BIN"
    out += body.bytes();
    return out;
}

}  // namespace kiln::scene

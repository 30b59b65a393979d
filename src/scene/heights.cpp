// SPDX-License-Identifier: MIT

#include "scene/heights.h"

#include "scene/region.h"

#include "sdf/expression_code.h"
#include "sdf/tables.h"

#include <kiln/shapes.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace kiln::scene {

namespace {

bool has_file(const Node& node) {
    if (node.kind != Node::Kind::Shape || node.shape.kind >= sdf::shape_rows().size()) return false;
    const sdf::KindRow::How how = sdf::shape_rows()[node.shape.kind].how;
    return how == sdf::KindRow::Sampled ||
           (how == sdf::KindRow::Formula && node.shape.data.starts_with(sdf::kModelFile));
}

Result<std::string> read_model(const std::string& path) {
    constexpr std::uintmax_t kMostBytes = std::uintmax_t(16) << 20;
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(path, error);
    std::ifstream in(path, std::ios::binary);
    if (error || !in) return Error{path + ": cannot be read; check the name", ErrorKind::Input};
    if (bytes > kMostBytes) return Error{path + ": longer than 16 MiB; use a smaller model", ErrorKind::Input};
    std::string text(size_t(bytes), '\0');
    in.read(text.data(), std::streamsize(text.size()));
    if (!in) return Error{path + ": cannot be read to its end", ErrorKind::Input};
    return text;
}

// The numbers of a mesh shape by their names.
SampledMesh mesh_fields(const Shape& shape) {
    SampledMesh out;
    for (const sdf::FieldRow& field : sdf::shape_rows()[shape.kind].fields()) {
        if (field.name == "resolution") out.resolution = shape.params[size_t(field.offset)];
        if (field.name == "closed") out.closed = shape.params[size_t(field.offset)];
    }
    return out;
}

bool is_mesh(const Node& node) { return ShapeKind(node.shape.kind) == ShapeKind::SampledMesh; }

std::string in_folder(const std::string& folder, const std::string& file) {
    return file.starts_with('/') ? file : folder + file;
}

// Reads and bakes what is not there yet.
Result<uint32_t> mesh_number(const Shape& shape, const std::string& folder, Grids& grids) {
    const SampledMesh fields = mesh_fields(shape);
    const auto key = std::pair(shape.data, int(fields.resolution));
    const auto found = grids.by_mesh.find(key);
    if (found != grids.by_mesh.end()) {
        bool& claimed = grids.mesh_notes[found->second].report.claimed_closed;
        claimed = claimed || fields.closed != 0;
        return found->second;
    }
    if (is_region(shape.data)) {
        const auto mask = read_region(shape.data);
        if (!mask) return mask.error();
        const auto index = uint32_t(grids.meshes.size());
        grids.meshes.push_back(region_grid(*mask));
        grids.mesh_notes.push_back({shape.data, key.second, {}});
        grids.by_mesh.emplace(key, index);
        return index;
    }
    const std::string path = in_folder(folder, shape.data);
    const auto mesh = model::read(path);
    if (!mesh) return mesh.error();
    auto baked = model::bake(*mesh, path, {.resolution = key.second, .closed = fields.closed != 0});
    if (!baked) return baked.error();
    const auto index = uint32_t(grids.meshes.size());
    grids.meshes.push_back(std::move(baked->grid));
    grids.mesh_notes.push_back({shape.data, key.second, std::move(baked->report)});
    grids.by_mesh.emplace(key, index);
    return index;
}

}  // namespace

Result<GridSource> with_grids(std::span<const Edit> edits, const std::vector<Object>& objects,
                              const std::string& folder, Grids& grids, sdf::Fault* fault) {
    GridSource out;
    out.edits = edits;
    out.objects = objects;
    out.grids = &grids;
    const auto in_object = [](const Object& o) { return std::any_of(o.nodes.begin(), o.nodes.end(), has_file); };
    const bool any = std::any_of(edits.begin(), edits.end(), [](const Edit& e) { return has_file(e.node); }) ||
                     std::any_of(objects.begin(), objects.end(), in_object);
    if (!any) return out;
    out.own_edits.assign(edits.begin(), edits.end());
    out.own_objects = objects;
    const auto number = [&](Node& node, sdf::Fault where) -> Result<void> {
        if (!has_file(node)) return {};
        if (is_mesh(node)) {
            const auto index = mesh_number(node.shape, folder, grids);
            if (!index) {
                if (fault) *fault = where;
                return index.error();
            }
            node.shape.data = std::to_string(*index);
            return {};
        }
        if (node.shape.data.starts_with(sdf::kModelFile)) {
            const std::string name = node.shape.data.substr(sdf::kModelFile.size());
            auto model = grids.models.find(name);
            if (model == grids.models.end()) {
                auto text = read_model(in_folder(folder, name));
                if (!text) {
                    if (fault) *fault = where;
                    return text.error();
                }
                model = grids.models.emplace(name, std::move(*text)).first;
            }
            node.shape.data = (name.ends_with(".vm") ? std::string(sdf::kModelText) : std::string()) + model->second;
            return {};
        }
        auto found = grids.by_file.find(node.shape.data);
        if (found == grids.by_file.end()) {
            auto grid = load_heights(in_folder(folder, node.shape.data));
            if (!grid) {
                if (fault) *fault = where;
                return grid.error();
            }
            found = grids.by_file.emplace(node.shape.data, uint32_t(grids.grids.size())).first;
            grids.grids.push_back(std::move(*grid));
        }
        node.shape.data = std::to_string(found->second);
        return {};
    };
    for (uint32_t e = 0; e < out.own_edits.size(); ++e) {
        sdf::Fault where;
        where.edit = e;
        if (auto ok = number(out.own_edits[e].node, where); !ok) return ok.error();
    }
    for (uint32_t o = 0; o < out.own_objects.size(); ++o) {
        for (uint32_t n = 0; n < out.own_objects[o].nodes.size(); ++n) {
            sdf::Fault where;
            where.object = o;
            where.node = n;
            if (auto ok = number(out.own_objects[o].nodes[n], where); !ok) return ok.error();
        }
    }
    out.edits = out.own_edits;
    out.objects = out.own_objects;
    return out;
}

}  // namespace kiln::scene

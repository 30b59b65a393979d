// SPDX-License-Identifier: MIT

#include "scene/heights.h"

#include "sdf/expression_code.h"
#include "sdf/tables.h"

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
        if (node.shape.data.starts_with(sdf::kModelFile)) {
            const std::string name = node.shape.data.substr(sdf::kModelFile.size());
            auto model = grids.models.find(name);
            if (model == grids.models.end()) {
                auto text = read_model(name.starts_with('/') ? name : folder + name);
                if (!text) {
                    if (fault) *fault = where;
                    return text.error();
                }
                model = grids.models.emplace(name, std::move(*text)).first;
            }
            node.shape.data = std::string(sdf::kModelText) + model->second;
            return {};
        }
        auto found = grids.by_file.find(node.shape.data);
        if (found == grids.by_file.end()) {
            const bool absolute = node.shape.data.starts_with('/');
            auto grid = load_heights(absolute ? node.shape.data : folder + node.shape.data);
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

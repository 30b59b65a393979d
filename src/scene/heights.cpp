// SPDX-License-Identifier: MIT

#include "scene/heights.h"

#include "sdf/tables.h"

#include <algorithm>

namespace kiln::scene {

namespace {

bool has_file(const Node& node) {
    return node.kind == Node::Kind::Shape && node.shape.kind < sdf::shape_rows().size() &&
           sdf::shape_rows()[node.shape.kind].how == sdf::KindRow::Sampled;
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

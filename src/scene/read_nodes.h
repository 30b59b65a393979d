// SPDX-License-Identifier: MIT
// Reads edits and object trees. Trees may be nested as deep as memory allows.
#pragma once

#include "scene/read_values.h"
#include "scene/scene_file.h"

#include <string_view>
#include <unordered_map>

namespace kiln::scene {

class NodeReader {
public:
    /// `scene` has its materials already; objects and edits are added to it.
    NodeReader(ValueReader& values, SceneData& scene) : in_(values), scene_(scene) {}

    bool materials_by_name(std::optional<JsonIndex> section);
    bool objects(JsonIndex section);
    bool edits(JsonIndex section);

private:
    bool object_tree(JsonIndex at, Object& out, std::vector<JsonIndex>& places);
    bool node(JsonIndex at, Node& out, Edit* edit);
    bool shape(JsonIndex at, JsonIndex name, Node& out);
    bool domain(JsonIndex at, std::vector<Warp>& out);
    bool no_cycles(JsonIndex section);
    bool unknown_node_key(JsonIndex member, const Table& table, const Node& node);

    ValueReader& in_;
    SceneData& scene_;
    std::unordered_map<std::string_view, uint32_t> materials_, objects_;
};

}  // namespace kiln::scene

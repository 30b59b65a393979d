// SPDX-License-Identifier: MIT
// Reads edits and object trees. Trees may be nested as deep as memory allows.
#pragma once

#include "scene/read_values.h"
#include "scene/scene_file.h"

#include <string_view>

namespace kiln::scene {

class NodeReader {
public:
    /// What edits and trees may refer to.
    NodeReader(ValueReader& values, const NameNumbers& materials, const NameNumbers& objects)
        : in_(values), materials_(materials), objects_(objects) {}

    /// All objects of a scene; their names are known already.
    bool objects(JsonIndex section, SceneData& scene);
    bool edits(JsonIndex section, SceneData& scene);
    /// One edit, or some keys of one onto what `out` holds (`partly`).
    bool edit(JsonIndex at, Edit& out, bool partly = false);
    bool object_tree(JsonIndex at, Object& out, std::vector<JsonIndex>& places);

private:
    bool node(JsonIndex at, Node& out, Edit* edit, bool partly = false);
    bool shape(JsonIndex at, JsonIndex name, Node& out);
    bool domain(JsonIndex at, std::vector<Warp>& out);
    bool no_cycles(const SceneData& scene);
    bool unknown_node_key(JsonIndex member, const Table& table, const Node& node);

    ValueReader& in_;
    const NameNumbers& materials_;
    const NameNumbers& objects_;
};

}  // namespace kiln::scene

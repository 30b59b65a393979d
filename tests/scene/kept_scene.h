// SPDX-License-Identifier: MIT
// A small scene on disk for tests of what is kept beside it, with keys that a World does not read; and an edit to add to it.
#pragma once

#include <kiln/edit.h>
#include <kiln/shapes.h>

#include <string>

namespace kiln {

inline const std::string kScene =
    "{\"format\": 1, \"materials\": {\"clay\": {}}, \"edits\": [{\"id\": \"a\", \"material\": \"clay\", \"shape\": "
    "\"sphere\", \"scale\": 2, \"outline\": {\"width_px\": 5}}, {\"id\": \"b\", \"shape\": \"box\", \"position\": [0, "
    "0, 0]}], \"wind\": [1, 0, 0]}";

inline Edit ball(const std::string& name, float radius) {
    Edit e;
    e.name = name;
    e.node.shape = Sphere{.radius = radius};
    return e;
}

}  // namespace kiln

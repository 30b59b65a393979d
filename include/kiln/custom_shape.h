// SPDX-License-Identifier: MIT
// A program's own shape: a distance in C++, known by name in code and in scene files.
//   const auto egg = kiln::register_shape({.name = "egg", .distance = …, .half_extents = …});
//   world.add({.node = {.shape = *egg}});
#pragma once

#include <kiln/edit.h>
#include <kiln/result.h>

#include <functional>
#include <string>
#include <vector>

namespace kiln {

struct CustomShape {
    /// One number of the shape; a key beside `shape` in scene files.
    struct Parameter {
        std::string name;  ///< lower case letters, digits and _
        float value = 1;   ///< when left out
        float least = -1e9f, most = 1e9f;
        std::string description{};
    };
    /// Points in the shape's own frame, metres; never outside the half extents.
    struct Points {
        const double* x;
        const double* y;
        const double* z;
        int count;  ///< 1 … 64
    };

    std::string name{};  ///< lower case letters, digits and _; no other shape's
    std::string description{};
    std::vector<Parameter> parameters{};  ///< at most 9; Shape::params in this order
    /// Writes `count` numbers: metres, negative inside. The same answers for the same points, on any thread.
    std::function<void(const Points& points, const float* parameters, double* distance)> distance{};
    /// Half the size of a box around the origin that the solid lies in, metres.
    std::function<vec3(const float* parameters)> half_extents{};
    /// No two points of the box differ by more than this per metre; 1 for distances. What is given here and above is checked by
    /// sampling when an edit with the shape is compiled; the solid is cut to the box.
    float lipschitz = 1;
};

/// Makes the shape known to this process, for good, and returns one with its parameters' own values. Register before worlds or scene
/// files name it. Worlds with it are baked on the CPU on every device. Fails on a name that is taken or a missing function. Any thread.
Result<Shape> register_shape(CustomShape shape);

}  // namespace kiln

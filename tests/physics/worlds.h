// SPDX-License-Identifier: MIT
// Fields and bodies for the tests of physics.
#pragma once

#include "field/sdf_field.h"
#include "physics/physics.h"

#include <kiln/shapes.h>

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

namespace kiln::physics::worlds {

inline Edit edit(kiln::Shape shape, vec3 position = {}, Op op = Op::Union, float blend = 0) {
    Edit e;
    e.node.shape = std::move(shape);
    e.node.transform.position = position;
    e.op = op;
    e.blend_radius = blend;
    return e;
}

inline std::shared_ptr<const field::SdfField> field_of(const std::vector<Edit>& edits) {
    auto program = sdf::compile({edits, {}, {}});
    EXPECT_TRUE(program) << (program ? "" : program.error().message);
    return std::make_shared<field::ProgramField>(
        std::make_shared<const sdf::Program>(program ? std::move(*program) : sdf::Program{}));
}

inline std::shared_ptr<const SdfShape> moving(const std::vector<Edit>& edits) {
    auto made = SdfShape::moving(field_of(edits));
    EXPECT_TRUE(made) << (made ? "" : made.error().message);
    return made ? *made : nullptr;
}

/// Of every engine that runs here.
inline std::vector<std::string> engines() {
    std::vector<std::string> out;
    for (const Backend& b : backends())
        if (b.why_not.empty()) out.emplace_back(b.name);
    return out;
}

}  // namespace kiln::physics::worlds

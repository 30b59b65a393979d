// SPDX-License-Identifier: MIT
// Which lamps and spots have shadow maps of meshes, and where their faces look.
#pragma once

#include "render/passes/lamps.gpu.h"

#include <kiln/renderer.h>

#include <span>
#include <vector>

namespace kiln::render {

struct LampFaces {
    std::vector<LampFace> faces;
    // A light each: its first face plus one, below 0 where that is the only one; 0: it has none. What LightRecord::color.w says.
    std::vector<float> of;
};

// The first lights that find room in `most` faces. `eye`: what places count from. A spot of up to 60 degrees has one face, other lights six: towards
// +x, -x, +y and so on. Faces overlap by as much as a filter reaches.
LampFaces lamp_faces(std::span<const Light> lights, vec3 eye, uint32_t most);

}  // namespace kiln::render

// SPDX-License-Identifier: MIT
// The field of a scene's solids, but for those that move as a whole. In namespace kiln: <kiln/world.h> and kiln::measure do not go together,
// since one of the former's functions has the latter's name.
#pragma once

#include <kiln/result.h>

#include <memory>
#include <string>

namespace kiln {

namespace field {
class Field;
}

/// In one level of whole bricks, whatever the scene asks for. `scene`: a file or a bundled scene's name.
Result<std::shared_ptr<const field::Field>> field_of_scene(const std::string& scene);

}  // namespace kiln

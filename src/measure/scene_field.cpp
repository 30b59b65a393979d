// SPDX-License-Identifier: MIT
#include "measure/scene_field.h"

#include <kiln/renderer.h>
#include <kiln/world.h>

namespace kiln {

Result<std::shared_ptr<const field::Field>> field_of_scene(const std::string& scene) {
    auto world = World::load(scene);
    if (!world) return world.error();
    world->field_settings.levels = 1;
    world->field_settings.voxel_size = 0;
    const auto frame = world->frame();
    if (!frame) return frame.error();
    return frame->field;
}

}  // namespace kiln

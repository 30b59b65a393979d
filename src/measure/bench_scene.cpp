// SPDX-License-Identifier: MIT
#include "measure/bench_scene.h"

#include "measure/recipes.h"
#include "measure/scene_field.h"

#include <algorithm>

namespace kiln::measure {

vec3 BenchScene::middle() const { return (options.bounds.min + options.bounds.max) * 0.5f; }

float BenchScene::half() const {
    const vec3 size = options.bounds.max - options.bounds.min;
    return std::max({size.x, size.y, size.z}) * 0.5f;
}

std::vector<vec3> BenchScene::points(uint32_t count) const {
    std::vector<vec3> out = random_points(count);
    const vec3 half = (options.bounds.max - options.bounds.min) * 0.5f;
    for (vec3& p : out) p = middle() + p * half;
    return out;
}

std::vector<Ray> BenchScene::rays(int width, int height) const {
    std::vector<Ray> out = picture_rays_in_tiles(width, height);
    for (Ray& ray : out) ray.origin = middle() + ray.origin * half();
    return out;
}

BenchScene recipe_scene(int kind, const BenchOptions& options) {
    BenchScene out;
    out.kind = kind;
    out.edits = recipe(kind, options.seed, options.count);
    out.program = std::make_shared<const sdf::Program>(*sdf::compile({out.edits, {}, {}}));
    out.options.bounds = {{-1, -1, -1}, {1, 1, 1}};
    out.options.voxel_size = 2.0f / float(options.resolution);
    return out;
}

Result<BenchScene> file_scene(const BenchOptions& options) {
    const auto field = field_of_scene(options.scene);
    if (!field) return field.error();
    if ((*field)->stats().bricks == 0)
        return Error{formatted("bench: {} has no surface; there is nothing to measure", options.scene),
                     ErrorKind::Input};
    BenchScene out;
    out.file = options.scene;
    out.program = (*field)->shared_program();
    out.options.bounds = (*field)->options().bounds;
    out.options.voxel_size = 2 * out.half() / float(options.resolution);
    return out;
}

}  // namespace kiln::measure

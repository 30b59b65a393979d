// SPDX-License-Identifier: MIT
// A program's own shape: its distance in C++ (`glsl` takes one in GLSL), its numbers as parameters, used like any other shape in code and in scene files.

#include <kiln/edit.h>
#include <kiln/world.h>

#include <cmath>
#include <cstdio>

int main() {
    // A ball with ridges running up and down it.
    const auto pumpkin = kiln::register_shape({
        .name = "pumpkin",
        .parameters = {{.name = "radius", .value = 0.5f, .least = 0.01f, .most = 100}},
        .distance =
            [](const kiln::CustomShape::Points& p, const float* parameters, double* distance) {
                for (int i = 0; i < p.count; ++i) {
                    const double around = std::hypot(p.x[i], p.z[i]), size = std::hypot(around, p.y[i]);
                    const double ridges = std::cos(8 * std::atan2(p.z[i], p.x[i])) * around / 20;
                    distance[i] = size - double(parameters[0]) - ridges;
                }
            },
        .half_extents =
            [](const float* parameters) {
                return kiln::vec3{1, 1, 1} * (1.1f * parameters[0]);
            },
        .lipschitz = 1.1f,
    });
    if (!pumpkin) return std::fprintf(stderr, "%s\n", pumpkin.error().message.c_str()), 1;

    kiln::World world;
    (void)world.add({.node = {.shape = *pumpkin}});
    std::printf("distance at (0, 2, 0): %.2f m\n", double(world.distance({0, 2, 0})));

    const char* scene = R"({"format": 1, "edits": [{"shape": "pumpkin", "radius": 1}]})";
    const auto read = kiln::World::parse(scene, "scene");
    if (!read) return std::fprintf(stderr, "%s\n", read.error().message.c_str()), 1;
    std::printf("of the one in the scene: %.2f m\n", double(read->distance({0, 2, 0})));
}

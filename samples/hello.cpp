// SPDX-License-Identifier: MIT
// A world in forty lines: two shapes, a smooth cut, one distance and one picture.

#include <kiln/world.h>

#include <cstdio>

int main() {
    kiln::World world;
    const kiln::MaterialId clay = world.add_material("clay", {.base_color = {0.62f, 0.27f, 0.16f}, .roughness = 0.5f});
    const kiln::MaterialId glaze = world.add_material("glaze", {.base_color = {0.02f, 0.2f, 0.35f}, .roughness = 0.1f});

    (void)world.add({.name = "bowl", .node = {.shape = kiln::Sphere{.radius = 1}, .material = clay}});
    (void)world.add(
        {.name = "hollow",
         .node = {.shape = kiln::Sphere{.radius = 0.85f}, .transform = {.position = {0, 0.45f, 0}}, .material = glaze},
         .op = kiln::Op::Subtract,
         .blend_radius = 0.1f});

    std::printf("distance at (0, 2, 0): %.3f m\n", double(world.distance({0, 2, 0})));

    const auto frame = world.frame();
    auto renderer = kiln::Renderer::create();
    if (!frame || !renderer) {
        std::fprintf(stderr, "%s\n", (!frame ? frame.error() : renderer.error()).message.c_str());
        return 1;
    }
    const auto picture = renderer->render(*frame, {.width = 640, .height = 360});
    if (!picture) {
        std::fprintf(stderr, "%s\n", picture.error().message.c_str());
        return 1;
    }
    if (const auto saved = picture->save("hello.png"); !saved) {
        std::fprintf(stderr, "%s\n", saved.error().message.c_str());
        return 1;
    }
    std::puts("wrote hello.png");
}

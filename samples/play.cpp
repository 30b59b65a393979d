// SPDX-License-Identifier: MIT
// A game without a window: cans on a shelf are bodies, a ball is thrown at them, and the game asks what was hit and what fell.

#include <kiln/world.h>

#include <cstdio>
#include <string>

namespace {

int fail(const kiln::Error& error) { return std::fprintf(stderr, "%s\n", error.message.c_str()), 1; }

kiln::Edit shape(std::string name, kiln::Shape shape, kiln::vec3 position) {
    return {.name = std::move(name), .node = {.shape = std::move(shape), .transform = {.position = position}}};
}

}  // namespace

int main() {
    kiln::World world;
    (void)world.add(shape("ground", kiln::Plane{}, {}));
    (void)world.add(shape("shelf", kiln::Box{.half_extents = {1, 0.5f, 0.2f}}, {0, 0.5f, 0}));
    // What moves is named as in a scene file.
    std::string bodies;
    for (int i = 0; i < 3; ++i) {
        const std::string id = "can" + std::to_string(i);
        (void)world.add(
            shape(id, kiln::Cylinder{.half_height = 0.15f, .radius = 0.1f}, {float(i - 1) * 0.3f, 1.15f, 0}));
        bodies += (i > 0 ? ", " : "") + ("{\"id\": \"" + id + "\", \"edits\": [\"" + id + "\"], \"density\": 200}");
    }
    if (auto done = world.apply("{\"bodies\": [" + bodies + "]}"); !done) return fail(done.error());

    auto play = kiln::Play::start(world);  // the world stays as it is
    if (!play) return fail(play.error());
    const kiln::Edit ball = shape("", kiln::Sphere{.radius = 0.12f}, {0, 1.2f, 3});
    if (auto done = play->launch(ball, {0, 1, -12}); !done) return fail(done.error());
    for (int i = 0; i < 120; ++i) {
        if (auto made = play->advance(1.0 / 60); !made) return fail(made.error());
        for (const kiln::PlayEvent& e : play->events())
            if (e.type == "begin" && e.a != "world" && e.b != "world")
                std::printf("%.2f s: %s meets %s\n", play->time(), e.a.c_str(), e.b.c_str());
        // A program with a window draws here: renderer.render(*play->frame(camera)).
    }
    int fell = 0;
    for (const kiln::PlayBody& body : play->bodies()) fell += body.id.starts_with("can") && body.pose.position.y < 0.9f;
    std::printf("%d of 3 fell\n", fell);
}

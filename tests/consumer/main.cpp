// SPDX-License-Identifier: MIT
// Makes a world, asks it for a distance and a ray, and says whether the closed forms came back. Needs no GPU.
#include <kiln/world.h>

#include <cmath>
#include <cstdio>
#include <string>

int main() {
    kiln::World world;
    kiln::Edit ball;
    ball.name = "ball";
    ball.node.shape = kiln::Sphere{.radius = 1};
    kiln::Edit hole;
    hole.node.shape = kiln::Sphere{.radius = 0.5f};
    hole.node.transform.position = {0, 1, 0};
    hole.op = kiln::Op::Subtract;
    for (const kiln::Edit& edit : {ball, hole}) {
        if (const auto id = world.add(edit); !id) {
            std::fprintf(stderr, "%s\n", id.error().message.c_str());
            return 1;
        }
    }

    // Beside the hole the ball alone answers; straight above, the bottom of the hole at y = 0.5 is what a ray meets.
    const float beside = world.distance({2, 0, 0});
    const kiln::RayHit hit = world.cast({.origin = {0, 3, 0}, .direction = {0, -1, 0}});
    std::printf("kiln %s: distance %.4f, ray %.4f\n", std::string(kiln::version()).c_str(), double(beside),
                double(hit.t));
    return std::abs(beside - 1) < 1e-5f && hit.hit && std::abs(hit.t - 2.5f) < 1e-3f ? 0 : 1;
}

// SPDX-License-Identifier: MIT
// Worlds to simulate in tests, on every engine that is here.
#pragma once

#include <kiln/world.h>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <string>
#include <utility>
#include <vector>

namespace kiln::scene {

/// A command: a cut through a pillar at the height of 1.8 m.
inline constexpr const char* kSlit =
    R"({"add": {"id": "slit", "shape": "box", "half_extents": [1, 0.2, 1], "position": [0, 1.8, 0], "op": "subtract"}})";

inline std::vector<std::string> engines() {
    std::vector<std::string> out;
    for (const PhysicsBackend& b : physics_backends())
        if (b.why_not.empty()) out.emplace_back(b.name);
    return out;
}

inline World parsed(const std::string& text) {
    auto world = World::parse(text, "s.kiln.json");
    EXPECT_TRUE(world) << (world ? "" : world.error().message);
    return world ? std::move(*world) : World();
}

inline nlohmann::json run(const World& world, const SimulateSettings& settings) {
    const auto text = world.simulate_json(settings);
    EXPECT_TRUE(text) << (text ? "" : text.error().message);
    return text ? nlohmann::json::parse(*text) : nlohmann::json();
}

}  // namespace kiln::scene

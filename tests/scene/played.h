// SPDX-License-Identifier: MIT
// A play of a scene's text, whose steps and commands must succeed.
#pragma once

#include <kiln/world.h>

#include <gtest/gtest.h>

#include "simulated.h"

#include <string>
#include <utility>

namespace kiln::scene {

struct Played {
    World start;
    Play play;
    Played(const std::string& engine, const std::string& scene)
        : start(parsed(scene)), play(made(start, engine)), text_(scene) {}
    static Play made(const World& world, const std::string& engine) {
        auto out = Play::start(world, {.backend = engine});
        EXPECT_TRUE(out) << (out ? "" : out.error().message);
        return std::move(*out);
    }
    void run(int steps) {
        for (int i = 0; i < steps; ++i) {
            const auto done = play.step();
            ASSERT_TRUE(done) << done.error().message;
        }
    }
    void apply(const std::string& command) {
        const auto done = play.apply(command);
        ASSERT_TRUE(done) << done.error().message;
    }
    /// What a world that was as this one began becomes.
    World kept() const {
        World out = parsed(text_);
        const auto done = play.keep(out);
        EXPECT_TRUE(done) << (done ? "" : done.error().message);
        return out;
    }
    Frame shown(const Camera& camera) {
        auto frame = play.frame(camera);
        EXPECT_TRUE(frame) << (frame ? "" : frame.error().message);
        return frame ? std::move(*frame) : Frame();
    }

private:
    std::string text_;
};

}  // namespace kiln::scene

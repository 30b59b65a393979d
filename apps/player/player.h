// SPDX-License-Identifier: MIT
// The player: a window on a world that runs, in which one can fly, dig and throw. Without a display the same frames are made and not shown.
#pragma once

#include <kiln/renderer.h>
#include <kiln/result.h>

#include <functional>
#include <span>
#include <string>
#include <string_view>

namespace kiln::player {

struct PlayerOptions {
    std::string scene{};
    std::string camera{}, device = "auto", backend{};
    Quality quality = Quality::Medium;
    bool choose_quality = true;      ///< instead: what the device can do sixty times a second, or comes near
    int width = 1280, height = 720;  ///< of the window, pixels
    int frames = 0;                  ///< ends after so many; 0: when the window is closed
    std::string keys{};        ///< file of input events; then, and without a display, a frame is a sixtieth of a second
    std::string screenshot{};  ///< .png of the last frame
    std::string ui_json{};     ///< a JSON object a line for each frame
    bool window = true;        ///< false: do not show anything
    bool validation = false;
    std::function<void(std::string_view line)> say = [](std::string_view) {};  ///< for people
};

/// Runs until the window is closed, Escape is pressed or the frames are made. An error of kind NoDevice: nothing could be shown or drawn,
/// and nothing has happened.
Result<void> run_player(const PlayerOptions& options);

/// What keys and mouse do, a line each.
std::string_view player_keys();

/// By View.
std::span<const std::string_view> view_names();

}  // namespace kiln::player

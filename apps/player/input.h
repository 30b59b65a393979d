// SPDX-License-Identifier: MIT
// What somebody did with keys and mouse, from a window or from a file that is replayed. Pixels count from the window's top left.
#pragma once

#include <kiln/result.h>

#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace kiln::player {

struct InputEvent {
    enum class Kind {
        Key,     ///< `name` is pressed or let go
        Button,  ///< likewise: "left", "middle", "right"; at x, y
        Mouse,   ///< is at x, y
        Look,    ///< moved by x, y while it turns the camera
        Wheel,   ///< turned by y, away from the hand is positive
        Size,    ///< the window has x by y pixels
        Close,
    };
    int frame = 0;  ///< that it comes before; counts from 0
    Kind kind = Kind::Key;
    std::string name{};
    bool down = false;
    float x = 0, y = 0;
};

/// Keys that mean something.
std::span<const std::string_view> known_keys();

/// A file of JSON lines, ordered by frame: {"frame": 12, "key": "w", "down": true}. Errors read "FILE:LINE: what; what would be right".
Result<std::vector<InputEvent>> read_input_events(const std::string& path);
/// The same of its text; `name` is what errors call it.
Result<std::vector<InputEvent>> parse_input_events(std::string_view text, const std::string& name);

/// What is held down now, and where the mouse is.
struct InputState {
    std::set<std::string, std::less<>> keys, buttons;
    float x = 0, y = 0;
    void take(const InputEvent& event);
    bool key(std::string_view name) const { return keys.contains(name); }
    bool button(std::string_view name) const { return buttons.contains(name); }
};

}  // namespace kiln::player

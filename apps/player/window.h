// SPDX-License-Identifier: MIT
// The window: the only file that knows the window system (SDL 2). One at a time, owner's thread.
#pragma once

#include "player/input.h"

#include <kiln/renderer.h>

#include <memory>
#include <string>

namespace kiln::player {

class Window {
public:
    /// A display to open one on, as far as the environment tells. SDL's drivers without a screen ("dummy", "offscreen") are none.
    static bool has_display();
    /// Errors say why there can be none.
    static Result<std::unique_ptr<Window>> open(const std::string& title, int width, int height);
    ~Window();
    Window(const Window&) = delete;
    Window& operator=(const Window&) = delete;

    /// For RendererOptions::window; good while the window is.
    WindowSurface surface() const;
    /// In pixels; 0 by 0 while it is minimised.
    int width() const;
    int height() const;
    /// What happened since the last call, at frame 0.
    std::vector<InputEvent> poll();
    /// Sleeps until something happens, so long at most.
    void wait(double seconds);
    /// Sleeps so long, whatever happens.
    static void sleep(double seconds);
    /// Pictures a second that the screen shows.
    double refresh_rate() const;
    /// So many pixels, where the window system lets us; none: it is hidden.
    void resize(int width, int height);
    /// While held, the mouse turns the camera and has no place.
    void hold_mouse(bool held);
    void set_title(const std::string& title);

private:
    Window() = default;
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace kiln::player

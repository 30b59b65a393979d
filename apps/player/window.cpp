// SPDX-License-Identifier: MIT
#include "player/window.h"

#include <SDL2/SDL.h>
#include <SDL2/SDL_vulkan.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>

namespace kiln::player {

struct Window::Impl {
    SDL_Window* window = nullptr;
    bool held = false;
};

namespace {

bool set_in_environment(const char* name) {
    const char* value = std::getenv(name);
    return value && *value;
}

std::string lower(std::string text) {
    for (char& c : text)
        if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
    return text;
}

const char* button_name(uint8_t button) {
    return button == SDL_BUTTON_LEFT     ? "left"
           : button == SDL_BUTTON_MIDDLE ? "middle"
           : button == SDL_BUTTON_RIGHT  ? "right"
                                         : nullptr;
}

}  // namespace

bool Window::has_display() {
    if (const char* driver = std::getenv("SDL_VIDEODRIVER"))
        if (!std::strcmp(driver, "dummy") || !std::strcmp(driver, "offscreen")) return false;
    return set_in_environment("DISPLAY") || set_in_environment("WAYLAND_DISPLAY");
}

Result<std::unique_ptr<Window>> Window::open(const std::string& title, int width, int height) {
    const auto fault = [](const char* what) {
        Error error{std::string(what) + ": " + SDL_GetError(), ErrorKind::NoDevice};
        SDL_Quit();
        return error;
    };
    SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");  // the command line has its own
    SDL_SetHint(SDL_HINT_VIDEO_X11_NET_WM_BYPASS_COMPOSITOR, "0");
    if (SDL_Init(SDL_INIT_VIDEO) != 0) return fault("no display can be opened");
    std::unique_ptr<Window> out(new Window);
    out->impl_ = std::make_unique<Impl>();
    out->impl_->window = SDL_CreateWindow(title.c_str(), SDL_WINDOWPOS_CENTERED, SDL_WINDOWPOS_CENTERED, width, height,
                                          SDL_WINDOW_VULKAN | SDL_WINDOW_RESIZABLE | SDL_WINDOW_ALLOW_HIGHDPI);
    if (!out->impl_->window) {
        out->impl_.reset();
        return fault("no window can be opened");
    }
    return out;
}

Window::~Window() {
    if (!impl_) return;
    SDL_DestroyWindow(impl_->window);
    SDL_Quit();
}

WindowSurface Window::surface() const {
    WindowSurface out;
    unsigned count = 0;
    std::vector<const char*> names;
    if (SDL_Vulkan_GetInstanceExtensions(impl_->window, &count, nullptr)) {
        names.resize(count);
        SDL_Vulkan_GetInstanceExtensions(impl_->window, &count, names.data());
    }
    out.extensions.assign(names.begin(), names.end());
    out.make = [window = impl_->window](void* instance) -> uint64_t {
        SDL_vulkanSurface surface{};
        if (!SDL_Vulkan_CreateSurface(window, static_cast<SDL_vulkanInstance>(instance), &surface)) return 0;
        return uint64_t(surface);
    };
    return out;
}

int Window::width() const {
    int w = 0, h = 0;
    if (!(SDL_GetWindowFlags(impl_->window) & (SDL_WINDOW_MINIMIZED | SDL_WINDOW_HIDDEN)))
        SDL_Vulkan_GetDrawableSize(impl_->window, &w, &h);
    return w;
}

int Window::height() const {
    int w = 0, h = 0;
    if (!(SDL_GetWindowFlags(impl_->window) & (SDL_WINDOW_MINIMIZED | SDL_WINDOW_HIDDEN)))
        SDL_Vulkan_GetDrawableSize(impl_->window, &w, &h);
    return h;
}

std::vector<InputEvent> Window::poll() {
    using Kind = InputEvent::Kind;
    std::vector<InputEvent> out;
    // Places come in the window's own units, pictures have pixels.
    int across = 1, down = 1;
    SDL_GetWindowSize(impl_->window, &across, &down);
    const float sx = float(std::max(width(), 1)) / float(std::max(across, 1));
    const float sy = float(std::max(height(), 1)) / float(std::max(down, 1));
    for (SDL_Event e; SDL_PollEvent(&e);) {
        if (e.type == SDL_QUIT) {
            out.push_back({.kind = Kind::Close});
        } else if ((e.type == SDL_KEYDOWN || e.type == SDL_KEYUP) && e.key.repeat == 0) {
            const std::string name = lower(SDL_GetKeyName(e.key.keysym.sym));
            const auto known = known_keys();
            if (std::find(known.begin(), known.end(), name) != known.end())
                out.push_back({.kind = Kind::Key, .name = name, .down = e.type == SDL_KEYDOWN});
        } else if (e.type == SDL_MOUSEBUTTONDOWN || e.type == SDL_MOUSEBUTTONUP) {
            const float x = float(e.button.x) * sx, y = float(e.button.y) * sy;
            if (!impl_->held) out.push_back({.kind = Kind::Mouse, .x = x, .y = y});
            if (const char* name = button_name(e.button.button))
                out.push_back(
                    {.kind = Kind::Button, .name = name, .down = e.type == SDL_MOUSEBUTTONDOWN, .x = x, .y = y});
        } else if (e.type == SDL_MOUSEMOTION && impl_->held) {
            out.push_back({.kind = Kind::Look, .x = float(e.motion.xrel) * sx, .y = float(e.motion.yrel) * sy});
        } else if (e.type == SDL_MOUSEMOTION) {
            out.push_back({.kind = Kind::Mouse, .x = float(e.motion.x) * sx, .y = float(e.motion.y) * sy});
        } else if (e.type == SDL_MOUSEWHEEL) {
            const float turned = float(e.wheel.y);
            out.push_back({.kind = Kind::Wheel, .y = e.wheel.direction == SDL_MOUSEWHEEL_FLIPPED ? -turned : turned});
        } else if (e.type == SDL_WINDOWEVENT && e.window.event == SDL_WINDOWEVENT_FOCUS_LOST) {
            // Keys that are let go elsewhere are never told.
            for (const std::string_view key : known_keys())
                out.push_back({.kind = Kind::Key, .name = std::string(key)});
            for (const char* button : {"left", "middle", "right"})
                out.push_back({.kind = Kind::Button, .name = button});
        }
    }
    return out;
}

void Window::wait(double seconds) {
    if (seconds > 0) SDL_WaitEventTimeout(nullptr, std::max(1, int(seconds * 1000)));
}

void Window::sleep(double seconds) {
    if (seconds > 0) SDL_Delay(uint32_t(seconds * 1000));
}

double Window::refresh_rate() const {
    SDL_DisplayMode mode{};
    const int display = SDL_GetWindowDisplayIndex(impl_->window);
    if (display < 0 || SDL_GetCurrentDisplayMode(display, &mode) != 0 || mode.refresh_rate < 1) return 60;
    return mode.refresh_rate;
}

void Window::resize(int width, int height) {
    if (width <= 0 || height <= 0) return SDL_HideWindow(impl_->window);
    SDL_SetWindowSize(impl_->window, width, height);
    SDL_ShowWindow(impl_->window);
}

void Window::hold_mouse(bool held) {
    if (impl_->held == held) return;
    impl_->held = held;
    SDL_SetRelativeMouseMode(held ? SDL_TRUE : SDL_FALSE);
}

void Window::set_title(const std::string& title) { SDL_SetWindowTitle(impl_->window, title.c_str()); }

}  // namespace kiln::player

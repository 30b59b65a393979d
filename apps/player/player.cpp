// SPDX-License-Identifier: MIT
#include "player/player.h"

#include "player/fly.h"
#include "player/hud.h"
#include "player/input.h"
#include "player/session.h"
#include "player/window.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

namespace kiln::player {

namespace {

constexpr double kReplayStep =
    1.0 / 60 + 1e-9;  // seconds a frame that no clock is asked about: a little more than the usual step as a float
constexpr double kLongestFrame = 0.1;   // what is longer is a stop, not a fast world
constexpr double kCatchUp = 0.03;       // seconds a frame to run a play again
constexpr double kBakeSeconds = 0.008;  // a frame, of worlds of several levels
constexpr uint32_t kBakeBricks = 512;   // likewise, where no clock is asked
constexpr double kMessageSeconds = 3;
constexpr double kLookAtFile = 1;  // seconds from one look at the scene file to the next
constexpr int kFramesALook = 60;   // likewise, where no clock is asked
constexpr int kFramesToRest =
    80;  // a round of the places in a pixel that rays go through, with a fourth as many of them
constexpr float kBiteOfDistance = 0.03f;  // radius: as large on the screen from everywhere
constexpr float kLeastBite = 0.1f, kMostBite = 0.8f;
constexpr int kFramesABite = 10;                                   // while the mouse stays where it is
constexpr float kWalkSpeed = 3, kRunSpeed = 6, kJumpSpeed = 4.5f;  // m/s; jumps 1 m high
constexpr float kEyes = 1.6f;                                      // metres over the feet
constexpr float kBallRadius = 0.25f, kBallSpeed = 14;              // metres, m/s
// What `auto` goes down by where frames take long: parts of the window's side that the picture has, and of the picture's that rays have;
// then surfaces are as the bricks have them, which few rays hardly tell.
struct Rung {
    int part;
    float scale;
    bool refine;
};
constexpr Rung kRungs[] = {{1, 1, true},     {1, 0.5f, true},  {2, 0.5f, true},
                           {2, 0.5f, false}, {3, 0.5f, false}, {4, 0.5f, false}};
constexpr int kRungOfProcessor = 2;
constexpr double kSlow = 0.066, kQuick = 0.012;  // seconds a frame
constexpr int kFramesARung = 40;                 // a change costs the picture's history
constexpr double kSecondsARung = 2;              // … and frames that take long are not waited for so often
constexpr std::string_view kViews[] = {"shaded", "albedo", "normal", "depth", "steps", "bricks", "levels", "ao"};

std::string digits(const char* format, double value) {
    char buffer[64];
    std::snprintf(buffer, sizeof buffer, format, value);
    return buffer;
}

std::vector<std::string> lines_of(std::string_view text) {
    std::vector<std::string> out;
    for (size_t at = 0; at <= text.size();) {
        const size_t end = std::min(text.find('\n', at), text.size());
        out.emplace_back(text.substr(at, end - at));
        at = end + 1;
    }
    return out;
}

// A text file that appears whole or not at all.
Result<void> write_whole(const std::string& path, const std::string& text) {
    const std::string part = path + ".part";
    std::ofstream out(part, std::ios::binary | std::ios::trunc);
    out << text;
    out.close();
    if (out && std::rename(part.c_str(), path.c_str()) == 0) return {};
    std::remove(part.c_str());
    return Error{"cannot write " + path};
}

class Player {
public:
    explicit Player(const PlayerOptions& options) : o_(options) {}

    Result<void> open();
    Result<void> run();
    // Says what is not saved, however it ended.
    void leave() const;
    const PlayerOptions& options() const { return o_; }

private:
    Result<void> take_events();
    Result<void> take(const InputEvent& event);
    Result<void> press(const std::string& key);
    void fly(float seconds);
    void walk();
    Result<void> start_or_stop_walking();
    void look_at_files();
    bool walks() const { return hud_.walks; }
    void hold_mouse() {
        if (window_ && o_.keys.empty()) window_->hold_mouse(walks() || input_.button("right"));
    }
    Result<void> use_tools();
    float axis(std::string_view more, std::string_view less) const {
        return (input_.key(more) ? 1.0f : 0.0f) - (input_.key(less) ? 1.0f : 0.0f);
    }
    RenderSettings settings() const;
    Result<Picture> draw(double seconds);
    void choose_rung(double seconds);
    void describe(const RenderStats& stats);
    std::string ui_line(const std::vector<std::pair<std::string, Rect>>& widgets);
    void message(const std::string& text) {
        hud_.message = text;
        message_left_ = kMessageSeconds;
    }
    // Of things that a person asked for and that did not work: said on the screen, and the world goes on.
    void tell(const Result<void>& done) {
        if (!done) message(done.error().message);
    }
    // Nothing will look other than it does: time stands still, and the last picture is as good as it gets.
    bool rests() const {
        return paused_ && o_.keys.empty() && input_.keys.empty() && input_.buttons.empty() && session_->behind() == 0 &&
               frame_ > last_input_ + kFramesToRest && message_left_ <= 0;
    }
    bool replays() const { return !o_.keys.empty() || !window_; }

    PlayerOptions o_;
    std::unique_ptr<Window> window_;  // outlives the renderer
    std::unique_ptr<Session> session_;
    std::optional<Renderer> renderer_;
    std::optional<FlyCamera> camera_;
    std::vector<InputEvent> events_;  // of the file
    size_t next_event_ = 0;
    InputState input_;
    Hud hud_;
    PlayLines lines_;
    View view_ = View::Shaded;
    int width_ = 0, height_ = 0;
    int frame_ = 0, last_bite_ = 0, last_input_ = 0;
    vec3 bite_towards_{};
    float speed_ = 4;  // m/s
    vec3 walk_{};      // m/s, wished
    bool paused_ = false, profiler_ = false, done_ = false;
    double message_left_ = 0;                                         // seconds
    double looked_ = 0;                                               // seconds since the scene file was looked at
    double frame_seconds_ = 0, work_seconds_ = 0, rung_seconds_ = 0;  // smoothed; work: without waiting for the screen
    size_t rung_ = 0;
    int rung_since_ = 0;  // frame
    std::string ui_;
};

Result<void> Player::open() {
    if (!o_.keys.empty()) {
        auto events = read_input_events(o_.keys);
        if (!events) return events.error();
        events_ = std::move(*events);
    }
    auto session = Session::open(o_.scene, o_.backend);
    if (!session) return session.error();
    session_ = std::move(*session);
    for (const std::string& file : {o_.screenshot, o_.ui_json})
        if (!file.empty() && session_->world().is_read_from(file))
            return Error{file + ": the scene is read from it; choose another name", ErrorKind::Usage};
    auto camera = session_->world().camera(o_.camera);
    if (!camera) return camera.error();
    camera_.emplace(*camera);
    if (o_.window) {
        auto window = Window::open(o_.scene + " - Kiln", o_.width, o_.height);
        if (!window) return window.error();
        window_ = std::move(*window);
    }
    RendererOptions options{.device = o_.device, .validation = o_.validation};
    if (window_) options.window = window_->surface();
    auto renderer = Renderer::create(options);
    if (!renderer) return renderer.error();
    renderer_.emplace(std::move(*renderer));
    if (o_.choose_quality) {
        o_.quality = renderer_->best_quality();
        if (o_.quality == Quality::Medium) rung_ = kRungOfProcessor;
    }
    if (!session_->note().empty()) o_.say(session_->note());
    width_ = o_.width;
    height_ = o_.height;
    input_.x = float(width_) / 2;
    input_.y = float(height_) / 2;
    return {};
}

RenderSettings Player::settings() const {
    RenderSettings s;
    s.width = width_;
    s.height = height_;
    s.view = view_;
    set_quality(s, o_.quality);
    s.shown_alone = true;
    const Rung& rung = kRungs[rung_];
    s.width = (width_ + rung.part - 1) / rung.part;
    s.height = (height_ + rung.part - 1) / rung.part;
    s.refine = s.refine && rung.refine;
    if (rung.scale < 1 && view_ == View::Shaded) {
        s.taa = true;
        s.scale = rung.scale;
    }
    return s;
}

void Player::choose_rung(double seconds) {
    work_seconds_ = work_seconds_ > 0 ? 0.9 * work_seconds_ + 0.1 * seconds : seconds;
    rung_seconds_ += seconds;
    if (!o_.choose_quality || replays()) return;
    if (frame_ - rung_since_ < kFramesARung && rung_seconds_ < kSecondsARung) return;
    const bool slow = work_seconds_ > kSlow && rung_ + 1 < std::size(kRungs);
    // Up only where four times the work would not be slow.
    const bool quick = work_seconds_ < kQuick && rung_ > 0;
    if (!slow && !quick) return;
    rung_ = slow ? rung_ + 1 : rung_ - 1;
    rung_since_ = frame_;
    work_seconds_ = rung_seconds_ = 0;
}

Result<void> Player::take_events() {
    if (window_) {
        for (const InputEvent& e : window_->poll())
            if (o_.keys.empty() || e.kind == InputEvent::Kind::Close)
                if (auto taken = take(e); !taken) return taken;
    }
    for (; next_event_ < events_.size() && events_[next_event_].frame <= frame_; ++next_event_)
        if (auto taken = take(events_[next_event_]); !taken) return taken;
    if (!window_) return {};
    width_ = window_->width();
    height_ = window_->height();
    return {};
}

Result<void> Player::take(const InputEvent& e) {
    using Kind = InputEvent::Kind;
    input_.take(e);
    last_input_ = frame_;
    switch (e.kind) {
    case Kind::Close:
        done_ = true;
        break;
    case Kind::Key:
        return e.down ? press(e.name) : Result<void>();
    case Kind::Button:
        hold_mouse();
        break;
    case Kind::Look:
        if (walks() || input_.button("right")) camera_->look(e.x, e.y);
        break;
    case Kind::Wheel:
        if (walks()) break;
        speed_ = std::clamp(speed_ * std::pow(1.2f, e.y), 0.05f, 500.0f);
        message("flies at " + digits("%.2g", double(speed_)) + " m/s");
        break;
    case Kind::Size:
        if (window_) window_->resize(int(e.x), int(e.y));
        width_ = int(e.x);
        height_ = int(e.y);
        break;
    case Kind::Mouse:
        break;
    }
    return {};
}

Result<void> Player::press(const std::string& key) {
    const bool control = input_.key("left ctrl") || input_.key("right ctrl");
    if (key == "escape") {
        // What lies over the picture or holds the mouse goes first.
        if (!hud_.help.empty()) {
            hud_.help.clear();
        } else if (walks()) {
            return start_or_stop_walking();
        } else {
            done_ = true;
        }
    } else if (control && (key == "z" || key == "y")) {
        auto done = key == "z" ? session_->undo() : session_->redo();
        if (!done) return done.error();
        message(*done ? key == "z" ? "undone" : "redone" : key == "z" ? "nothing to undo" : "nothing to redo");
    } else if (control && key == "s") {
        auto saved = session_->save();
        message(saved ? "saved " + *saved : saved.error().message);
    } else if (control) {
        return {};
    } else if (key == "f") {
        return start_or_stop_walking();
    } else if (key == "space") {
        session_->walk(walk_, kJumpSpeed);
    } else if (key == "h") {
        if (hud_.help.empty())
            hud_.help = lines_of(player_keys());
        else
            hud_.help.clear();
    } else if (key == "p") {
        paused_ = !paused_;
        message(paused_ ? "paused; . makes one step" : "running");
    } else if (key == ".") {
        if (paused_) return session_->step();
    } else if (key == "r") {
        message("from the start");
        return session_->restart();
    } else if (key == "k") {
        auto kept = session_->keep();
        message(kept ? "the world is now what the play made of it" : kept.error().message);
    } else if (key == "g") {
        Edit ball;
        ball.node.shape = Sphere{.radius = kBallRadius};
        ball.node.transform.position = camera_->position() + camera_->forward() * (3 * kBallRadius);
        tell(session_->launch(ball, camera_->forward() * kBallSpeed));
    } else if (key == "v" || (key.size() == 1 && key[0] >= '1' && key[0] <= '9')) {
        const size_t count = std::size(kViews);
        const size_t next = key == "v" ? (size_t(view_) + 1) % count : size_t(key[0] - '1');
        if (next < count) view_ = View(next);
        message("view: " + std::string(kViews[size_t(view_)]));
    } else if (key == "f1") {
        profiler_ = !profiler_;
    } else if (key == "f2") {
        lines_.contacts = !lines_.contacts;
    } else if (key == "f3") {
        lines_.shapes = !lines_.shapes;
    } else if (key == "f4") {
        lines_.sleeping = !lines_.sleeping;
    }
    return {};
}

void Player::fly(float seconds) {
    if (input_.key("left ctrl") || input_.key("right ctrl")) return;
    if (walks()) return walk();
    const float way = seconds * speed_ * (input_.key("left shift") || input_.key("right shift") ? 4.0f : 1.0f);
    camera_->move(axis("d", "a") * way, axis("e", "q") * way, axis("w", "s") * way);
}

void Player::walk() {
    const vec3 way = camera_->along_ground(axis("d", "a"), axis("w", "s"));
    const float speed = input_.key("left shift") || input_.key("right shift") ? kRunSpeed : kWalkSpeed;
    walk_ = way * (speed / std::max(1.0f, length(way)));
    session_->walk(walk_, 0);
}

// Where the camera is, on what is below it.
Result<void> Player::start_or_stop_walking() {
    if (session_->behind() > 0) return {};
    if (walks()) {
        if (auto left = session_->leave(); !left) return left;
        message("flying");
    } else {
        const vec3 eyes = camera_->position();
        auto below = session_->play().cast({.origin = eyes, .direction = {0, -1, 0}});
        if (!below) return below.error();
        const bool solid = below->hit && below->t == 0;
        if (!below->hit || solid) {
            message(solid ? "no room to walk here; fly out of the ground" : "nothing to walk on below");
            return {};
        }
        const auto entered = session_->enter(eyes - vec3{0, std::min(below->t, kEyes), 0});
        message(entered ? "walking; F flies again" : entered.error().message);
    }
    hud_.walks = session_->walker().has_value();
    hold_mouse();
    return {};
}

// Other programs may write the scene, too.
void Player::look_at_files() {
    const std::string before = session_->warning();
    if (session_->look_at_files()) {
        const std::string& changed = session_->changed();
        const std::string news =
            changed + " was changed by another program" +
            (changed == session_->file() ? " and is loaded again" : "; " + session_->file() + " is loaded again");
        message(news);
        o_.say(news);
        if (!session_->note().empty()) o_.say(session_->note());
        hud_.walks = session_->walker().has_value();
        last_input_ = frame_;
    } else if (session_->warning() != before) {
        if (!session_->warning().empty()) o_.say(session_->warning());
        last_input_ = frame_;
        message_left_ = 0;  // seen at once
    }
}

Result<void> Player::use_tools() {
    const bool digs = input_.button("left"), adds = input_.button("middle") || input_.key("b");
    if (!digs && !adds) return session_->end_stroke();
    if (width_ <= 0 || height_ <= 0 || session_->behind() > 0) return {};
    const Ray ray = hud_.walks ? camera_->ray(float(width_) / 2, float(height_) / 2, width_, height_)
                               : camera_->ray(input_.x, input_.y, width_, height_);
    const auto picked = session_->play().pick(ray);
    if (!picked) return picked.error();
    const RayHit* const hit = &picked->hit;
    if (!hit->hit) return {};
    const float radius = std::clamp(kBiteOfDistance * hit->t, kLeastBite, kMostBite);
    const vec3 at = digs ? hit->position : hit->position + hit->normal * (0.5f * radius);
    // A mouse that stays where it is drills on slowly, however deep the last bite was.
    const float beside = length(cross(ray.direction, bite_towards_)) * hit->t;
    if (session_->in_stroke() && frame_ - last_bite_ < kFramesABite && beside < 0.5f * radius) return {};
    session_->begin_stroke(digs ? "dig" : "add ground");
    tell(session_->dig(at, radius, !digs, picked->body));
    last_bite_ = frame_;
    bite_towards_ = ray.direction;
    return {};
}

void Player::describe(const RenderStats& stats) {
    hud_.profiler.clear();
    if (!profiler_) return;
    const PlayCounts counts = session_->counts();
    std::vector<std::string>& out = hud_.profiler;
    // A replay shows no times: its pictures are the same on every run.
    if (!replays() && frame_seconds_ > 0)
        out.push_back(digits("%.1f", 1 / frame_seconds_) + " fps " + digits("%.1f", 1000 * frame_seconds_) + " ms");
    out.push_back(std::to_string(stats.rays_across) + "x" + std::to_string(stats.rays_down) + " rays, " +
                  std::to_string(stats.bricks) + " bricks, " + std::to_string(stats.edits) + " edits");
    out.push_back(std::to_string(counts.bodies) + " bodies, " + std::to_string(counts.awake) + " awake, " +
                  std::to_string(counts.parts) + " came loose");
    if (replays()) return;
    auto passes = stats.passes;
    std::stable_sort(passes.begin(), passes.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
    for (size_t i = 0; i < std::min<size_t>(passes.size(), 6); ++i)
        out.push_back(digits("%6.1f ms ", passes[i].second) + passes[i].first);
}

std::string Player::ui_line(const std::vector<std::pair<std::string, Rect>>& widgets) {
    std::string places;
    for (const auto& [id, r] : widgets)
        places += (places.empty() ? "" : ", ") + ("\"" + id) + "\": [" + std::to_string(r.x) + ", " +
                  std::to_string(r.y) + ", " + std::to_string(r.width) + ", " + std::to_string(r.height) + "]";
    const PlayCounts counts = session_->counts();
    std::string walker = "null";
    if (const auto who = session_->walker())
        walker = "[" + digits("%.3f", double(who->feet.x)) + ", " + digits("%.3f", double(who->feet.y)) + ", " +
                 digits("%.3f", double(who->feet.z)) + "]";
    char hash[20];
    std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(session_->world_hash()));
    return "{\"frame\": " + std::to_string(frame_) + ", \"widgets\": {" + places +
           "}, \"selection\": null, \"dirty\": " + (session_->dirty() ? "true" : "false") +
           ", \"undo_depth\": " + std::to_string(session_->undo_depth()) + ", \"size\": [" + std::to_string(width_) +
           ", " + std::to_string(height_) + "], \"view\": \"" + std::string(kViews[size_t(view_)]) +
           "\", \"paused\": " + (paused_ ? "true" : "false") + ", \"steps\": " + std::to_string(session_->steps()) +
           ", \"bodies\": " + std::to_string(counts.bodies) + ", \"awake\": " + std::to_string(counts.awake) +
           ", \"parts\": " + std::to_string(counts.parts) + ", \"walker\": " + walker + ", \"world\": \"" + hash +
           "\"}\n";
}

Result<Picture> Player::draw(double seconds) {
    const FrameBudget budget =
        replays() ? FrameBudget{.bricks = kBakeBricks} : FrameBudget{.bricks = UINT32_MAX, .seconds = kBakeSeconds};
    if (const auto who = session_->walker()) camera_->place(who->feet + vec3{0, kEyes, 0});
    auto frame = session_->play().frame(camera_->camera(), lines_, budget);
    if (!frame) return frame.error();
    RenderSettings s = settings();
    s.elapsed = float(seconds);
    auto picture = renderer_->render(*frame, s);
    if (!picture) return picture;
    if (picture->width == width_ && picture->height == height_) return picture;
    return picture->stretched(width_, height_);
}

Result<void> Player::run() {
    using Clock = std::chrono::steady_clock;
    const auto since = [](Clock::time_point t) { return std::chrono::duration<double>(Clock::now() - t).count(); };
    const double shortest = window_ ? 1 / window_->refresh_rate() : 0;
    Picture last;
    Clock::time_point before = Clock::now();
    for (; !done_ && (o_.frames == 0 || frame_ < o_.frames); ++frame_) {
        const Clock::time_point start = Clock::now();
        const double real = std::chrono::duration<double>(start - std::exchange(before, start)).count();
        const double seconds = replays() ? kReplayStep : std::min(real, kLongestFrame);
        message_left_ -= replays() ? kReplayStep : real;
        if (auto taken = take_events(); !taken) return taken;
        looked_ += replays() ? kLookAtFile / kFramesALook : real;
        if (looked_ >= kLookAtFile) {
            look_at_files();
            looked_ = 0;
        }
        fly(float(seconds));
        if (auto used = use_tools(); !used) return used;
        const double budget = replays() ? std::numeric_limits<double>::infinity() : kCatchUp;
        if (auto gone = session_->advance(paused_ ? 0 : seconds, budget); !gone) {
            paused_ = true;  // and the world is there to be looked at, and saved
            message("the play stopped: " + gone.error().message);
        }
        if (window_ && rests()) {
            window_->wait(0.2);
            continue;
        }
        std::vector<std::pair<std::string, Rect>> widgets;
        bool hidden = width_ <= 0 || height_ <= 0;
        if (!hidden) {
            auto picture = draw(seconds);
            if (!picture) return picture.error();
            if (message_left_ <= 0) hud_.message = session_->warning();
            describe(renderer_->stats());
            widgets = hud_.draw(*picture);
            last = std::move(*picture);
            choose_rung(since(start));
            frame_seconds_ = frame_seconds_ > 0 ? 0.9 * frame_seconds_ + 0.1 * real : real;
            if (window_) {
                auto shown = renderer_->show(last, window_->width(), window_->height());
                if (!shown) return shown.error();
                hidden = *shown != Shown::Yes;
            }
        }
        if (!o_.ui_json.empty()) ui_ += ui_line(widgets);
        // Where the screen does not set the pace, the clock does.
        if (window_ && hidden) window_->wait(0.1);
        if (window_ && o_.keys.empty()) Window::sleep(shortest - since(start));
    }
    if (auto ended = session_->end_stroke(); !ended) return ended;
    if (!o_.screenshot.empty()) {
        if (last.srgb.empty()) return Error{"--screenshot: no frame was drawn"};
        if (auto saved = last.save(o_.screenshot); !saved) return saved;
    }
    if (!o_.ui_json.empty())
        if (auto written = write_whole(o_.ui_json, ui_); !written) return written;
    return {};
}

void Player::leave() const {
    if (const std::string lost = session_->farewell(); !lost.empty()) o_.say(lost);
}

}  // namespace

namespace {

const Player* running = nullptr;

// A window system whose server is gone ends the process itself (Xlib: exit), from within any of its calls.
void ended_from_below() {
    if (!running) return;
    running->options().say("kiln: the display was lost");
    std::exchange(running, nullptr)->leave();
}

}  // namespace

Result<void> run_player(const PlayerOptions& options) {
    static const int registered = std::atexit(ended_from_below);
    (void)registered;
    Player player(options);
    if (auto opened = player.open(); !opened) return opened;
    running = &player;
    auto done = player.run();
    player.leave();
    running = nullptr;
    return done;
}

std::span<const std::string_view> view_names() { return kViews; }

std::string_view player_keys() {
    return "left mouse        dig, and cut bodies; what is cut off falls\n"
           "middle mouse, B   add ground\n"
           "right mouse       look around; with W A S D fly, Q and E down and up,\n"
           "                  Shift faster; the wheel sets the speed\n"
           "F                 walk, and fly again: W A S D, Shift runs, Space jumps,\n"
           "                  the mouse looks; digs where the cross is\n"
           "G                 throw a ball\n"
           "Ctrl+Z, Ctrl+Y    undo a stroke or a throw, redo it\n"
           "P, .              pause, make one step\n"
           "R                 run from the start\n"
           "K, Ctrl+S         make the world what the play made of it, save it\n"
           "V, 1 to 7         views\n"
           "F1 F2 F3 F4       profiler, contacts, shapes of bodies, sleeping bodies\n"
           "H                 these keys, over the picture\n"
           "Esc               close them, stop walking, quit";
}

}  // namespace kiln::player

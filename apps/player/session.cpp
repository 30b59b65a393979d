// SPDX-License-Identifier: MIT
#include "player/session.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <filesystem>
#include <utility>

namespace kiln::player {

namespace {

std::string number(float value) {
    char buffer[32];
    return std::string(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
}

}  // namespace

Result<std::unique_ptr<Session>> Session::open(const std::string& scene, const std::string& backend) {
    std::unique_ptr<Session> out(new Session);
    out->scene_ = scene;
    out->backend_ = backend;
    const auto bundled = bundled_scenes();
    const bool is_bundled =
        std::any_of(bundled.begin(), bundled.end(), [&](const auto& s) { return s.first == scene; });
    out->file_ = is_bundled ? scene + ".kiln.json" : scene;
    Result<World> world = Error{};
    if (!is_bundled) {
        world = World::open(scene);
        out->journaled_ = bool(world);
        out->own_file_ = out->journaled_;
        if (!world && world.error().kind == ErrorKind::Input) return world.error();
        if (!world) out->note_ = world.error().message + "; what is changed is kept only by saving";
    }
    if (!out->journaled_) {
        world = World::load(scene);
        if (!world) return world.error();
    }
    out->world_ = std::make_unique<World>(std::move(*world));
    if (const auto report = out->world_->journal_report()) out->note_ = report->sentence();
    auto base = World::load(scene);
    if (!base) return base.error();
    out->base_ = std::make_unique<World>(std::move(*base));
    out->first_ = out->world_->history().now();
    if (auto started = out->start(); !started) return started.error();
    return out;
}

Result<void> Session::start() {
    play_.reset();
    auto play = Play::start(*base_, {.backend = backend_});
    if (!play) return play.error();
    play_.emplace(std::move(*play));
    steps_ = 0;
    return {};
}

Result<void> Session::perform_due() {
    for (; next_due_ < due_.size() && due_[next_due_].at <= steps_; ++next_due_) {
        const Due& due = due_[next_due_];
        const auto done =
            due.command ? play_->apply(*due.command, "a dig") : play_->launch(due.action->edit, due.action->velocity);
        if (!done) return done;
    }
    return {};
}

Result<void> Session::run_again(int64_t to) {
    if (auto started = start(); !started) return started;
    due_.clear();
    next_due_ = 0;
    for (size_t i = 0; i < done_; ++i) {
        const Action& a = actions_[i];
        for (const Action::Dig& dig : a.digs) due_.push_back({dig.at, &a, &dig.command});
        if (a.kind == Action::Kind::Launch) due_.push_back({a.at, &a, nullptr});
    }
    std::stable_sort(due_.begin(), due_.end(), [](const Due& a, const Due& b) { return a.at < b.at; });
    wanted_ = to;
    return perform_due();
}

Result<void> Session::step() {
    if (auto done = perform_due(); !done) return done;
    if (auto stepped = play_->step(); !stepped) return stepped;
    ++steps_;
    wanted_ = std::max(wanted_, steps_);
    return perform_due();
}

Result<void> Session::advance(double seconds, double budget) {
    const auto start = std::chrono::steady_clock::now();
    while (behind() > 0) {
        if (auto stepped = step(); !stepped) return stepped;
        if (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() > budget) return {};
    }
    auto made = play_->advance(seconds);
    if (!made) return made.error();
    steps_ += *made;
    wanted_ = steps_;
    return {};
}

void Session::add(Action action) {
    actions_.resize(done_);
    // What a play that is run again still had to be told pointed into them.
    due_.clear();
    next_due_ = 0;
    actions_.push_back(std::move(action));
    ++done_;
}

void Session::begin_stroke(const std::string& title) {
    if (stroke_) return;
    History history = world_->history();
    stroke_.emplace();
    stroke_->at = steps_;
    stroke_->parts_before = counts().parts;
    stroke_->before = history.now();
    history.begin_group(title);
}

Result<void> Session::end_stroke() {
    if (!stroke_) return {};
    Action stroke = std::move(*stroke_);
    stroke_.reset();
    if (stroke.digs.empty()) return world_->history().cancel_group();
    if (auto ended = world_->history().end_group(); !ended) return ended;
    stroke.after = world_->history().now();
    add(std::move(stroke));
    return {};
}

Result<void> Session::dig(vec3 at, float radius, bool add) {
    if (!stroke_ || behind() > 0) return {};
    std::string name;
    do name = (add ? "heap" : "dig") + std::to_string(++named_);
    while (world_->find_edit(name));
    const std::string command = "{\"add\": {\"id\": \"" + name +
                                "\", \"shape\": \"sphere\", \"radius\": " + number(radius) + ", \"position\": [" +
                                number(at.x) + ", " + number(at.y) + ", " + number(at.z) + "], \"op\": \"" +
                                (add ? "union" : "subtract") + "\", \"blend_radius\": " + number(radius * 0.25f) + "}}";
    // Both or none.
    if (auto applied = play_->apply(command, "a dig"); !applied) return applied;
    if (auto applied = world_->apply(command, "a dig"); !applied) {
        (void)play_->apply("{\"remove\": \"" + name + "\"}", "a dig");
        return applied;
    }
    hash_.reset();
    dirty_ = true;
    stroke_->digs.push_back({steps_, name, command});
    return {};
}

Result<void> Session::launch(const Edit& edit, vec3 velocity) {
    if (behind() > 0) return {};
    if (auto done = play_->launch(edit, velocity); !done) return done;
    Action a;
    a.kind = Action::Kind::Launch;
    a.at = steps_;
    a.edit = edit;
    a.velocity = velocity;
    a.before = a.after = world_->history().now();
    add(std::move(a));
    return {};
}

bool Session::fill_in(const Action& a) {
    if (behind() > 0 || a.kind != Action::Kind::Stroke || counts().parts != a.parts_before) return false;
    for (size_t i = a.digs.size(); i-- > 0;)
        if (!play_->apply("{\"remove\": \"" + a.digs[i].name + "\"}", "undo")) return false;
    return true;
}

Result<bool> Session::undo() {
    if (auto ended = end_stroke(); !ended) return ended.error();
    if (done_ == 0) return false;
    const Action& a = actions_[done_ - 1];
    if (auto gone = world_->history().go_to(a.before); !gone) return gone.error();
    --done_;
    hash_.reset();
    dirty_ = true;
    if (a.kind != Action::Kind::Keep && !fill_in(a))
        if (auto run = run_again(wanted_); !run) return run.error();
    return true;
}

Result<void> Session::perform(Action& a) {
    a.at = steps_;
    a.parts_before = counts().parts;
    if (a.kind == Action::Kind::Launch) return play_->launch(a.edit, a.velocity);
    for (Action::Dig& dig : a.digs) {
        dig.at = steps_;
        if (auto done = play_->apply(dig.command, "redo"); !done) return done;
    }
    return {};
}

Result<bool> Session::redo() {
    if (auto ended = end_stroke(); !ended) return ended.error();
    if (done_ == actions_.size()) return false;
    Action& a = actions_[done_];
    if (auto gone = world_->history().go_to(a.after); !gone) return gone.error();
    ++done_;
    hash_.reset();
    dirty_ = true;
    const auto made = behind() > 0 ? run_again(std::max(wanted_, a.at)) : perform(a);
    if (!made) return made.error();
    return true;
}

Result<void> Session::restart() {
    if (auto ended = end_stroke(); !ended) return ended;
    for (size_t i = 0; i < done_; ++i) {
        Action& a = actions_[i];
        a.at = 0;
        for (Action::Dig& dig : a.digs) dig.at = 0;
    }
    return run_again(0);
}

Result<void> Session::keep() {
    if (auto ended = end_stroke(); !ended) return ended;
    if (behind() > 0) return Error{"keep: the play is still being run again; try once more in a moment"};
    History history = world_->history();
    Action a;
    a.kind = Action::Kind::Keep;
    a.at = steps_;
    a.before = history.now();
    // What the play has become holds all that was dug.
    if (auto gone = history.go_to(first_); !gone) return gone;
    if (auto kept = play_->keep(*world_); !kept) {
        if (auto back = history.go_to(a.before); !back) return back;
        return kept;
    }
    a.after = history.now();
    hash_.reset();
    dirty_ = true;
    add(std::move(a));
    return {};
}

Result<std::string> Session::save() {
    if (auto ended = end_stroke(); !ended) return ended.error();
    std::error_code code;
    if (!own_file_ && std::filesystem::exists(file_, code))
        return Error{"save: " + file_ + " is there already; move it away, or play it with `kiln view " + file_ + "`"};
    if (auto saved = world_->save(file_); !saved) return saved.error();
    own_file_ = true;
    dirty_ = false;
    return file_;
}

std::string Session::farewell() const {
    if (!dirty_) return {};
    if (journaled_)
        return file_ + " was not saved; its journal has what was changed, and the next start goes on from there";
    return "what was changed in " + scene_ + " was not saved; Ctrl+S would have written " + file_;
}

uint64_t Session::world_hash() {
    if (hash_) return *hash_;
    uint64_t h = 0xcbf29ce484222325ull;  // FNV-1a, 64 bits
    for (const char c : world_->to_json()) h = (h ^ uint8_t(c)) * 0x100000001b3ull;
    return *(hash_ = h);
}

}  // namespace kiln::player

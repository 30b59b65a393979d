// SPDX-License-Identifier: MIT
#include "player/session.h"

#include "player/json.h"

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
    const bool is_bundled = is_bundled_scene(scene);
    out->file_ = is_bundled ? scene + ".kiln.json" : scene;
    Result<World> world = Error{};
    std::error_code code;
    if (!is_bundled) {
        // Before it is read: what comes between the two is a change.
        if (std::filesystem::is_regular_file(scene, code)) out->watch_.emplace(scene);
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
    out->is_saved();
    if (const auto report = out->world_->journal_report()) {
        out->note_ = report->sentence();
        if (out->journaled_ && report->commands > 0) out->saved_.reset();
    }
    auto base = World::load(scene);
    if (!base) return base.error();
    out->base_ = std::make_unique<World>(std::move(*base));
    out->first_ = out->world_->history().now();
    out->watch_parts();
    if (auto started = out->start(); !started) return started.error();
    return out;
}

Result<void> Session::start() {
    steps_ = 0;
    if (play_) return play_->restart();
    auto play = Play::start(*base_, {.backend = backend_});
    if (!play) return play.error();
    play_.emplace(std::move(*play));
    return {};
}

Result<void> Session::tell(const Told& told) {
    switch (told.what) {
    case Told::What::Command:
        if (auto done = play_->apply(told.command, told.of_world ? "a dig" : "a cut"); !done && told.of_world)
            return done;
        return {};  // a body that has not come about this time, or lies elsewhere, is not cut
    case Told::What::Launch:
        return play_->launch(told.edit, told.vector);
    case Told::What::Enter:
        return play_->enter(told.vector);
    case Told::What::Walk:
        play_->walk(told.vector, told.jump);
        return {};
    case Told::What::Leave:
        play_->leave();
        return {};
    }
    return {};
}

Result<void> Session::perform_due() {
    for (; next_due_ < due_.size() && due_[next_due_].at <= steps_; ++next_due_)
        if (auto done = tell(due_[next_due_]); !done) return done;
    return {};
}

Result<void> Session::run_again(int64_t to) {
    if (auto started = start(); !started) return started;
    due_ = walks_;
    next_due_ = 0;
    for (size_t i = 0; i < done_; ++i) due_.insert(due_.end(), actions_[i].told.begin(), actions_[i].told.end());
    std::sort(due_.begin(), due_.end(),
              [](const Told& a, const Told& b) { return a.at != b.at ? a.at < b.at : a.order < b.order; });
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
    actions_.push_back(std::move(action));
    ++done_;
}

void Session::begin_stroke(const std::string& title) {
    if (stroke_) return;
    History history = world_->history();
    stroke_.emplace();
    stroke_->parts_before = counts().parts;
    stroke_->before = history.now();
    history.begin_group(title);
}

Result<void> Session::end_stroke() {
    if (!stroke_) return {};
    Action stroke = std::move(*stroke_);
    stroke_.reset();
    if (stroke.told.empty()) return world_->history().cancel_group();
    if (auto ended = world_->history().end_group(); !ended) return ended;
    stroke.after = world_->history().now();
    add(std::move(stroke));
    return {};
}

Result<void> Session::dig(vec3 at, float radius, bool add, const std::string& body) {
    if (!stroke_ || behind() > 0) return {};
    Told told = now(Told::What::Command);
    told.of_world = body.empty();
    do told.name = (add ? "heap" : "dig") + std::to_string(++named_);
    while (world_->find_edit(told.name));
    told.command = "{\"add\": {\"id\": \"" + told.name + "\", \"shape\": \"sphere\", \"radius\": " + number(radius) +
                   ", \"position\": [" + number(at.x) + ", " + number(at.y) + ", " + number(at.z) + "], \"op\": \"" +
                   (add ? "union" : "subtract") + "\", \"blend_radius\": " + number(radius * 0.25f) + "}";
    if (!body.empty()) told.command += ", \"target\": " + Json::quoted(body);
    told.command += "}";
    if (auto applied = play_->apply(told.command, "a dig"); !applied) return applied;
    // What is cut from a body is the play's alone, as what it becomes is. Of the ground: both or none.
    if (body.empty()) {
        if (auto applied = world_->apply(told.command, "a dig"); !applied) {
            (void)play_->apply("{\"remove\": \"" + told.name + "\"}", "a dig");
            return applied;
        }
        hash_.reset();
    }
    stroke_->told.push_back(std::move(told));
    return {};
}

Result<void> Session::launch(const Edit& edit, vec3 velocity) {
    if (behind() > 0) return {};
    if (auto done = play_->launch(edit, velocity); !done) return done;
    Told told = now(Told::What::Launch);
    told.edit = edit;
    told.vector = velocity;
    Action a;
    a.kind = Action::Kind::Launch;
    a.before = a.after = world_->history().now();
    a.told.push_back(std::move(told));
    add(std::move(a));
    return {};
}

Result<void> Session::enter(vec3 feet) {
    if (behind() > 0) return {};
    Told told = now(Told::What::Enter);
    told.vector = feet;
    if (auto done = tell(told); !done) return done;
    walks_.push_back(std::move(told));
    walk_ = {};
    return {};
}

void Session::walk(vec3 velocity, float jump) {
    if (behind() > 0 || !walker() || (velocity == walk_ && jump == 0)) return;
    Told told = now(Told::What::Walk);
    told.vector = walk_ = velocity;
    told.jump = jump;
    play_->walk(velocity, jump);
    walks_.push_back(std::move(told));
}

Result<void> Session::leave() {
    if (behind() > 0 || !walker()) return {};
    walks_.push_back(now(Told::What::Leave));
    return tell(walks_.back());
}

bool Session::fill_in(const Action& a) {
    if (behind() > 0 || a.kind != Action::Kind::Stroke || counts().parts != a.parts_before) return false;
    for (const Told& dig : a.told)
        if (!dig.of_world) return false;
    for (size_t i = a.told.size(); i-- > 0;)
        if (!play_->apply("{\"remove\": \"" + a.told[i].name + "\"}", "undo")) return false;
    return true;
}

Result<bool> Session::undo() {
    if (auto ended = end_stroke(); !ended) return ended.error();
    if (done_ == 0) return false;
    const Action& a = actions_[done_ - 1];
    if (auto gone = world_->history().go_to(a.before); !gone) return gone.error();
    --done_;
    hash_.reset();
    if (a.kind != Action::Kind::Keep && !fill_in(a))
        if (auto run = run_again(wanted_); !run) return run.error();
    return true;
}

Result<void> Session::perform(Action& a) {
    a.parts_before = counts().parts;
    for (Told& told : a.told) {
        told.at = steps_;
        told.order = ++order_;
        if (auto done = tell(told); !done) return done;
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
    const auto made = behind() > 0 ? run_again(std::max(wanted_, a.told.empty() ? 0 : a.told.front().at)) : perform(a);
    if (!made) return made.error();
    return true;
}

Result<void> Session::restart() {
    if (auto ended = end_stroke(); !ended) return ended;
    for (size_t i = 0; i < done_; ++i)
        for (Told& told : actions_[i].told) told.at = 0;
    // Who walks goes on from where they are.
    const auto who = walker();
    walks_.clear();
    walk_ = {};
    if (who) {
        Told told = now(Told::What::Enter);
        told.at = 0;
        told.vector = who->feet;
        walks_.push_back(std::move(told));
    }
    return run_again(0);
}

Result<void> Session::keep() {
    if (auto ended = end_stroke(); !ended) return ended;
    if (behind() > 0) return Error{"keep: the play is still being run again; try once more in a moment"};
    History history = world_->history();
    Action a;
    a.kind = Action::Kind::Keep;
    a.before = history.now();
    // What the play has become holds all that was dug.
    if (auto gone = history.go_to(first_); !gone) return gone;
    if (auto kept = play_->keep(*world_); !kept) {
        if (auto back = history.go_to(a.before); !back) return back;
        return kept;
    }
    a.after = history.now();
    hash_.reset();
    add(std::move(a));
    return {};
}

bool Session::dirty() const {
    const bool digs =
        stroke_ && std::any_of(stroke_->told.begin(), stroke_->told.end(), [](const Told& t) { return t.of_world; });
    return digs || world_->history().now() != saved_;
}

Result<void> Session::reload() {
    const std::string text = text_of(file_);
    std::unique_ptr<Session> next(new Session);
    next->scene_ = next->file_ = file_;
    next->backend_ = backend_;
    next->watch_ = watch_;
    next->watch_->know(hash_of(text));
    for (auto* const world : {&next->world_, &next->base_}) {
        auto parsed = World::parse(text, file_);
        if (!parsed) return parsed.error();
        *world = std::make_unique<World>(std::move(*parsed));
    }
    next->watch_parts();
    if (auto started = next->start(); !started) return started;
    const auto who = walker();
    world_.reset();  // lets go of the journal
    if (auto opened = World::open(file_)) {
        *next->world_ = std::move(*opened);
        next->journaled_ = next->own_file_ = true;
        if (const auto report = next->world_->journal_report()) next->note_ = report->sentence();
    } else {
        next->note_ = opened.error().message + "; what is changed is kept only by saving";
    }
    next->first_ = next->world_->history().now();
    next->is_saved();
    if (who) (void)next->enter(who->feet);
    std::swap(*this, *next);
    return {};
}

void Session::watch_parts() {
    parts_.clear();
    if (!watch_ || text_of(file_).find("\"file\"") == std::string::npos)
        return;  // as a world of 10⁶ edits, whose text takes seconds
    std::error_code code;
    for (const std::string& name : world_->files()) {
        if (!std::filesystem::equivalent(name, file_, code))
            parts_.push_back({name, WatchedFile(name), std::filesystem::exists(name, code), {}, {}});
    }
}

bool Session::look_at_parts() {
    std::string warning;
    for (Part& part : parts_) {
        const std::string name = std::filesystem::path(part.name).filename().string();
        const auto state = part.watch.look();
        if (state == WatchedFile::State::Gone && part.there) {
            warning = name + " is gone; the scene keeps what it had of it";
        } else if (state == WatchedFile::State::Changed && dirty()) {
            part.tried.reset();
            warning = name +
                      " was changed by another program, and your changes are not saved: the scene is loaded with it "
                      "once they are saved, or all undone";
        } else if (state == WatchedFile::State::Changed && part.tried == part.watch.found()) {
            warning = part.fault;
        } else if (state == WatchedFile::State::Changed) {
            part.tried = part.watch.found();
            const std::string changed = part.name;
            auto done = reload();
            if (done) {
                changed_ = changed;
                return true;
            }
            warning = part.fault = done.error().message;
        }
        if (!warning.empty()) break;
    }
    warning_ = warning;
    return false;
}

bool Session::look_at_files() {
    if (!watch_) return false;
    const auto name = [&] { return std::filesystem::path(file_).filename().string(); };
    switch (watch_->look()) {
    case WatchedFile::State::Same:
        return look_at_parts();
    case WatchedFile::State::Gone:
        warning_ = name() + " is gone; Ctrl+S writes it again";
        break;
    case WatchedFile::State::Changed:
        if (dirty()) {
            tried_.reset();
            warning_ = name() +
                       " was changed by another program, and your changes are not saved: Ctrl+S writes yours and keeps "
                       "the other's beside it; undoing all of yours loads the other's";
            break;
        }
        if (tried_ == watch_->found()) break;
        tried_ = watch_->found();
        if (auto done = reload(); !done) {
            warning_ = done.error().message;
            break;
        }
        changed_ = file_;
        return true;
    }
    return false;
}

Result<std::string> Session::save() {
    if (auto ended = end_stroke(); !ended) return ended.error();
    std::error_code code;
    if (!own_file_ && std::filesystem::exists(file_, code))
        return Error{"save: " + file_ + " is there already; move it away, or play it with `kiln view " + file_ + "`"};
    std::string said = file_;
    if (watch_ && watch_->look() == WatchedFile::State::Changed) {
        const std::string other = free_name_beside(file_, "other");
        if (!std::filesystem::copy_file(file_, other, code))
            return Error{"save: what another program wrote to " + file_ + " cannot be kept in " + other + ": " +
                         code.message()};
        said += "; what another program had written there is in " + other;
    }
    if (auto saved = world_->save(file_); !saved) return saved.error();
    own_file_ = true;
    is_saved();
    watch_.emplace(file_);
    warning_.clear();
    return said;
}

std::string Session::farewell() {
    if (!dirty()) return {};
    if (!journaled_) return "what was changed in " + scene_ + " was not saved; Ctrl+S would have written " + file_;
    const auto state = watch_ ? watch_->look() : WatchedFile::State::Same;
    if (state == WatchedFile::State::Same)
        return file_ + " was not saved; its journal has what was changed, and the next start goes on from there";
    const std::string found =
        file_ + (state == WatchedFile::State::Gone
                     ? " is gone"
                     : " was changed by another program, and the next start opens it as it is there");
    const std::string mine = free_name_beside(file_, "unsaved");
    if (auto saved = world_->save(mine); !saved)
        return found + "; what was changed here is in its journal only: " + saved.error().message;
    return found + "; what was changed here is in " + mine;
}

uint64_t Session::world_hash() {
    if (!hash_) hash_ = hash_of(world_->to_json());
    return *hash_;
}

}  // namespace kiln::player

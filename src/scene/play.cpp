// SPDX-License-Identifier: MIT
// Play: a simulation fed with the time that goes by, and its pictures. Bodies of edits are movers of the simulation's own world
// (movers.h), bodies of meshes move the frame's meshes.

#include "physics/debug_lines.h"
#include "scene/simulation.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace kiln {

namespace {

constexpr int kMostSteps = 4;  // that one advance() makes
constexpr float kLineWidthPx = 1.5f;
constexpr float kContactHidden = 0.75f;  // normals point into the other body: they are to be seen through it

// Along the shorter way round; a step turns things so little that the straight line is as good as the arc.
Pose blend(const Pose& a, const Pose& b, float t) {
    const quat p = a.rotation, q = b.rotation;
    const float sign = p.x * q.x + p.y * q.y + p.z * q.z + p.w * q.w < 0 ? -t : t, s = 1 - t;
    const quat r{s * p.x + sign * q.x, s * p.y + sign * q.y, s * p.z + sign * q.z, s * p.w + sign * q.w};
    const float size = std::sqrt(r.x * r.x + r.y * r.y + r.z * r.z + r.w * r.w);
    if (!(size > 0)) return b;
    return {a.position * s + b.position * t, {r.x / size, r.y / size, r.z / size, r.w / size}};
}

}  // namespace

namespace scene {

// Of the bodies that meshes are: the frame's meshes stand where those are.
void Simulation::move_meshes(Frame& frame, float between) {
    const World::Impl& impl = *live_->impl_;
    const std::vector<SceneMesh>& meshes = impl.data.meshes;
    const bool first = meshes_shown_.size() != meshes.size();
    meshes_shown_.resize(meshes.size());
    size_t drawn = 0;
    for (size_t i = 0; i < meshes.size(); ++i) {
        if (!impl.meshes.drawn(impl.data, i)) continue;
        MeshInstance& instance = frame.meshes[drawn++];
        const std::vector<SceneBody>& bodies = start_.impl_->data.bodies;
        const auto body =
            std::find_if(bodies.begin(), bodies.end(), [&](const SceneBody& b) { return b.mesh == meshes[i].id; });
        if (body != bodies.end()) {
            const Member& m = members_[size_t(body - bodies.begin())];
            const Pose pose = blend(m.before, state(m).pose, between);
            instance.transform = {pose.position, pose.rotation, meshes[i].transform.scale};
        }
        instance.before = first ? instance.transform : meshes_shown_[i];
        meshes_shown_[i] = instance.transform;
    }
}

Result<Frame> Simulation::frame(const Camera& camera, float between, const PlayLines& shown,
                                const FrameBudget& budget) {
    const auto world = live();
    if (!world) return world.error();
    for (const Member& m : members_) {
        const auto edit = m.edit.empty() || m.gone ? std::nullopt : (*world)->find_edit(m.edit);
        if (!edit) continue;
        if (auto moved = (*world)->move(*edit, blend(m.before, state(m).pose, between)); !moved) return moved.error();
    }
    for (const Walker& w : walkers_) {
        const auto edit = (*world)->find_edit(w.shown);
        if (!edit) continue;  // a command took it away
        const Pose pose = blend({w.before, {}}, {w.character.position(), {}}, between);
        if (auto moved = (*world)->move(*edit, pose); !moved) return moved.error();
    }
    fit_field();
    auto frame = (*world)->frame(camera, budget);
    if (!frame) return frame;
    move_meshes(*frame, between);
    frame->time = time() - (1 - double(between)) * step_seconds();
    frame->time_before = std::exchange(time_shown_, frame->time);
    for (const Crumb& c : crumbs_)
        frame->particles.push_back({.position = blend({c.before, {}}, {c.position, {}}, between).position,
                                    .before = c.before,
                                    .radius = c.radius,
                                    .color = c.color,
                                    .opacity = 1});
    std::vector<physics::BodyId> outlined;
    for (const Member& m : members_)
        if (!m.rest && !m.gone && (shown.shapes || (shown.sleeping && world_->state(m.body).asleep)))
            outlined.push_back(m.body);
    for (const Walker& w : walkers_)
        if (shown.shapes) outlined.push_back(w.character.body());
    for (const physics::Line& line : physics::lines(*world_, outlined, {.contacts = false}))
        frame->lines.push_back({line.a, line.b, line.color, kLineWidthPx});
    if (!shown.contacts) return frame;
    for (const physics::Line& line : physics::lines(*world_, {}))
        frame->lines.push_back({line.a, line.b, line.color, kLineWidthPx, kContactHidden});
    return frame;
}

}  // namespace scene

// A world that is edited while a copy of it, as it was at the beginning, is played.
struct Play::Session {
    Session(World& edited, World copy) : world(&edited), start(std::move(copy)), from(edited.history().now()) {}
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;
    ~Session() { (void)stop(); }

    // Commands that it has not taken yet.
    Result<void> tell(const scene::Simulation& simulation) {
        for (; taken < simulation.made().size(); ++taken)
            if (auto done = world->apply(simulation.made()[taken], "play"); !done) return done;
        return {};
    }
    Result<void> stop() {
        if (!open) return {};
        History history = world->history();
        if (auto done = history.end_group(); !done) return done;
        open = false;
        return history.now() == from ? Result<void>() : history.go_to(from);
    }
    Result<void> keep(const scene::Simulation& simulation) {
        if (!open) return Error{"playing: it has ended already; begin another", ErrorKind::Usage};
        if (auto done = tell(simulation); !done) return done;
        if (auto done = simulation.keep_motion(*world); !done) return done;
        if (auto done = world->history().end_group(); !done) return done;
        open = false;
        return {};
    }

    World* world;
    World start;
    uint32_t from;
    size_t taken = 0;
    bool open = true;
};

Play::Play(std::unique_ptr<scene::Simulation> simulation) : simulation_(std::move(simulation)) {}
Play::Play(Play&&) noexcept = default;
Play& Play::operator=(Play&&) noexcept = default;
Play::~Play() = default;

Result<Play> Play::start(const World& world, const SimulateSettings& settings) {
    auto made = scene::Simulation::make(world, settings);
    if (!made) return made.error();
    return Play(std::move(*made));
}

Result<Play> Play::begin(World& world, const SimulateSettings& settings) {
    auto session = std::make_unique<Session>(world, World::Impl::copy_of(world));
    auto made = scene::Simulation::make(session->start, settings);
    if (!made) {
        session->open = false;
        return made.error();
    }
    world.history().begin_group("play");
    Play out(std::move(*made));
    out.session_ = std::move(session);
    return out;
}

Result<void> Play::tell() { return session_ && session_->open ? session_->tell(*simulation_) : Result<void>(); }

Result<void> Play::stop() {
    if (!session_) return Error{"playing: only what begin() began is stopped", ErrorKind::Usage};
    return session_->stop();
}

Result<void> Play::keep() {
    if (!session_) return Error{"playing: say which world keeps it, or begin() with one", ErrorKind::Usage};
    return session_->keep(*simulation_);
}

Result<void> Play::restart() {
    if (session_) return Error{"playing: what begin() began does not begin anew; stop it first", ErrorKind::Usage};
    auto again = scene::Simulation::again(*simulation_);
    if (!again) return again.error();
    simulation_ = std::move(*again);
    events_.clear();
    ahead_ = 0;
    between_ = 1;
    return {};
}

Result<void> Play::make_step() {
    if (auto done = simulation_->step(); !done) return done;
    events_.insert(events_.end(), simulation_->events().begin(), simulation_->events().end());
    return {};
}

Result<void> Play::step() {
    between_ = 1;
    events_.clear();
    if (auto done = make_step(); !done) return done;
    return tell();
}

Result<int> Play::advance(double seconds) {
    if (!std::isfinite(seconds) || seconds < 0)
        return Error{"playing: time goes on by a finite number of seconds, 0 or more", ErrorKind::Usage};
    const double step = simulation_->step_seconds();
    ahead_ += seconds;
    events_.clear();
    int made = 0;
    for (; made < kMostSteps && ahead_ >= step; ++made, ahead_ -= step)
        if (auto done = make_step(); !done) return done.error();
    if (auto done = tell(); !done) return done.error();
    if (ahead_ >= step) {
        const double left = std::fmod(ahead_, step);
        dropped_ += ahead_ - left;
        ahead_ = left;
    }
    between_ = float(ahead_ / step);
    return made;
}

double Play::time() const { return simulation_->time(); }

Result<void> Play::apply(const std::string& command, const std::string& name) {
    if (auto done = simulation_->command_now(command, name); !done) return done;
    return tell();
}

Result<void> Play::keep(World& world) const { return simulation_->keep(world); }

Result<Frame> Play::frame(const Camera& camera, const PlayLines& lines, const FrameBudget& budget) {
    return simulation_->frame(camera, between_, lines, budget);
}

Result<void> Play::launch(Edit edit, vec3 velocity) { return simulation_->launch(std::move(edit), velocity); }
Result<RayHit> Play::cast(const Ray& ray) { return simulation_->cast(ray); }
Result<PlayHit> Play::pick(const Ray& ray) { return simulation_->pick(ray); }
Result<void> Play::enter(vec3 feet) { return simulation_->enter(feet); }
void Play::walk(vec3 velocity, float jump) { simulation_->wish(velocity, jump); }
void Play::leave() { simulation_->leave(); }
std::optional<PlayWalker> Play::walker() const { return simulation_->visitor(between_); }
std::vector<PlayBody> Play::bodies() const {
    std::vector<PlayBody> out;
    for (const scene::Simulation::Member& m : simulation_->members()) {
        if (m.gone) continue;
        const physics::BodyState s = simulation_->state(m);
        out.push_back({m.id, s.pose, s.linear_velocity, s.angular_velocity, s.asleep});
    }
    return out;
}
PlayCounts Play::counts() const { return simulation_->counts(); }

}  // namespace kiln

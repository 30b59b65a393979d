// SPDX-License-Identifier: MIT
// World: its bodies, run from their start, and their ways as JSON.

#include "scene/json_source.h"
#include "scene/simulation.h"

#include "base/format.h"

#include <cmath>

namespace kiln {

namespace {

constexpr double kMostSteps = 1e7;

class Text {
public:
    Text& raw(std::string_view s) {
        out += s;
        return *this;
    }
    Text& number(float v) { return raw(scene::shortest(v)); }
    Text& number(double v) { return number(float(v)); }
    /// To the microsecond: 0.016667, not what a float makes of a sixtieth.
    Text& time(double seconds) { return raw(scene::shortest(std::round(seconds * 1e6) / 1e6)); }
    Text& quoted(std::string_view s) { return raw(scene::json_quoted(s)); }
    Text& key(std::string_view k) { return raw("\"").raw(k).raw("\": "); }
    Text& vector(vec3 v) { return raw("[").number(v.x).raw(", ").number(v.y).raw(", ").number(v.z).raw("]"); }
    Text& rotation(quat q) {
        return raw("[").number(q.x).raw(", ").number(q.y).raw(", ").number(q.z).raw(", ").number(q.w).raw("]");
    }
    /// A comma, but not before the first.
    Text& next() {
        if (!out.empty()) raw(",");
        return *this;
    }
    std::string out;
};

}  // namespace

std::vector<PhysicsBackend> physics_backends() {
    std::vector<PhysicsBackend> out;
    for (const physics::Backend& b : physics::backends()) out.push_back({b.name, b.why_not});
    return out;
}

Result<std::string> World::simulate_json(const SimulateSettings& settings,
                                         const std::function<Result<void>(Play&)>& each) const {
    const double step = double(impl_->data.physics.step), steps = std::round(settings.seconds / step);
    if (!std::isfinite(settings.seconds) || settings.seconds < 0 || !(steps <= kMostSteps))
        return Error{formatted("simulating {} s: write a finite time of 0 or more, at most {} steps of {} s",
                               settings.seconds, kMostSteps, impl_->data.physics.step),
                     ErrorKind::Usage};
    if (!std::isfinite(settings.every) || settings.every < 0 || settings.threads < 0)
        return Error{"simulating: the time between frames and the number of threads must be 0 or more",
                     ErrorKind::Usage};
    auto play = Play::start(*this, settings);
    if (!play) return play.error();
    scene::Simulation& simulation = *play->simulation_;
    const physics::World& world = simulation.world();

    Text frames, events;
    const auto frame = [&]() -> Result<void> {
        frames.next().raw("\n  {").key("time").time(simulation.time()).raw(", ").key("bodies").raw("[");
        const char* between = "";
        for (const PlayBody& b : play->bodies()) {
            frames.raw(between).raw("\n    {").key("id").quoted(b.id).raw(", ");
            frames.key("position").vector(b.pose.position).raw(", ");
            frames.key("rotation").rotation(b.pose.rotation).raw(", ");
            frames.key("linear_velocity").vector(b.linear_velocity).raw(", ");
            frames.key("angular_velocity").vector(b.angular_velocity).raw(", ");
            frames.key("asleep").raw(b.asleep ? "true}" : "false}");
            between = ",";
        }
        frames.raw("]");
        if (!simulation.walkers().empty()) {
            frames.raw(", ").key("characters").raw("[");
            between = "";
            for (const scene::Simulation::Walker& w : simulation.walkers()) {
                const physics::Character& c = w.character;
                const vec3 feet = c.position() - vec3{0, 0.5f * w.of->numbers.height, 0};
                frames.raw(between).raw("\n    {").key("id").quoted(w.id).raw(", ");
                frames.key("position").vector(feet).raw(", ");
                frames.key("linear_velocity").vector(c.velocity()).raw(", ").key("floor");
                if (c.on_floor())
                    frames.quoted(simulation.name_of(c.floor())).raw("}");
                else
                    frames.raw("null}");
                between = ",";
            }
            frames.raw("]");
        }
        frames.raw("}");
        return each ? each(*play) : Result<void>();
    };
    const int64_t last = int64_t(steps);
    if (auto done = frame(); !done) return done.error();
    // Frames fall on the steps nearest to multiples of `every`.
    int64_t shown = 1;
    for (int64_t i = 1; i <= last; ++i) {
        if (auto done = play->step(); !done) return done.error();
        for (const PlayEvent& e : play->events()) {
            events.next().raw("\n  {").key("time").time(simulation.time()).raw(", ").key("type").quoted(e.type);
            events.raw(", ").key("a").quoted(e.a).raw(", ").key("b").quoted(e.b).raw("}");
        }
        const bool due = settings.every <= step || i >= int64_t(std::llround(double(shown) * settings.every / step));
        if (!due && i != last) continue;
        if (auto done = frame(); !done) return done.error();
        ++shown;
    }
    Text bodies;
    for (const scene::Simulation::Member& m : simulation.members()) {
        bodies.next().raw("\n  {").key("id").quoted(m.id).raw(", ").key("mass").number(m.mass.mass).raw(", ");
        bodies.key("center_of_mass").vector(m.mass.center).raw("}");
    }
    Text text;
    text.raw("{").key("backend").quoted(world.backend()).raw(",\n").key("bodies").raw("[").raw(bodies.out);
    text.raw("],\n").key("frames").raw("[").raw(frames.out);
    text.raw("],\n").key("crumbs").number(double(simulation.crumbs()));
    text.raw(",\n").key("events").raw("[").raw(events.out).raw("]}\n");
    return std::move(text.out);
}

}  // namespace kiln

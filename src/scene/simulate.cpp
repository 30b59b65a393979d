// SPDX-License-Identifier: MIT
// World: its bodies, run from their start. The world's list without the edits of bodies is one static field; a body's edits, brought to
// the frame of its first, are its own.

#include "scene/world_impl.h"

#include "field/sdf_field.h"
#include "physics/physics.h"
#include "scene/json_source.h"

#include "base/format.h"

#include <kiln/shapes.h>

#include <algorithm>
#include <cmath>
#include <thread>
#include <unordered_set>

namespace kiln {

namespace {

constexpr double kMostSteps = 1e7;
constexpr const char* kWorldName = "world";

physics::Pose frame_of(const Edit& first) { return {first.node.transform.position, first.node.transform.rotation}; }

// The exact convex shape of a body of one edit, where it has one.
std::optional<physics::Convex> convex_of(std::span<const Edit> edits) {
    if (edits.size() != 1) return std::nullopt;
    const Edit& e = edits[0];
    const vec3 scale = e.node.transform.scale;
    if (e.hidden || e.node.kind != Node::Kind::Shape || !e.node.domain.empty() || scale.x != scale.y ||
        scale.x != scale.z)
        return std::nullopt;
    // Parameters are a shape's fields in the order of their declaration.
    const auto& p = e.node.shape.params;
    const float s = scale.x;
    switch (ShapeKind(e.node.shape.kind)) {
    case ShapeKind::Sphere:
        return physics::Convex::sphere(s * p[0]);
    case ShapeKind::Box:
        return physics::Convex::box({s * p[0], s * p[1], s * p[2]});
    case ShapeKind::Capsule:
        return physics::Convex::capsule(s * p[0], s * p[1]);
    case ShapeKind::Cylinder:
        return physics::Convex::cylinder(s * p[0], s * p[1]);
    default:
        return std::nullopt;
    }
}

// The edits of a body in its frame, the first as a union.
std::vector<Edit> in_frame(std::vector<Edit> edits) {
    const physics::Pose local = inverse(frame_of(edits.front()));
    for (Edit& e : edits) {
        Transform& t = e.node.transform;
        const physics::Pose moved = local * physics::Pose{t.position, t.rotation};
        t.position = moved.position;
        t.rotation = moved.rotation;
    }
    edits.front().node.transform.position = {};
    edits.front().node.transform.rotation = {};
    edits.front().op = Op::Union;
    return edits;
}

class Text {
public:
    Text& raw(std::string_view s) {
        out += s;
        return *this;
    }
    Text& number(float v) { return raw(scene::shortest(v)); }
    Text& number(double v) { return number(float(v)); }
    Text& key(std::string_view k) { return raw("\"").raw(k).raw("\": "); }
    Text& vector(vec3 v) { return raw("[").number(v.x).raw(", ").number(v.y).raw(", ").number(v.z).raw("]"); }
    Text& rotation(quat q) {
        return raw("[").number(q.x).raw(", ").number(q.y).raw(", ").number(q.z).raw(", ").number(q.w).raw("]");
    }
    std::string out;
};

// The world's list without the edits of bodies.
std::vector<Edit> ground_of(const World::Impl& world, const std::unordered_set<std::string>& owned) {
    std::vector<Edit> out;
    world.edits.each([&](uint32_t slot) {
        const Edit& e = *world.edits[slot].edit;
        if (!owned.contains(e.name)) out.push_back(e);
    });
    return out;
}

Result<std::shared_ptr<const sdf::Program>> program_of(World::Impl& world, std::span<const Edit> edits) {
    const std::lock_guard lock(world.mutex);
    const auto source = scene::with_grids(edits, world.data.objects, world.data.folder, world.grids);
    if (!source) return source.error();
    auto program = sdf::compile(source->source());
    if (!program) return program.error();
    return std::make_shared<const sdf::Program>(std::move(*program));
}

Result<std::shared_ptr<const field::SdfField>> field_of(World::Impl& world, std::span<const Edit> edits) {
    auto program = program_of(world, edits);
    if (!program) return program.error();
    return std::shared_ptr<const field::SdfField>(std::make_shared<field::ProgramField>(std::move(*program)));
}

// Where two lists of edits may differ: the edits between what they begin and what they end with.
Result<Box3> changed_box(World::Impl& world, std::span<const Edit> before, std::span<const Edit> after) {
    size_t same = 0, last = 0;
    const size_t fewest = std::min(before.size(), after.size());
    while (same < fewest && before[same] == after[same]) ++same;
    while (last < fewest - same && before[before.size() - 1 - last] == after[after.size() - 1 - last]) ++last;
    Box3 box;
    for (const std::span<const Edit> list : {before, after}) {
        std::vector<Edit> alone(list.begin() + ptrdiff_t(same), list.end() - ptrdiff_t(last));
        float reach = 0;
        for (Edit& e : alone) {
            reach = std::max(reach, e.blend_radius);
            e.op = Op::Union;
        }
        const auto program = program_of(world, alone);
        if (!program) return program.error();
        for (const sdf::EditSpan& edit : (*program)->edits) box = box_union(box, edit.bounds.inflated(reach));
    }
    return box;
}

struct Ran {
    std::string quoted;  // its id
    physics::BodyId id;
};

}  // namespace

std::vector<PhysicsBackend> physics_backends() {
    std::vector<PhysicsBackend> out;
    for (const physics::Backend& b : physics::backends()) out.push_back({b.name, b.why_not});
    return out;
}

Result<std::string> World::simulate_json(const SimulateSettings& settings) const {
    const scene::SceneData& data = impl_->data;
    const double step = double(data.physics.step), steps = std::round(settings.seconds / step);
    if (!std::isfinite(settings.seconds) || settings.seconds < 0 || !(steps <= kMostSteps))
        return Error{formatted("simulating {} s: write a finite time of 0 or more, at most {} steps of {} s",
                               settings.seconds, kMostSteps, data.physics.step),
                     ErrorKind::Usage};
    if (!std::isfinite(settings.every) || settings.every < 0 || settings.threads < 0)
        return Error{"simulating: the time between frames and the number of threads must be 0 or more",
                     ErrorKind::Usage};
    const int threads = settings.threads > 0 ? settings.threads : std::max(1, int(std::thread::hardware_concurrency()));
    auto made = physics::make_world(settings.backend, {.gravity = data.physics.gravity, .threads = threads});
    if (!made) return made.error();
    physics::World& world = **made;

    const auto fault = [&](const scene::SceneBody& body, const std::string& message) -> Error {
        if (data.source.empty()) return {body.id + ": " + message, ErrorKind::Input};
        return data.source.error(body.place, message);
    };

    // The ground.
    std::unordered_set<std::string> owned;
    for (const scene::SceneBody& b : data.bodies) owned.insert(b.edits.begin(), b.edits.end());
    std::vector<Edit> ground = ground_of(*impl_, owned);
    std::optional<physics::BodyId> ground_body;
    std::vector<Ran> ran;
    std::vector<std::string> names;  // quoted, by index of the body
    const auto add = [&](const physics::BodySettings& body, std::string_view name) -> Result<void> {
        auto id = world.add(body);
        if (!id) return id.error();
        ran.push_back({scene::json_quoted(name), *id});
        if (id->index >= names.size()) names.resize(size_t(id->index) + 1);
        names[id->index] = ran.back().quoted;
        return {};
    };
    const auto add_ground = [&](std::shared_ptr<const field::SdfField> field) -> Result<void> {
        if (!field->bounds().empty()) {
            // The scene's own where no material says.
            std::vector<physics::Surface> surfaces{{data.physics.friction, data.physics.restitution}};
            for (size_t i = 0; i < data.materials.size(); ++i) {
                const scene::SceneData::Silent silent =
                    i < data.silent.size() ? data.silent[i] : scene::SceneData::Silent{};
                const Material& m = data.materials[i].second;
                surfaces.push_back({silent.friction ? data.physics.friction : m.friction,
                                    silent.restitution ? data.physics.restitution : m.restitution});
            }
            if (surfaces.size() == 1) surfaces.clear();
            auto added = add({.shape = physics::SdfShape::fixed(std::move(field)),
                              .motion = physics::Motion::Static,
                              .friction = data.physics.friction,
                              .restitution = data.physics.restitution,
                              .surfaces = std::move(surfaces)},
                             kWorldName);
            if (!added) return added.error();
            ground_body = ran.back().id;
            ran.pop_back();
        }
        return {};
    };
    {
        auto field = field_of(*impl_, ground);
        if (!field) return field.error();
        if (auto added = add_ground(std::move(*field)); !added) return added.error();
    }
    for (const scene::SceneBody& body : data.bodies) {
        if (body.edits.empty())
            return fault(body,
                         "bodies of meshes are not simulated yet; give it edits, such as one of the shape \"mesh\"");
        std::vector<Edit> edits;
        for (const std::string& name : body.edits) {
            const uint32_t slot = impl_->edits.find(name);
            if (slot == scene::EditList::kNone)
                return fault(body, formatted("its edit \"{}\" was removed; remove the body too", name));
            edits.push_back(*impl_->edits[slot].edit);
        }
        const physics::Pose frame = frame_of(edits.front());
        edits = in_frame(std::move(edits));
        physics::BodySettings s{.motion = physics::Motion(body.motion),
                                .pose = frame,
                                .density = body.numbers.density,
                                .friction = body.numbers.friction,
                                .restitution = body.numbers.restitution,
                                .linear_damping = body.numbers.linear_damping,
                                .angular_damping = body.numbers.angular_damping,
                                .continuous = body.continuous,
                                .linear_velocity = body.numbers.linear_velocity,
                                .angular_velocity = body.numbers.angular_velocity};
        const auto convex = settings.field_bodies ? std::nullopt : convex_of(edits);
        if (convex) {
            s.shape = *convex;
        } else {
            auto field = field_of(*impl_, edits);
            if (!field) return field.error();
            if (body.motion == scene::SceneBody::Motion::Static) {
                s.shape = physics::SdfShape::fixed(std::move(*field));
            } else {
                auto shape = physics::SdfShape::moving(std::move(*field));
                if (!shape) return fault(body, shape.error().message);
                s.shape = std::move(*shape);
            }
        }
        if (auto added = add(s, body.id); !added) return fault(body, added.error().message);
    }

    Text text;
    text.raw("{").key("backend").raw(scene::json_quoted(world.backend())).raw(",\n").key("bodies").raw("[");
    const char* comma = "";
    for (const Ran& r : ran) {
        text.raw(comma).raw("\n  {").key("id").raw(r.quoted).raw(", ").key("mass").number(world.mass(r.id)).raw(", ");
        text.key("center_of_mass").vector(world.center_of_mass(r.id)).raw("}");
        comma = ",";
    }
    text.raw("],\n").key("frames").raw("[");
    comma = "";
    const auto frame = [&](int64_t i) {
        text.raw(comma).raw("\n  {").key("time").number(double(i) * step).raw(", ").key("bodies").raw("[");
        const char* between = "";
        for (const Ran& r : ran) {
            const physics::BodyState state = world.state(r.id);
            text.raw(between)
                .raw("\n    {")
                .key("id")
                .raw(r.quoted)
                .raw(", ")
                .key("position")
                .vector(state.pose.position);
            text.raw(", ")
                .key("rotation")
                .rotation(state.pose.rotation)
                .raw(", ")
                .key("linear_velocity")
                .vector(state.linear_velocity);
            text.raw(", ").key("angular_velocity").vector(state.angular_velocity).raw(", ").key("asleep");
            text.raw(state.asleep ? "true}" : "false}");
            between = ",";
        }
        text.raw("]}");
        comma = ",";
    };
    Text events;
    const char* event_comma = "";
    const int64_t last = int64_t(steps);
    frame(0);
    // The world as the commands change it; made when the first comes.
    std::optional<World> edited;
    size_t commands = 0;
    const auto edit = [&](double now) -> Result<void> {
        bool any = false;
        for (; commands < settings.edits.size() && settings.edits[commands].time <= now + 1e-9; ++commands) {
            if (!edited) {
                auto copy = World::parse(to_json(), data.folder.empty() ? "scene" : data.folder + "/scene");
                if (!copy) return copy.error();
                edited = std::move(*copy);
            }
            const TimedCommand& command = settings.edits[commands];
            if (auto done = edited->apply(command); !done) return done;
            for (const std::string& name : owned) {
                const uint32_t had = impl_->edits.find(name), has = edited->impl_->edits.find(name);
                const bool same =
                    had == scene::EditList::kNone
                        ? has == had
                        : has != scene::EditList::kNone && *impl_->edits[had].edit == *edited->impl_->edits[has].edit;
                if (same) continue;
                return Error{
                    formatted("{}:{}: \"{}\" is a body's; commands change the world's own edits while bodies run",
                              command.file, command.line, name),
                    ErrorKind::Input};
            }
            any = true;
        }
        if (!any) return {};
        std::vector<Edit> now_there = ground_of(*edited->impl_, owned);
        const auto box = changed_box(*edited->impl_, ground, now_there);
        if (!box) return box.error();
        ground = std::move(now_there);
        auto field = field_of(*edited->impl_, ground);
        if (!field) return field.error();
        if (!ground_body) return add_ground(std::move(*field));
        world.set_field(*ground_body, physics::SdfShape::fixed(std::move(*field)), *box);
        return {};
    };
    // Frames fall on the steps nearest to multiples of `every`.
    int64_t frames = 1;
    for (int64_t i = 1; i <= last; ++i) {
        if (auto done = edit(double(i - 1) * step); !done) return done.error();
        world.step(data.physics.step);
        for (const physics::ContactEvent& e : world.events()) {
            events.raw(event_comma).raw("\n  {").key("time").number(double(i) * step).raw(", ").key("type");
            events.raw(e.began ? "\"begin\"" : "\"end\"").raw(", ").key("a").raw(names[e.a.index]).raw(", ").key("b");
            events.raw(names[e.b.index]).raw("}");
            event_comma = ",";
        }
        const bool due = settings.every <= step || i >= int64_t(std::llround(double(frames) * settings.every / step));
        if (!due && i != last) continue;
        frame(i);
        ++frames;
    }
    text.raw("],\n").key("events").raw("[").raw(events.out).raw("]}\n");
    return std::move(text.out);
}

}  // namespace kiln

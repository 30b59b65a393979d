// SPDX-License-Identifier: MIT

#include "scene/simulation.h"

#include "scene/body_shapes.h"

#include "base/format.h"

#include <algorithm>
#include <cmath>
#include <thread>

namespace kiln::scene {

namespace {

constexpr const char* kWorldName = "world";
constexpr float kPartDensity = 1000;  // kg/m³, a body's default

// The scene's own where no material says.
std::vector<physics::Surface> surfaces_of(const SceneData& data) {
    std::vector<physics::Surface> out{{data.physics.friction, data.physics.restitution}};
    for (size_t i = 0; i < data.materials.size(); ++i) {
        const SceneData::Silent silent = i < data.silent.size() ? data.silent[i] : SceneData::Silent{};
        const Material& m = data.materials[i].second;
        out.push_back({silent.friction ? data.physics.friction : m.friction,
                       silent.restitution ? data.physics.restitution : m.restitution});
    }
    if (out.size() == 1) out.clear();
    return out;
}

}  // namespace

Result<std::unique_ptr<Simulation>> Simulation::make(const World& start, const SimulateSettings& settings) {
    std::unique_ptr<Simulation> out(new Simulation(start));
    const SceneData& data = start.impl_->data;
    const int threads = settings.threads > 0 ? settings.threads : std::max(1, int(std::thread::hardware_concurrency()));
    auto world = physics::make_world(settings.backend, {.gravity = data.physics.gravity, .threads = threads});
    if (!world) return world.error();
    out->world_ = std::move(*world);
    out->seconds_ = data.physics.step;
    out->commands_ = settings.edits;
    for (const SceneBody& b : data.bodies) out->owned_.insert(b.edits.begin(), b.edits.end());
    out->edits_ = ground_of(*start.impl_, out->owned_);
    auto list = field_of(*start.impl_, out->edits_);
    if (!list) return list.error();
    out->voxel_size_ = start.impl_->resolution(*start.impl_->compiled(), start.field_settings).voxel_size;
    out->near_ = 8 * out->voxel_size_;
    if (auto done = out->set_ground(std::move(*list), {}); !done) return done.error();
    if (auto done = out->add_bodies(settings); !done) return done.error();
    if (auto done = out->add_triggers(); !done) return done.error();
    return out;
}

Error Simulation::fault(JsonIndex place, const std::string& id, const std::string& message) const {
    const SceneData& data = start_.impl_->data;
    if (data.source.empty()) return {id + ": " + message, ErrorKind::Input};
    return data.source.error(place, message);
}

std::string Simulation::name_of(physics::BodyId id) const {
    return id.index < names_.size() ? names_[id.index] : std::string();
}

Result<void> Simulation::add(const physics::BodySettings& body, std::string_view name) {
    auto id = world_->add(body);
    if (!id) return id.error();
    members_.push_back({std::string(name), *id});
    if (id->index >= names_.size()) names_.resize(size_t(id->index) + 1);
    names_[id->index] = name;
    return {};
}

std::shared_ptr<const physics::SdfShape> Simulation::ground_shape(const Box3& changed) {
    bricks_ = bricks_ != nullptr ? bricks_->after(ground_, changed)
                                 : std::make_shared<const field::BrickField>(
                                       ground_, field::BrickFieldOptions{.voxel_size = voxel_size_, .near = near_});
    return physics::SdfShape::fixed(ground_, bricks_);
}

Result<void> Simulation::set_ground(std::shared_ptr<const field::ProgramField> list, const Box3& changed) {
    ground_ = cuts_.empty() ? std::shared_ptr<const field::SdfField>(std::move(list))
                            : std::make_shared<const field::LayeredField>(std::move(list), cuts_);
    if (ground_body_) {
        world_->set_field(*ground_body_, ground_shape(changed), changed);
        return {};
    }
    if (ground_->bounds().empty()) return {};
    const SceneData& data = start_.impl_->data;
    auto added = add({.shape = ground_shape(changed),
                      .motion = physics::Motion::Static,
                      .friction = data.physics.friction,
                      .restitution = data.physics.restitution,
                      .surfaces = surfaces_of(data)},
                     kWorldName);
    if (!added) return added;
    ground_body_ = members_.back().body;
    members_.pop_back();
    return {};
}

Result<void> Simulation::add_bodies(const SimulateSettings& settings) {
    World::Impl& impl = *start_.impl_;
    for (const SceneBody& body : impl.data.bodies) {
        const auto wrong = [&](const std::string& message) { return fault(body.place, body.id, message); };
        if (body.edits.empty())
            return wrong("bodies of meshes are not simulated yet; give it edits, such as one of the shape \"mesh\"");
        std::vector<Edit> edits;
        for (const std::string& name : body.edits) {
            const uint32_t slot = impl.edits.find(name);
            if (slot == EditList::kNone)
                return wrong(formatted("its edit \"{}\" was removed; remove the body too", name));
            edits.push_back(*impl.edits[slot].edit);
        }
        const physics::Pose frame = frame_of(edits.front());
        edits = in_frame_of_first(std::move(edits));
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
        if (const auto convex = settings.field_bodies ? std::nullopt : convex_of(edits)) {
            s.shape = *convex;
        } else {
            auto field = field_of(impl, edits);
            if (!field) return field.error();
            const Box3 box = (*field)->bounds();
            if (body.motion == SceneBody::Motion::Static) {
                s.shape = physics::SdfShape::fixed(*field);
            } else {
                auto bricks = box.finite() && !box.empty() ? field::BrickField::of_body(*field, voxel_size_) : nullptr;
                auto shape = physics::SdfShape::moving(std::move(*field), std::move(bricks));
                if (!shape) return wrong(shape.error().message);
                s.shape = std::move(*shape);
            }
        }
        if (auto added = add(s, body.id); !added) return wrong(added.error().message);
    }
    return {};
}

Result<void> Simulation::add_triggers() {
    for (const SceneTrigger& trigger : start_.impl_->data.triggers) {
        Edit placed;
        placed.node.kind = Node::Kind::Object;
        placed.node.object = trigger.object;
        placed.node.transform.scale = trigger.transform.scale;
        auto field = field_of(*start_.impl_, std::span(&placed, 1));
        if (!field) return fault(trigger.place, trigger.id, field.error().message);
        const physics::Pose pose{trigger.transform.position, trigger.transform.rotation};
        // With points of its own where it has an end, so that it is found within larger bodies too.
        auto shape = physics::SdfShape::moving(*field);
        (void)triggers_.add(shape ? std::move(*shape) : physics::SdfShape::fixed(std::move(*field)), pose);
        trigger_names_.push_back(trigger.id);
    }
    return {};
}

Result<void> Simulation::apply_commands() {
    const double now = time();
    bool any = false;
    for (; done_ < commands_.size() && commands_[done_].time <= now + 1e-9; ++done_) {
        const World::Impl& before = *start_.impl_;
        if (!edited_) {
            const std::string& folder = before.data.folder;
            auto copy = World::parse(start_.to_json(), folder.empty() ? "scene" : folder + "/scene");
            if (!copy) return copy.error();
            edited_ = std::move(*copy);
        }
        const TimedCommand& command = commands_[done_];
        if (auto applied = edited_->apply(command); !applied) return applied;
        const World::Impl& after = *edited_->impl_;
        for (const std::string& name : owned_) {
            const uint32_t had = before.edits.find(name), has = after.edits.find(name);
            const bool same = had == EditList::kNone
                                  ? has == had
                                  : has != EditList::kNone && *before.edits[had].edit == *after.edits[has].edit;
            if (same) continue;
            return Error{formatted("{}:{}: \"{}\" is a body's; commands change the world's own edits while bodies run",
                                   command.file, command.line, name),
                         ErrorKind::Input};
        }
        any = true;
    }
    if (!any) return {};
    std::vector<Edit> there = ground_of(*edited_->impl_, owned_);
    const auto box = changed_box(*edited_->impl_, edits_, there);
    if (!box) return box.error();
    edits_ = std::move(there);
    auto list = field_of(*edited_->impl_, edits_);
    if (!list) return list.error();
    const std::shared_ptr<const field::SdfField> before = ground_;
    if (auto done = set_ground(*list, *box); !done) return done;
    // What the commands cut loose.
    const auto parts = field::loose_parts(*before, *ground_, *box, {.voxel_size = voxel_size_});
    for (const field::LoosePart& part : parts) {
        // Frozen: the ground as it is now, within the part's region.
        const vec3 origin = part.box.center();
        auto frozen = std::make_shared<const field::PartField>(ground_, part.region, origin, part.box);
        auto shape = physics::SdfShape::moving(frozen, field::BrickField::of_body(frozen, voxel_size_));
        if (!shape) continue;  // a crumb too thin to have a volume: it stays
        const SceneData& data = start_.impl_->data;
        const auto added = add({.shape = std::move(*shape),
                                .pose = {origin, {}},
                                .density = kPartDensity,
                                .friction = data.physics.friction,
                                .restitution = data.physics.restitution,
                                .surfaces = surfaces_of(data)},
                               formatted("part{}", ++parts_));
        if (!added) return added;
        cuts_.push_back({part.region, false, {}, {}, part.region->bounds()});
        if (auto done = set_ground(*list, part.region->bounds()); !done) return done;
    }
    return {};
}

Result<void> Simulation::step() {
    if (auto done = apply_commands(); !done) return done;
    world_->step(seconds_);
    ++steps_;
    triggers_.update(*world_);
    events_.clear();
    for (const physics::ContactEvent& e : world_->events())
        events_.push_back({e.began ? "begin" : "end", name_of(e.a), name_of(e.b)});
    for (const physics::TriggerEvent& e : triggers_.events())
        events_.push_back({e.entered ? "enter" : "leave", trigger_names_[e.trigger.index], name_of(e.body)});
    return {};
}

}  // namespace kiln::scene

// SPDX-License-Identifier: MIT

#include "scene/simulation.h"

#include "scene/body_shapes.h"
#include "scene/command.h"

#include "model/topology.h"
#include "physics/mesh_mass.h"

#include "base/format.h"

#include <kiln/shapes.h>

#include <algorithm>
#include <cmath>
#include <thread>
#include <utility>

namespace kiln::scene {

namespace {

constexpr const char* kWorldName = "world";
constexpr int kMeshResolution = 64;  // cells along the longest side of a body's mesh
constexpr const char* kBodysOwn = "is a body's; commands change the world's own edits while bodies run";

// The command of a line of timed ones, as it is written there; or the command itself.
std::string command_in(const std::string& line) {
    const auto doc = JsonDocument::parse(line, "command");
    const auto at = doc && doc->is(0, JsonType::Object) ? doc->find(0, "command") : std::nullopt;
    if (!at) return line;
    JsonDocument out;
    out.add_copy(*doc, *at);
    return out.line();
}

}  // namespace

Result<std::unique_ptr<Simulation>> Simulation::make(const World& start, const SimulateSettings& settings,
                                                     Simulation* old) {
    std::unique_ptr<Simulation> out(new Simulation(start, settings));
    const SceneData& data = start.impl_->data;
    const int threads = settings.threads > 0 ? settings.threads : std::max(1, int(std::thread::hardware_concurrency()));
    auto world = physics::make_world(settings.backend, {.gravity = data.physics.gravity, .threads = threads});
    if (!world) return world.error();
    out->world_ = std::move(*world);
    out->seconds_ = data.physics.step;
    out->commands_ = settings.edits;
    for (const SceneBody& b : data.bodies) out->owned_.insert(b.edits.begin(), b.edits.end());
    out->edits_ = ground_of(*start.impl_, out->owned_);
    out->voxel_size_ = old != nullptr
                           ? old->voxel_size_
                           : start.impl_->resolution(*start.impl_->compiled(), start.field_settings).voxel_size;
    out->near_ = 8 * out->voxel_size_;
    out->mesh_voxel_ = settings.mesh_ground ? out->voxel_size_ : 0;
    if (old != nullptr) out->beginning_ = old->beginning_;
    if (auto done = out->set_ground({}); !done) return done.error();
    if (auto done = out->add_bodies(old); !done) return done.error();
    if (auto done = out->add_triggers(); !done) return done.error();
    if (auto done = out->add_characters(); !done) return done.error();
    if (old != nullptr && old->live_)
        if (auto done = out->take_live(*old); !done) return done.error();
    return out;
}

Error Simulation::fault(JsonIndex place, const std::string& id, const std::string& message) const {
    const SceneData& data = start_.impl_->data;
    if (data.source.empty() || place == SceneData::kNowhere) return {id + ": " + message, ErrorKind::Input};
    return data.source.error(place, message);
}

std::string Simulation::name_of(physics::BodyId id) const {
    const auto found = names_.find(id);
    return found != names_.end() ? found->second : std::string();
}

Result<void> Simulation::add(const physics::BodySettings& body, std::string_view name) {
    auto id = world_->add(body);
    if (!id) return id.error();
    physics::MassProperties mass;
    mass.mass = world_->mass(*id);
    mass.center = world_->center_of_mass(*id);
    members_.push_back({.id = std::string(name), .body = *id, .mass = mass, .before = body.pose, .began = body.pose});
    names_.emplace(*id, name);
    return {};
}

std::shared_ptr<const physics::SdfShape> Simulation::ground_shape(const Box3& changed) {
    bricks_ = bricks_ != nullptr ? bricks_->after(ground_, changed)
                                 : std::make_shared<const field::BrickField>(
                                       ground_, field::BrickFieldOptions{.voxel_size = voxel_size_, .near = near_});
    return physics::SdfShape::fixed(ground_, bricks_);
}

Result<void> Simulation::set_ground(const Box3& changed) {
    if (!ground_body_ && beginning_.ground) {
        ground_ = beginning_.ground;
        bricks_ = beginning_.bricks;
    } else {
        auto list = field_of(live_ ? *live_->impl_ : *start_.impl_, edits_);
        if (!list) return list.error();
        ground_ = std::move(*list);
    }
    if (ground_body_) {
        world_->set_field(*ground_body_, ground_shape(changed), changed);
        return {};
    }
    if (ground_->bounds().empty()) return {};
    const SceneData& data = start_.impl_->data;
    const bool anew = bricks_ != nullptr;
    auto shape = anew ? physics::SdfShape::fixed(ground_, bricks_) : ground_shape(changed);
    beginning_.ground = ground_;
    beginning_.bricks = bricks_;
    auto added = add({.shape = std::move(shape),
                      .motion = physics::Motion::Static,
                      .friction = data.physics.friction,
                      .restitution = data.physics.restitution,
                      .surfaces = surfaces_of(data),
                      .mesh_voxel = mesh_voxel_,
                      .rolling_friction = data.physics.rolling_friction},
                     kWorldName);
    if (!added) return added;
    ground_body_ = members_.back().body;
    members_.pop_back();
    return {};
}

Result<void> Simulation::add_bodies(const Simulation* old) {
    World::Impl& impl = *start_.impl_;
    for (size_t i = 0; i < impl.data.bodies.size(); ++i) {
        const SceneBody& body = impl.data.bodies[i];
        const auto wrong = [&](const std::string& message) { return fault(body.place, body.id, message); };
        std::vector<Edit> edits;
        if (!body.mesh.empty()) {
            auto edit = edit_of_mesh(body);
            if (!edit) return wrong(edit.error().message);
            edits.push_back(std::move(*edit));
        }
        for (const std::string& name : body.edits) {
            const uint32_t slot = impl.edits.find(name);
            if (slot == EditList::kNone)
                return wrong(formatted("its edit \"{}\" was removed; remove the body too", name));
            edits.push_back(*impl.edits[slot].edit);
        }
        const physics::Pose frame = frame_of(edits.front());
        edits = in_frame_of_first(std::move(edits));
        if (old == nullptr) {
            auto made = settings_of(body, edits);
            if (!made) return wrong(made.error().message);
            made->pose = frame;
            beginning_.bodies.push_back(std::move(*made));
        }
        if (auto added = add(beginning_.bodies[i], body.id); !added) return wrong(added.error().message);
        members_.back().edits = std::move(edits);
        if (!body.edits.empty()) members_.back().edit = body.edits.front();
        if (!body.settles) continue;
        auto own = field_of(impl, members_.back().edits);
        if (!own) return wrong(own.error().message);
        loose_.push_back(
            {members_.size() - 1, *impl.edits[impl.edits.find(body.edits.front())].edit, (*own)->bounds()});
    }
    return {};
}

// But for its pose.
Result<physics::BodySettings> Simulation::settings_of(const SceneBody& body, const std::vector<Edit>& edits) {
    World::Impl& impl = *start_.impl_;
    physics::BodySettings s{.motion = physics::Motion(body.motion),
                            .density = body.numbers.density,
                            .friction = body.numbers.friction,
                            .restitution = body.numbers.restitution,
                            .linear_damping = body.numbers.linear_damping,
                            .angular_damping = body.numbers.angular_damping,
                            .continuous = body.continuous,
                            .linear_velocity = body.numbers.linear_velocity,
                            .angular_velocity = body.numbers.angular_velocity,
                            .rolling_friction = body.numbers.rolling_friction};
    if (body.of_materials) s.surfaces = surfaces_of(impl.data);
    if (const auto convex = settings_.field_bodies ? std::nullopt : convex_of(edits)) {
        s.shape = *convex;
        return s;
    }
    auto field = field_of(impl, edits);
    if (!field) return field.error();
    if (!body.mesh.empty())
        if (auto closed = check_closed(body, edits.front()); !closed) return closed.error();
    if (body.motion == SceneBody::Motion::Static) {
        s.shape = physics::SdfShape::fixed(*field);
        return s;
    }
    const Box3 box = (*field)->bounds();
    auto bricks = box.finite() && !box.empty() ? field::BrickField::of_body(*field, voxel_size_) : nullptr;
    auto shape = physics::SdfShape::moving(std::move(*field), std::move(bricks));
    if (!shape) return shape.error();
    // What a mesh bounds once has the mass that its triangles say, more exactly than a grid does.
    const auto mass = body.mesh.empty() ? std::nullopt : exact_mass(edits.front());
    s.shape = mass ? (*shape)->with(*mass) : std::move(*shape);
    return s;
}

// A mesh collides as the solid that it bounds: an edit of its file, where the mesh is.
Result<Edit> Simulation::edit_of_mesh(const SceneBody& body) const {
    const SceneData& data = start_.impl_->data;
    const auto mesh =
        std::find_if(data.meshes.begin(), data.meshes.end(), [&](const SceneMesh& m) { return m.id == body.mesh; });
    if (mesh == data.meshes.end()) return Error{formatted("there is no mesh \"{}\"", body.mesh), ErrorKind::Input};
    Edit out;
    out.name = body.mesh;
    out.node.shape = SampledMesh{.resolution = float(kMeshResolution)};
    out.node.shape.data = mesh->file;
    out.node.transform = mesh->transform;
    return out;
}

// What moves has a mass, which an open mesh does not say.
Result<void> Simulation::check_closed(const SceneBody& body, const Edit& edit) const {
    const Grids& grids = start_.impl_->grids;
    const auto grid = grids.by_mesh.find({edit.node.shape.data, kMeshResolution});
    if (body.motion == SceneBody::Motion::Static || grid == grids.by_mesh.end()) return {};
    const model::BakeReport& report = grids.mesh_notes[grid->second].report;
    if (report.topology.closed_manifold()) return {};
    return Error{formatted("its mesh \"{}\" is not closed ({}); close it, or make the motion \"static\"",
                           edit.node.shape.data, report.sentence()),
                 ErrorKind::Input};
}

std::optional<physics::MassProperties> Simulation::exact_mass(const Edit& mesh) const {
    const Grids& grids = start_.impl_->grids;
    const std::string& file = mesh.node.shape.data;
    const auto grid = grids.by_mesh.find({file, kMeshResolution});
    // The sum over triangles would count twice what lies in two parts of the mesh.
    if (grid == grids.by_mesh.end() || grids.mesh_notes[grid->second].report.overlapping) return std::nullopt;
    const auto read = model::read(file.starts_with('/') ? file : start_.impl_->data.folder + file);
    if (!read) return std::nullopt;
    model::Topology found;
    const model::Triangles whole = model::heal(*read, found);
    physics::Triangles triangles;
    for (const vec3 p : whole.positions) {
        const vec3 s = mesh.node.transform.scale;
        triangles.vertices.push_back({p.x * s.x, p.y * s.y, p.z * s.z});
    }
    for (const model::Face& f : whole.faces) triangles.indices.insert(triangles.indices.end(), f.begin(), f.end());
    const auto mass = physics::mass_of_mesh(triangles);
    return mass ? std::optional(*mass) : std::nullopt;
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

Result<World*> Simulation::live() {
    if (!live_) {
        live_ = World::Impl::copy_of(start_);
        // What moves does not change what the field covers, nor how finely.
        if (live_->field_settings.levels == 1) {
            World::Impl& impl = *live_->impl_;
            const bool same = impl.built_with == live_->field_settings;
            const auto r = impl.resolution(impl.list, live_->field_settings);
            live_->field_settings.voxel_size = r.voxel_size;
            live_->field_settings.bounds = r.bounds;
            if (same) impl.built_with = live_->field_settings;  // it says the same
        }
        if (auto done = show_characters(); !done) return done.error();
        (void)live_->history();  // from here on
        beginning_.live_names = live_->impl_->names_given;
    }
    return &*live_;
}

Result<void> Simulation::take_live(Simulation& old) {
    live_ = std::move(old.live_);
    old.live_.reset();
    World::Impl& impl = *live_->impl_;
    if (auto gone = live_->history().go_to(0); !gone) return gone;
    impl.names_given = beginning_.live_names;
    // Bodies that came about are behind those of the scene and its characters; of those that settled it is known again what they are.
    impl.data.bodies.resize(start_.impl_->data.bodies.size() + walkers_.size());
    std::copy(start_.impl_->data.bodies.begin(), start_.impl_->data.bodies.end(), impl.data.bodies.begin());
    impl.apart_anew();
    for (size_t i = 0; i < walkers_.size(); ++i) {
        walkers_[i].shown = old.walkers_[i].shown;
        owned_.insert(walkers_[i].shown);
    }
    meshes_shown_ = std::move(old.meshes_shown_);
    return {};
}

// Ground that has come about beyond what the field covers is drawn too.
void Simulation::fit_field() {
    FieldSettings& settings = live_->field_settings;
    if (settings.levels != 1 || start_.field_settings.bounds || !settings.bounds) return;
    const Box3 solid = live_->impl_->compiled()->bounds;
    if (solid.empty() || !solid.finite() || box_union(solid, *settings.bounds) == *settings.bounds) return;
    // With room for more, since all of it is made again.
    settings.bounds = box_union(*settings.bounds, live_->impl_->resolution(*live_->impl_->compiled(), {}).bounds);
}

std::optional<std::string> Simulation::changed_body() const {
    const EditList &before = start_.impl_->edits, &after = live_->impl_->edits;
    const std::vector<SceneBody>& bodies = start_.impl_->data.bodies;
    for (size_t i = 0; i < bodies.size(); ++i) {
        if (members_[i].rest) continue;  // it is ground
        for (const std::string& name : bodies[i].edits) {
            const uint32_t had = before.find(name), has = after.find(name);
            const auto own = own_.find(name);
            const Edit* expected = own != own_.end()        ? &own->second
                                   : had != EditList::kNone ? before[had].edit.get()
                                                            : nullptr;
            const bool same =
                expected == nullptr ? has == EditList::kNone : has != EditList::kNone && *expected == *after[has].edit;
            if (!same) return name;
        }
    }
    for (const Part& part : loose_) {
        const uint32_t has = after.find(std::string_view(part.placed.name));
        if (has == EditList::kNone || !(*after[has].edit == part.placed)) return part.placed.name;
    }
    return std::nullopt;
}

// Refused, it changes nothing.
Result<void> Simulation::obey(const std::string& text, const std::string& name,
                              const std::function<Result<void>(World&, const std::string&)>& apply) {
    if (auto there = live(); !there) return there.error();
    const auto aimed = aim(text, name);
    if (!aimed) return aimed.error();
    std::vector<Recut> cuts;
    const bool of_world = aimed->target.empty() || aimed->target == "world" || aimed->target == "all";
    const std::string bare = command_in(aimed->text);
    if (!aimed->target.empty() && aimed->target != "world") {
        auto command = read_command(bare, name, live_->impl_->names());
        if (!command) return command.error();
        auto found = recut(*command->edit, aimed->target, name);
        if (!found) return found.error();
        cuts = std::move(*found);
    }
    if (of_world) {
        History history = live_->history();
        if (auto applied = apply(*live_, aimed->text); !applied) return applied;
        if (const auto body = changed_body()) {
            if (const auto undone = history.undo(); !undone) return undone.error();
            return Error{formatted("{}: \"{}\" {}", name, *body, kBodysOwn), ErrorKind::Input};
        }
        changed_ = true;
        made_.push_back(bare);
    }
    for (Recut& cut : cuts)
        if (auto done = reshape(std::move(cut)); !done) return done;
    return {};
}

Result<void> Simulation::command_now(const std::string& command, const std::string& name) {
    return obey(command, name, [&](World& world, const std::string& text) { return world.apply(text, name); });
}

Result<void> Simulation::apply_commands() {
    const double now = time();
    for (; done_ < commands_.size() && commands_[done_].time <= now + 1e-9; ++done_) {
        const TimedCommand& command = commands_[done_];
        auto done = obey(command.text, formatted("{}:{}", command.file, command.line),
                         [&](World& world, const std::string& text) {
                             TimedCommand bare = command;
                             bare.text = text;
                             return world.apply(bare);
                         });
        if (!done) return done;
    }
    return std::exchange(changed_, false) ? change_ground() : Result<void>();
}

Result<void> Simulation::step() {
    if (auto done = apply_commands(); !done) return done;
    if (auto done = settle_parts(); !done) return done;
    for (Member& m : members_)
        if (!m.gone) m.before = state(m).pose;
    drop_crumbs();
    walk();
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

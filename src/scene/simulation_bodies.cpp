// SPDX-License-Identifier: MIT
// Simulation: edits that act on bodies. A command {"add": EDIT, "target": "bodies"} acts on every body that shares a point with the edit's
// solid, "all" on those and on the world, a body's id on that body alone. The edit is brought into the body's frame and put at the end of
// its edits; shape, mass and moments are new before the next step, and each of its points keeps its velocity. What falls apart becomes
// bodies of its own, what is cut away whole is gone.
//
// The live world, and so pictures and what keeps them, tell it with commands that there are: an object of all the body's edits, which the
// body's first edit places; the others are hidden.

#include "scene/body_shapes.h"
#include "scene/command.h"
#include "scene/json_source.h"
#include "scene/part_tree.h"
#include "scene/simulation.h"

#include "base/format.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace kiln::scene {

namespace {

constexpr std::string_view kTarget = "target";

Edit placed(Edit edit, const physics::Pose& frame) {
    const physics::Pose pose = frame * frame_of(edit);
    edit.node.transform.position = pose.position;
    edit.node.transform.rotation = pose.rotation;
    return edit;
}

std::vector<const Edit*> pointers(const std::vector<Edit>& edits) {
    std::vector<const Edit*> out;
    for (const Edit& e : edits) out.push_back(&e);
    return out;
}

}  // namespace

Result<Simulation::Aimed> Simulation::aim(const std::string& text, const std::string& name) {
    Aimed out{text, {}};
    const auto doc = JsonDocument::parse(text, name);
    if (!doc || !doc->is(0, JsonType::Object)) return out;  // whoever reads it says what is wrong
    const auto inner = doc->find(0, "command");             // of a line of timed ones
    const JsonIndex command = inner ? *inner : 0;
    for (const std::string_view section : {"meshes", "bodies", "characters"})
        if (doc->is(command, JsonType::Object))
            if (const auto of_start = doc->find(command, section))
                return doc->error(*of_start,
                                  "bodies run as the scene has them at the start; change this before they do");
    const auto at = doc->is(command, JsonType::Object) ? doc->find(command, kTarget) : std::nullopt;
    if (!at) return out;
    if (!doc->find(command, "add")) return doc->error(*at, "only edits that are added have a target");
    if (!doc->is(*at, JsonType::String) || doc->text(*at).empty())
        return doc->error(*at, "a target is \"world\", \"bodies\", \"all\" or the id of a body");
    out.target = std::string(doc->text(*at));
    // The same without it.
    JsonDocument bare;
    const auto members = [&](JsonIndex object) {
        for (JsonIndex c = doc->first(object); c < doc->next(object); c = doc->next(c))
            if (object != command || doc->key(c) != kTarget) {
                if (inner && c == command) continue;
                bare.add_copy(*doc, c, doc->key(c));
            }
    };
    bare.open(JsonType::Object);
    if (inner) {
        members(0);
        bare.open(JsonType::Object, "command");
    }
    members(command);
    if (inner) bare.close();
    bare.close();
    out.text = bare.line();
    return out;
}

Result<std::vector<Simulation::Recut>> Simulation::recut(const Edit& edit, const std::string& target,
                                                         const std::string& name) {
    std::vector<Recut> out;
    std::vector<physics::BodyId> meant;
    const bool every = target == "bodies" || target == "all";
    if (every) {
        Edit alone = edit;
        alone.op = Op::Union;
        alone.blend_radius = 0;
        auto field = field_of(*live_->impl_, std::span(&alone, 1));
        if (!field) return field.error();
        auto solid = physics::SdfShape::moving(*field);
        if (!solid) return Error{formatted("{}: {}", name, solid.error().message), ErrorKind::Input};
        meant = world_->overlap(**solid, {});
    }
    bool found = every;
    for (size_t i = 0; i < members_.size(); ++i) {
        const Member& m = members_[i];
        if (m.rest || m.gone) continue;
        if (every ? std::find(meant.begin(), meant.end(), m.body) == meant.end() : m.id != target) continue;
        found = true;
        auto one = recut(i, edit);
        if (!one) return Error{formatted("{}: body \"{}\": {}", name, m.id, one.error().message), one.error().kind};
        out.push_back(std::move(*one));
    }
    if (!found)
        return Error{formatted("{}: there is no body \"{}\" to aim at; write \"world\", \"bodies\", \"all\" or the id "
                               "of one that there is",
                               name, target),
                     ErrorKind::Input};
    return out;
}

Result<Simulation::Recut> Simulation::recut(size_t member, const Edit& edit) {
    const Member& m = members_[member];
    Recut out{.member = member, .edits = m.edits};
    out.edits.push_back(placed(edit, inverse(world_->state(m.body).pose)));
    out.edits.back().name.clear();
    out.edits.back().group.clear();
    auto before = field_of(*live_->impl_, m.edits);
    if (!before) return before.error();
    auto after = field_of(*live_->impl_, out.edits);
    if (!after) return after.error();
    auto changed = changed_box(*live_->impl_, m.edits, out.edits);
    if (!changed) return changed.error();
    out.changed = box_intersection(*changed, box_union((*before)->bounds(), (*after)->bounds()));
    out.before = std::move(*before);
    out.after = std::move(*after);
    if (!out.after->bounds().finite() && !out.after->bounds().empty())
        return Error{"the edit has no end, so the body would have none; aim it at the world", ErrorKind::Input};
    return out;
}

// What hung together and does not now leaves as parts; then the body is what is left.
Result<void> Simulation::reshape(Recut cut) {
    const physics::BodyState state = world_->state(members_[cut.member].body);
    const physics::Pose pose = state.pose;
    const vec3 middle = pose * world_->center_of_mass(members_[cut.member].body);
    const std::string own = members_[cut.member].id;
    std::vector<field::LoosePart> parts =
        field::loose_parts(*cut.before, *cut.after, cut.changed,
                           {.voxel_size = voxel_size_, .least_points = 1, .workers = settings_.threads});
    bool split = false;
    for (const field::LoosePart& part : parts) {
        const std::vector<const Edit*> edits = pointers(cut.edits);
        const bool crumb = part.points < kCrumbPoints;
        if (crumb) {
            scatter(part, pose, cut.after->material(part.box.center()));
        } else {
            const Source from{.edits = edits,
                              .frame = pose,
                              .velocity = state.linear_velocity,
                              .spin = state.angular_velocity,
                              .about = middle,
                              .body = members_[cut.member].body};
            const auto loose = cut_loose(part, from);
            if (!loose) return loose.error();
            if (!*loose) continue;
        }
        Edit away;
        away.node = region_node(part.region);
        away.op = Op::Subtract;
        cut.edits.push_back(std::move(away));
        split = true;
    }
    if (split) {
        auto left = field_of(*live_->impl_, cut.edits);
        if (!left) return left.error();
        cut.after = std::move(*left);
    }
    Member& m = members_[cut.member];
    m.edits = std::move(cut.edits);
    auto shape = cut.after->bounds().empty()
                     ? Result<std::shared_ptr<const physics::SdfShape>>(Error{"nothing", ErrorKind::Input})
                     : physics::SdfShape::moving(cut.after, field::BrickField::of_body(cut.after, voxel_size_));
    if (!shape) {
        // Nothing that has a volume is left.
        m.gone = true;
        world_->remove(m.body);
        std::erase_if(loose_, [&](const Part& part) { return part.member == cut.member; });
        return hide(m);
    }
    world_->set_shape(m.body, std::move(*shape));
    m.mass.mass = world_->mass(m.body);
    m.mass.center = world_->center_of_mass(m.body);
    for (Part& part : loose_)
        if (part.member == cut.member) part.own = cut.after->bounds();
    return show(m);
}

// Edits of the live world by which a member is seen.
std::vector<std::string> Simulation::edits_of(const Member& m) const {
    for (const SceneBody& b : live_->impl_->data.bodies)
        if (b.id == m.id) return b.edits;
    return {};
}

bool Simulation::is_body(std::string_view id) const {
    return std::any_of(members_.begin(), members_.end(), [&](const Member& m) { return m.id == id; }) ||
           std::any_of(walkers_.begin(), walkers_.end(), [&](const Walker& w) { return w.id == id; });
}

Result<void> Simulation::change_own(const std::string& name, const Edit& edit) {
    if (auto done = change({.kind = CommandKind::Change, .id = name, .edit = &edit}); !done) return done;
    const Edit& now = *live_->find(*live_->find_edit(name));
    own_[name] = now;
    for (Part& part : loose_)
        if (part.placed.name == name) part.placed = now;
    return {};
}

Result<void> Simulation::hide(const Member& m) {
    for (const std::string& name : edits_of(m)) {
        Edit edit = *live_->find(*live_->find_edit(name));
        edit.hidden = true;
        if (auto done = change_own(name, edit); !done) return done;
    }
    return hide_mesh(m);
}

Result<void> Simulation::hide_mesh(const Member& m) {
    const SceneData& data = live_->impl_->data;
    const auto body =
        std::find_if(data.bodies.begin(), data.bodies.end(), [&](const SceneBody& b) { return b.id == m.id; });
    if (body == data.bodies.end() || body->mesh.empty()) return {};
    SceneData now;
    now.meshes = data.meshes;
    for (SceneMesh& mesh : now.meshes) mesh.hidden = mesh.hidden || mesh.id == body->mesh;
    std::string text = write_command(now, {}, {.kind = CommandKind::Meshes});
    if (text == write_command(data, {}, {.kind = CommandKind::Meshes})) return {};
    if (auto applied = live_->apply(text, "a mesh that was cut"); !applied) return applied;
    made_.push_back(std::move(text));
    return {};
}

Result<void> Simulation::show(Member& m) {
    const std::vector<std::string> names = edits_of(m);
    std::string object_name;
    do object_name = formatted("{}.{}", m.id, ++m.cuts);
    while (live_->impl_->data.object_numbers.contains(object_name));
    const std::vector<const Edit*> edits = pointers(m.edits);
    const Object object = object_of(object_name, edits);
    if (auto done = change({.kind = CommandKind::Object, .id = object_name, .object = &object}); !done) return done;
    if (names.empty()) return show_instead_of_mesh(m, object_name);
    for (const std::string& name : names) {
        Edit edit = *live_->find(*live_->find_edit(name));
        if (name == names.front()) {
            const physics::Pose frame = frame_of(edit);
            Node node;
            node.kind = Node::Kind::Object;
            node.object = {live_->impl_->data.object_numbers.find(object_name)->second, 0};
            node.transform.position = frame.position;
            node.transform.rotation = frame.rotation;
            edit.node = std::move(node);
            edit.op = Op::Union;
            edit.blend_radius = 0;
            edit.material_blend_radius = -1;
        } else {
            edit.hidden = true;
        }
        if (auto done = change_own(name, edit); !done) return done;
    }
    return {};
}

// What is left of a body that a mesh was is seen as the solid that it is, and the mesh is hidden.
Result<void> Simulation::show_instead_of_mesh(Member& m, const std::string& object_name) {
    SceneData& data = live_->impl_->data;
    const physics::Pose pose = state(m).pose;
    Edit placed;
    placed.name = object_name;
    for (int i = 2; live_->find_edit(placed.name); ++i) placed.name = formatted("{}.{}", object_name, i);
    placed.node.kind = Node::Kind::Object;
    placed.node.object = {data.object_numbers.find(object_name)->second, 0};
    placed.node.transform.position = pose.position;
    placed.node.transform.rotation = pose.rotation;
    placed.dynamic = true;
    owned_.insert(placed.name);
    for (SceneBody& b : data.bodies)
        if (b.id == m.id) b.edits = {placed.name};
    if (auto done = change({.kind = CommandKind::Add, .edit = &placed}); !done) return done;
    m.edit = placed.name;
    m.began = pose;
    return hide_mesh(m);
}

// Parts too small to be bodies: they are seen to fall, and counted.
void Simulation::scatter(const field::LoosePart& part, const physics::Pose& frame, uint32_t material) {
    const auto& materials = start_.impl_->data.materials;
    const vec3 color = material > 0 && material <= materials.size() ? materials[material - 1].second.base_color
                                                                    : Material{}.base_color;
    const vec3 at = frame * part.box.center();
    crumbs_.push_back({at, at, {}, 0.5f * voxel_size_ * std::cbrt(float(part.points)), color, steps_});
    ++crumb_count_;
}

void Simulation::drop_crumbs() {
    const vec3 gravity = start_.impl_->data.physics.gravity;
    for (Crumb& c : crumbs_) {
        c.before = c.position;
        c.velocity = c.velocity + gravity * seconds_;
        c.position = c.position + c.velocity * seconds_;
    }
    const auto age = [&](const Crumb& c) { return float(steps_ - c.since) * seconds_; };
    std::erase_if(crumbs_, [&](const Crumb& c) {
        return age(c) > kCrumbSeconds || (age(c) > 0.1f && ground_ != nullptr && ground_->distance(c.position) < 0);
    });
}

}  // namespace kiln::scene

// SPDX-License-Identifier: MIT
// Simulation: what commands cut loose. Everything happens in the live world's list, as commands with ids of their own:
//   cut      an object, intersect(the edits that reach the part, as they are now; its region); the region is subtracted from the world,
//            and the object placed where it was: a body, which stands apart
//   settled  the object is placed where it came to rest, behind all there is by then
// So parts have bricks of their own, look as what they were cut from, and whatever is done to the world later is done to settled ones too.

#include "scene/body_shapes.h"
#include "scene/part_tree.h"
#include "scene/region.h"
#include "scene/simulation.h"

#include "base/format.h"

#include <kiln/shapes.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace kiln::scene {

namespace {

constexpr float kPartDensity = 1000;  // kg/m³, a body's default
constexpr float kSettleSeconds = 2;   // a part asleep for so long is ground again
constexpr float kReachVoxels =
    8;  // edits so near to a region shape the surface in it, or how the part's values go on around it

}  // namespace

Result<void> Simulation::change(const CommandView& command) {
    const World::Impl& impl = *live_->impl_;
    std::string text = write_command(impl.data, impl.data.stage, command);
    if (auto applied = live_->apply(text, "a part that came loose"); !applied) return applied;
    made_.push_back(std::move(text));
    return {};
}

// The ground becomes what live_ has, and what that cuts loose becomes bodies.
Result<void> Simulation::change_ground() {
    std::vector<Edit> there = ground_of(*live_->impl_, owned_);
    const auto box = changed_box(*live_->impl_, edits_, there);
    if (!box) return box.error();
    edits_ = std::move(there);
    const std::shared_ptr<const field::ProgramField> before = ground_;
    if (auto done = set_ground(*box); !done) return done;
    Box3 cut;
    const std::vector<field::LoosePart> parts = field::loose_parts(
        *before, *ground_, *box, {.voxel_size = voxel_size_, .least_points = 1, .workers = settings_.threads});
    const sdf::Program& program = ground_->program();
    for (const field::LoosePart& part : parts) {
        if (!region_fits(part.region.size)) continue;  // too wide for a region: it stays
        if (part.points < kCrumbPoints) {
            scatter(part, {}, ground_->material(part.box.center()));
            if (auto done = cut_from_ground(part, formatted("crumb{}", crumb_count_)); !done) return done;
            cut = box_union(cut, box_of(part.region));
            continue;
        }
        std::vector<uint32_t> rows, owners;
        program.index.find(box_of(part.region), kReachVoxels * voxel_size_, rows);
        for (const uint32_t row : rows) owners.push_back(program.edits[row].owner);
        std::sort(owners.begin(), owners.end());
        std::vector<const Edit*> near;
        for (const uint32_t owner : owners) near.push_back(&edits_[owner]);
        const auto loose = cut_loose(part, {.edits = near});
        if (!loose) return loose.error();
        if (!*loose) continue;
        cut = box_union(cut, box_of(part.region));
    }
    if (cut.empty()) return {};
    edits_ = ground_of(*live_->impl_, owned_);
    return set_ground(cut);
}

Result<void> Simulation::cut_from_ground(const field::LoosePart& part, const std::string& name) {
    Edit cut;
    cut.name = name;
    for (int i = 2; live_->find_edit(cut.name); ++i) cut.name = formatted("{}.{}", name, i);
    cut.node = region_node(part.region);
    cut.op = Op::Subtract;
    return change({.kind = CommandKind::Add, .edit = &cut});
}

Result<bool> Simulation::cut_loose(const field::LoosePart& part, const Source& from) {
    if (!region_fits(part.region.size)) return false;  // too wide for a region: it stays
    std::string name;
    do name = formatted("part{}", ++parts_);
    while (live_->find_edit(name) || live_->impl_->data.object_numbers.contains(name) || is_body(name));
    const vec3 origin = part.box.center();
    const Object object = object_of_part(name, from.edits, part.region, origin);
    if (auto done = change({.kind = CommandKind::Object, .id = name, .object = &object}); !done) return done.error();
    Edit placed;
    placed.name = name;
    placed.node.kind = Node::Kind::Object;
    placed.node.object = {live_->impl_->data.object_numbers.find(name)->second, 0};
    placed.dynamic = true;
    auto frozen = field_of(*live_->impl_, std::span(&placed, 1));
    if (!frozen) return frozen.error();
    const Box3 own{part.box.min - origin, part.box.max - origin};
    auto shape = physics::SdfShape::moving(*frozen, field::BrickField::of_body(*frozen, voxel_size_));
    const SceneData& data = start_.impl_->data;
    const physics::Pose pose = from.frame * physics::Pose{origin, {}};
    physics::BodySettings settings{.pose = pose,
                                   .density = kPartDensity,
                                   .friction = data.physics.friction,
                                   .restitution = data.physics.restitution,
                                   .surfaces = surfaces_of(data),
                                   .rolling_friction = data.physics.rolling_friction};
    if (const physics::BodySettings* whole = world_->settings(from.body)) {
        settings.motion = whole->motion;
        settings.density = whole->density;
        settings.friction = whole->friction;
        settings.restitution = whole->restitution;
        settings.surfaces = whole->surfaces;
        settings.linear_damping = whole->linear_damping;
        settings.angular_damping = whole->angular_damping;
        settings.rolling_friction = whole->rolling_friction;
    }
    if (shape) {
        const vec3 middle = pose * (*shape)->mass().center;
        settings.shape = std::move(*shape);
        settings.linear_velocity = from.velocity + cross(from.spin, middle - from.about);
        settings.angular_velocity = from.spin;
    }
    if (!shape || !add(settings, name)) {
        // A crumb too thin to have a volume, or one body too many: it stays.
        --parts_;
        if (auto done = change({.kind = CommandKind::Object, .id = name}); !done) return done.error();
        return false;
    }
    if (!from.body)
        if (auto done = cut_from_ground(part, name + ".cut"); !done) return done.error();
    // A body of the live world, so that it stands apart whatever is dug and built; of worlds that keep it, a dynamic edit.
    owned_.insert(name);
    live_->impl_->data.bodies.push_back({.id = name, .edits = {name}, .mesh = {}, .numbers = {}});
    members_.back().edits = {placed};
    placed.node.transform.position = pose.position;
    placed.node.transform.rotation = pose.rotation;
    if (auto done = change({.kind = CommandKind::Add, .edit = &placed}); !done) return done.error();
    members_.back().edit = name;
    loose_.push_back({members_.size() - 1, *live_->find(*live_->find_edit(name)), own});
    return true;
}

// Parts that have slept long enough are ground again, where they lie.
Result<void> Simulation::settle_parts() {
    const int enough = std::max(1, int(std::lround(kSettleSeconds / seconds_)));
    Box3 changed;
    for (Part& part : loose_) {
        Member& m = members_[part.member];
        const physics::BodyState state = world_->state(m.body);
        part.asleep = state.asleep ? part.asleep + 1 : 0;
        if (part.asleep < enough) continue;
        if (auto there = live(); !there) return there.error();
        // Of several edits: one object, whose edits act on nothing but each other.
        if (edits_of(m).size() > 1)
            if (auto done = show(m); !done) return done;
        m.rest = state;
        const std::string name = std::exchange(m.edit, {});
        for (SceneBody& b : live_->impl_->data.bodies) {
            if (b.id != m.id) continue;
            for (const std::string& own : b.edits) owned_.erase(own);
            b.edits.clear();
        }
        Edit edit = part.placed;
        edit.node.transform.position = state.pose.position;
        edit.node.transform.rotation = state.pose.rotation;
        edit.dynamic = false;
        edit.op = Op::Union;
        edit.blend_radius = 0;
        if (auto done = change({.kind = CommandKind::Change, .id = name, .edit = &edit}); !done) return done;
        if (auto done = change({.kind = CommandKind::Reorder, .id = name}); !done) return done;
        for (int corner = 0; corner < 8; ++corner) {
            const vec3 p = state.pose * vec3{(corner & 1) != 0 ? part.own.max.x : part.own.min.x,
                                             (corner & 2) != 0 ? part.own.max.y : part.own.min.y,
                                             (corner & 4) != 0 ? part.own.max.z : part.own.min.z};
            changed = box_union(changed, {p, p});
        }
        world_->remove(m.body);
    }
    if (changed.empty()) return {};
    std::erase_if(loose_, [&](const Part& part) { return members_[part.member].rest.has_value(); });
    edits_ = ground_of(*live_->impl_, owned_);
    return set_ground(changed);
}

}  // namespace kiln::scene

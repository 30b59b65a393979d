// SPDX-License-Identifier: MIT
// Simulation: what commands cut loose. Everything happens in the live world's list, as commands with ids of their own:
//   cut      an object, intersect(the edits that reach the part, as they are now; its region); the region is subtracted from the world,
//            and the object placed where it was: a body, which stands apart
//   settled  the object is placed where it came to rest, behind all there is by then
// So parts have bricks of their own, look as what they were cut from, and whatever is done to the world later is done to settled ones too.

#include "scene/body_shapes.h"
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

Node region_node(const field::RegionMask& mask) {
    Node out;
    out.shape = SampledMesh{};
    out.shape.data = region_text(mask);
    return out;
}

Box3 box_of(const field::RegionMask& mask) {
    const auto place = [&](field::ivec3 p) { return vec3{float(p.x), float(p.y), float(p.z)} * mask.voxel_size; };
    return {place(mask.first), place(mask.first + mask.size)};
}

// The edits as one tree: a fold for each run of edits that act alike. Leading cuts of nothing are left out.
std::vector<Node> folded(std::span<const Edit* const> edits) {
    std::vector<Node> out;  // children first
    uint32_t top = 0;
    for (const Edit* e : edits) {
        if (e->hidden || (out.empty() && e->op != Op::Union)) continue;
        out.push_back(e->node);
        const auto leaf = uint32_t(out.size() - 1);
        if (leaf == 0) continue;
        Node& before = out[top];
        if (before.kind == Node::Kind::Fold && before.op == e->op && before.blend_radius == e->blend_radius &&
            before.material_blend_radius == e->material_blend_radius) {
            before.children.push_back(leaf);
            continue;
        }
        Node fold;
        fold.kind = Node::Kind::Fold;
        fold.op = e->op;
        fold.blend_radius = e->blend_radius;
        fold.material_blend_radius = e->material_blend_radius;
        fold.children = {top, leaf};
        out.push_back(std::move(fold));
        top = uint32_t(out.size() - 1);
    }
    return out;
}

// intersect(the edits, the region) in a frame at `origin`, with the root first and children behind their parents.
Object object_of_part(std::string name, std::span<const Edit* const> edits, const field::RegionMask& region,
                      vec3 origin) {
    std::vector<Node> nodes = folded(edits);
    nodes.push_back(region_node(region));
    Node root;
    root.kind = Node::Kind::Fold;
    root.op = Op::Intersect;
    root.transform.position = -origin;
    // The tree's top: the last fold, or the only leaf.
    const auto last = uint32_t(nodes.size() - 1);
    uint32_t top = 0;
    for (uint32_t i = 0; i < last; ++i)
        if (nodes[i].kind == Node::Kind::Fold) top = i;
    root.children = {top, last};
    nodes.push_back(std::move(root));
    // A fold that grew has children behind it: number anew, by levels from the root.
    Object out{std::move(name), {}};
    std::vector<uint32_t> order{uint32_t(nodes.size() - 1)};
    for (size_t i = 0; i < order.size(); ++i) {
        Node node = std::move(nodes[order[i]]);
        for (uint32_t& child : node.children) {
            order.push_back(child);
            child = uint32_t(order.size() - 1);
        }
        out.nodes.push_back(std::move(node));
    }
    return out;
}

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
    for (const field::LoosePart& part : field::loose_parts(*before, *ground_, *box, {.voxel_size = voxel_size_})) {
        const auto loose = cut_loose(part);
        if (!loose) return loose.error();
        if (*loose) cut = box_union(cut, box_of(part.region));
    }
    if (cut.empty()) return {};
    edits_ = ground_of(*live_->impl_, owned_);
    return set_ground(cut);
}

Result<bool> Simulation::cut_loose(const field::LoosePart& part) {
    if (!region_fits(part.region.size)) return false;  // too wide for a region: it stays
    std::vector<uint32_t> rows;
    const sdf::Program& program = ground_->program();
    program.index.find(box_of(part.region), kReachVoxels * voxel_size_, rows);
    std::vector<uint32_t> owners;
    for (const uint32_t row : rows) owners.push_back(program.edits[row].owner);
    std::sort(owners.begin(), owners.end());
    std::vector<const Edit*> near;
    for (const uint32_t owner : owners) near.push_back(&edits_[owner]);

    std::string name;
    do name = formatted("part{}", ++parts_);
    while (live_->find_edit(name) || live_->impl_->data.object_numbers.contains(name));
    const vec3 origin = part.box.center();
    const Object object = object_of_part(name, near, part.region, origin);
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
    if (!shape || !add({.shape = std::move(*shape),
                        .pose = {origin, {}},
                        .density = kPartDensity,
                        .friction = data.physics.friction,
                        .restitution = data.physics.restitution,
                        .surfaces = surfaces_of(data)},
                       name)) {
        // A crumb too thin to have a volume, or one body too many: it stays.
        --parts_;
        if (auto done = change({.kind = CommandKind::Object, .id = name}); !done) return done.error();
        return false;
    }
    Edit cut;
    cut.name = name + ".cut";
    cut.node = region_node(part.region);
    cut.op = Op::Subtract;
    if (auto done = change({.kind = CommandKind::Add, .edit = &cut}); !done) return done.error();
    // A body of the live world, so that it stands apart whatever is dug and built; of worlds that keep it, a dynamic edit.
    owned_.insert(name);
    live_->impl_->data.bodies.push_back({.id = name, .edits = {name}, .mesh = {}, .numbers = {}});
    placed.node.transform.position = origin;
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
        m.rest = state;
        const std::string name = std::exchange(m.edit, {});
        owned_.erase(name);
        for (SceneBody& b : live_->impl_->data.bodies)
            if (b.id == name) b.edits.clear();
        Edit edit = part.placed;
        edit.node.transform.position = state.pose.position;
        edit.node.transform.rotation = state.pose.rotation;
        edit.dynamic = false;
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

Result<void> Simulation::keep(World& world) const {
    History history = world.history();
    history.begin_group("play");
    const auto all = [&]() -> Result<void> {
        for (const std::string& command : made_)
            if (auto applied = world.apply(command, "keep"); !applied) return applied;
        for (const Part& part : loose_) {
            const Member& m = members_[part.member];
            const auto id = world.find_edit(m.edit);
            if (!id) return Error{formatted("keep: there is no edit \"{}\"", m.edit), ErrorKind::Usage};
            Edit edit = *world.find(*id);
            const physics::Pose pose = state(m).pose;
            edit.node.transform.position = pose.position;
            edit.node.transform.rotation = pose.rotation;
            if (auto changed = world.change(*id, edit); !changed) return changed;
        }
        return {};
    };
    if (auto done = all(); !done) {
        (void)history.cancel_group();
        return done;
    }
    return history.end_group();
}

}  // namespace kiln::scene

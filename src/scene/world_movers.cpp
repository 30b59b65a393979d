// SPDX-License-Identifier: MIT
// World: bodies and dynamic edits, see movers.h.

#include "scene/movers.h"

#include "scene/world_impl.h"

#include "sdf/place.h"

#include "base/assert.h"
#include "base/format.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>
#include <utility>

namespace kiln {

using scene::EditList;
using scene::Mover;

namespace scene {

std::vector<Edit> in_frame_of_first(std::vector<Edit> edits) {
    const Pose local = inverse(frame_of(edits.front()));
    for (Edit& e : edits) {
        const Pose moved = local * frame_of(e);
        e.node.transform.position = moved.position;
        e.node.transform.rotation = moved.rotation;
    }
    edits.front().node.transform.position = {};
    edits.front().node.transform.rotation = {};
    edits.front().op = Op::Union;
    return edits;
}

bool is_hard_union(const sdf::EditSpan& span) { return span.op == Op::Union && span.reach == 0; }

Box3 posed_box(const sdf::Program& object, const Pose& pose) {
    const Box3 solid = sdf::solid_box(object);
    Box3 out;
    for (int corner = 0; corner < 8 && !solid.empty(); ++corner) {
        const vec3 p =
            pose * vec3{(corner & 1) != 0 ? solid.max.x : solid.min.x, (corner & 2) != 0 ? solid.max.y : solid.min.y,
                        (corner & 4) != 0 ? solid.max.z : solid.min.z};
        out = box_union(out, {p, p});
    }
    return out;
}

}  // namespace scene

namespace {

// Number of the material of the first shape, if all shapes are of glass; else 0. Trees may be as deep as memory holds.
uint32_t glass_in(const scene::SceneData& data, const Node& root) {
    struct Visit {
        const Node* node;
        const Object* of;
        MaterialId parents;
    };
    std::vector<Visit> todo{{&root, nullptr, {}}};
    uint32_t first = 0;
    while (!todo.empty()) {
        const auto [node, of, parents] = todo.back();
        todo.pop_back();
        const MaterialId own = node->material ? node->material : parents;
        switch (node->kind) {
        case Node::Kind::Shape:
            if (!own || own.index >= data.materials.size() || !(data.materials[own.index].second.opacity < 1)) return 0;
            if (first == 0) first = sdf::material_number(own);
            break;
        case Node::Kind::Object: {
            const Object& object = data.objects[node->object.index];
            todo.push_back({&object.nodes.front(), &object, own});
            break;
        }
        case Node::Kind::Fold:
            if (node->children.empty()) return 0;
            for (auto child = node->children.rbegin(); child != node->children.rend(); ++child)
                todo.push_back({&of->nodes[*child], of, own});
            break;
        }
    }
    return first;
}

}  // namespace

uint32_t World::Impl::glass_of(const Edit& edit) const { return edit.op == Op::Union ? glass_in(data, edit.node) : 0; }

// Its edits as a program of their own. Samples are the list's, so that it can be placed into it.
Result<void> World::Impl::compile_mover(Mover& m) {
    sdf::Program object;
    object.samples = list.samples;
    object.grids = list.grids;
    object.meshes = list.meshes;
    std::vector<Edit> own;
    std::vector<uint32_t> owners;
    for (const uint32_t slot : m.slots) {
        own.push_back(*edits[slot].edit);
        owners.push_back(slot);
    }
    m.glass = glass_of(own.front());
    for (const Edit& e : own)
        if (glass_of(e) == 0) m.glass = 0;
    own = scene::in_frame_of_first(std::move(own));
    m.material = 0;
    if (m.body == Mover::kNoBody) {
        m.material = sdf::material_number(own.front().node.material);
        own.front().node.material = {};
    }
    auto source = scene::with_grids(own, data.objects, data.folder, grids);
    if (!source) return source.error();
    for (size_t i = 0; i < own.size(); ++i) {
        auto row = sdf::insert(object, source->edits[i], source->objects, grids.grids, sdf::order_at(i), owners[i],
                               nullptr, grids.meshes);
        if (!row) return row.error();
    }
    object.settle();
    m.object = std::make_shared<const sdf::Program>(std::move(object));
    m.bricks.reset();
    return {};
}

// Is it solid by itself where it is?
bool World::Impl::stands_apart(const Mover& m) const {
    if (!m.object || m.object->unbounded || m.object->index.size() == 0) return false;
    if (m.body != Mover::kNoBody) return true;
    const sdf::EditSpan& own = list.edits[edits[m.slots.front()].row];
    if (!scene::is_hard_union(own)) return false;
    std::vector<uint32_t> rows;
    list.index.find(scene::posed_box(*m.object, m.pose), 0, rows);
    return std::none_of(rows.begin(), rows.end(), [&](uint32_t row) {
        const sdf::EditSpan& other = list.edits[row];
        if (other.order <= own.order || scene::is_hard_union(other)) return false;
        const auto theirs = mover_of.find(other.owner);
        return theirs == mover_of.end() || movers.at(theirs->second).body == Mover::kNoBody;
    });
}

// Brings a dynamic edit's row to its pose, if the list has it.
Result<void> World::Impl::settle_mover(Mover& m) {
    const bool apart = stands_apart(m);
    if (!apart && m.body == Mover::kNoBody && !(m.row_pose == m.pose)) {
        const uint32_t slot = m.slots.front(), old = edits[slot].row;
        Edit moved = *edits[slot].edit;
        moved.node.transform.position = m.pose.position;
        moved.node.transform.rotation = m.pose.rotation;
        const auto row = compile_edit(moved, list.edits[old].order, slot);
        if (!row) return row.error();
        list.remove(old);
        edits.set_row(slot, *row);
        row_changed(old, *row);
        m.row_pose = m.pose;
    }
    if (apart != m.apart) {
        m.apart = apart;
        const std::lock_guard lock(mutex);
        program.reset();
    }
    const std::lock_guard lock(mutex);
    all.reset();
    asked.reset();
    return {};
}

void World::Impl::add_mover(Mover m) {
    const uint32_t key = m.slots.front();
    m.pose = m.before = m.row_pose = scene::frame_of(*edits[key].edit);
    // What the list could compile, it can by itself.
    if (!compile_mover(m)) m.object = nullptr;
    for (const uint32_t slot : m.slots) mover_of[slot] = key;
    Mover& placed = movers[key] = std::move(m);
    const auto settled = settle_mover(placed);
    KILN_ASSERT(bool(settled), "a row that was compiled compiles no more");
}

void World::Impl::drop_mover(uint32_t key) {
    const auto at = movers.find(key);
    for (const uint32_t slot : at->second.slots) mover_of.erase(slot);
    movers.erase(at);
    const std::lock_guard lock(mutex);
    program.reset();
    all.reset();
    asked.reset();
}

// The mover that an edit belongs to as things are, if any.
std::optional<Mover> World::Impl::mover_at(uint32_t slot) const {
    const Edit& edit = *edits[slot].edit;
    for (uint32_t b = 0; b < data.bodies.size(); ++b) {
        const std::vector<std::string>& names = data.bodies[b].edits;
        if (std::find(names.begin(), names.end(), edit.name) == names.end()) continue;
        Mover m;
        m.body = b;
        for (const std::string& name : names)
            if (const uint32_t other = edits.find(std::string_view(name)); other != EditList::kNone)
                m.slots.push_back(other);
        return m;
    }
    if (!stands_alone(edit)) return std::nullopt;
    Mover m;
    m.slots = {slot};
    return m;
}

void World::Impl::mover_changed(uint32_t slot, uint32_t removed, uint32_t inserted) {
    if (movers.empty() && (inserted == field::kNoRow || (data.bodies.empty() && !stands_alone(*edits[slot].edit))))
        return;
    std::vector<uint32_t> left;
    if (const auto was = mover_of.find(slot); was != mover_of.end()) {
        left = movers.at(was->second).slots;
        drop_mover(was->second);
    }
    // The other edits of a body that has lost one are a body still.
    left.insert(left.begin(), slot);
    for (const uint32_t s : left) {
        if (edits.find(edits.id(s)) == EditList::kNone || mover_of.contains(s)) continue;
        std::optional<Mover> now = mover_at(s);
        if (!now) continue;
        for (const uint32_t other : now->slots)
            if (const auto was = mover_of.find(other); was != mover_of.end()) drop_mover(was->second);
        add_mover(std::move(*now));
    }
    // Others may touch what came or went.
    for (const uint32_t row : {removed, inserted}) {
        if (row == field::kNoRow || list.edits[row].count == 0 || scene::is_hard_union(list.edits[row])) continue;
        const sdf::EditSpan& span = list.edits[row];
        const Box3 reach = span.indexed(row).influence(0);
        for (auto& [key, m] : movers) {
            if (m.body != Mover::kNoBody || !m.object) continue;
            if (!span.everywhere() && !reach.overlaps(scene::posed_box(*m.object, m.pose))) continue;
            const auto settled = settle_mover(m);
            KILN_ASSERT(bool(settled), "a row that was compiled compiles no more");
        }
    }
}

void World::Impl::find_movers() {
    const std::map<uint32_t, Mover> before = std::exchange(movers, {});
    mover_of.clear();
    {
        const std::lock_guard lock(mutex);
        all.reset();
    }
    for (const scene::SceneBody& body : data.bodies) {
        for (const std::string& name : body.edits) {
            const uint32_t slot = edits.find(std::string_view(name));
            if (slot == EditList::kNone) continue;
            if (!mover_of.contains(slot)) add_mover(*mover_at(slot));
            break;
        }
    }
    edits.each([&](uint32_t slot) {
        if (stands_alone(*edits[slot].edit) && !mover_of.contains(slot)) add_mover(*mover_at(slot));
    });
    // The list was compiled from the scene; what had been moved goes back to where it was.
    for (auto& [key, m] : movers) {
        const auto was = before.find(key);
        if (was == before.end() || was->second.slots != m.slots) continue;
        m.pose = was->second.pose;
        m.before = was->second.before;
        const auto settled = settle_mover(m);
        KILN_ASSERT(bool(settled), "a row that was compiled compiles no more");
    }
}

std::vector<uint32_t> World::Impl::apart_rows() const {
    std::vector<uint32_t> out;
    for (const auto& [key, m] : movers)
        if (m.apart)
            for (const uint32_t slot : m.slots) out.push_back(edits[slot].row);
    std::sort(out.begin(), out.end());
    return out;
}

std::vector<field::RowChange> World::Impl::changes_beside(std::span<const field::RowChange> of_list,
                                                          std::span<const uint32_t> apart_before,
                                                          std::span<const uint32_t> apart_now) {
    const auto has = [](std::span<const uint32_t> rows, uint32_t row) {
        return std::binary_search(rows.begin(), rows.end(), row);
    };
    std::vector<field::RowChange> out;
    std::unordered_set<uint32_t> came, went;
    for (field::RowChange c : of_list) {
        came.insert(c.inserted);
        went.insert(c.removed);
        if (c.removed != field::kNoRow && has(apart_before, c.removed)) c.removed = field::kNoRow;
        if (c.inserted != field::kNoRow && has(apart_now, c.inserted)) c.inserted = field::kNoRow;
        if (c.removed != field::kNoRow || c.inserted != field::kNoRow) out.push_back(c);
    }
    for (const uint32_t row : apart_before)
        if (!has(apart_now, row) && !went.contains(row)) out.push_back({field::kNoRow, row});
    for (const uint32_t row : apart_now)
        if (!has(apart_before, row) && !came.contains(row)) out.push_back({row, field::kNoRow});
    return out;
}

std::shared_ptr<const sdf::Program> World::Impl::whole() {
    const std::shared_ptr<const sdf::Program> ground = compiled();
    const std::lock_guard lock(mutex);
    if (std::none_of(movers.begin(), movers.end(), [](const auto& m) { return m.second.apart; })) return ground;
    if (all) return all;
    sdf::Program out = sdf::detached(*ground);
    uint64_t order = edits.last() == EditList::kNone ? 0 : list.edits[edits[edits.last()].row].order;
    for (auto& [key, m] : movers) {
        if (!m.apart) continue;
        // A dynamic edit is folded where it stands in the list: far from surfaces, later blends lead its values on.
        uint64_t place = list.edits[edits[m.slots.front()].row].order;
        if (m.body != Mover::kNoBody) place = order = sdf::order_between(order, UINT64_MAX);
        auto placed = sdf::place(out, *m.object, m.pose, m.material, place);
        if (!placed) {
            // The list has moved its samples since.
            const std::shared_ptr<const field::BrickSet> baked = m.bricks;
            if (compile_mover(m)) placed = sdf::place(out, *m.object, m.pose, m.material, place);
            m.bricks = baked;
        }
        KILN_ASSERT(bool(placed), "{}", placed ? "" : placed.error().message);
    }
    all = std::make_shared<const sdf::Program>(std::move(out));
    return all;
}

Result<void> World::Impl::instances_of(float field_voxel, field::DistanceFormat format, std::vector<Instance>& out,
                                       bool shows) {
    const std::lock_guard lock(mutex);
    for (auto& [key, m] : movers) {
        if (!m.apart) continue;
        if (!m.bricks || m.bricks_for != field_voxel || m.bricks->field().options().format != format) {
            const float voxel = field::BrickSet::voxel_size_for(*m.object, field_voxel);
            std::weak_ptr<const field::BrickSet>& known = brick_sets[field::BrickSet::key(*m.object, voxel, format)];
            m.bricks = known.lock();
            if (!m.bricks) {
                auto made = field::BrickSet::make(m.object, voxel, format);
                if (!made) return Error{edits[key].edit->name + ": " + made.error().message, made.error().kind};
                m.bricks = std::move(*made);
                known = m.bricks;
            }
            m.bricks_for = field_voxel;
        }
        m.drawn_as = uint32_t(out.size());
        out.push_back(
            {.bricks = m.bricks, .pose = m.pose, .before = m.before, .material = m.material, .glass = m.glass});
        if (shows) m.before = m.pose;
    }
    std::erase_if(brick_sets, [](const auto& known) { return known.second.expired(); });
    return {};
}

// After instances_of().
void World::Impl::outlines_of(Frame& out) {
    if (edits.outlined() == 0) return;
    const std::lock_guard lock(mutex);
    edits.each([&](uint32_t slot) {
        const Edit& e = *edits[slot].edit;
        if (!e.outline || e.hidden) return;
        const auto at = mover_of.find(slot);
        if (at == mover_of.end() || !movers.at(at->second).apart) {
            out.outlines.push_back({edits[slot].row, *e.outline});
            return;
        }
        // Rows of an object are in the order of its edits, whichever mover its bricks were made for.
        const Mover& m = movers.at(at->second);
        const auto row = std::find(m.slots.begin(), m.slots.end(), slot) - m.slots.begin();
        out.outlines.push_back({uint32_t(row), *e.outline, m.drawn_as});
    });
}

Result<void> World::move(EditId id, const Pose& pose) {
    Impl& m = *impl_;
    const uint32_t slot = m.edits.find(id);
    if (slot == EditList::kNone) return Error{"move: the edit is gone", ErrorKind::Usage};
    const auto found = m.mover_of.find(slot);
    if (found == m.mover_of.end() ||
        (m.movers.at(found->second).body == Mover::kNoBody && !m.edits[slot].edit->dynamic))
        return Error{
            m.edits[slot].edit->name + ": only bodies and dynamic edits are moved; make it dynamic, or change the edit",
            ErrorKind::Usage};
    const quat q = pose.rotation;
    const float size = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
    const vec3 p = pose.position;
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z) || !(std::fabs(size - 1) < 1e-3f))
        return Error{m.edits[slot].edit->name + ": a pose needs a finite position and a rotation of unit length",
                     ErrorKind::Usage};
    Mover& mover = m.movers.at(found->second);
    const Pose was = mover.pose;
    mover.pose = {p, {q.x / size, q.y / size, q.z / size, q.w / size}};
    auto settled = m.settle_mover(mover);
    if (!settled) mover.pose = was;
    return settled;
}

std::optional<Pose> World::pose(EditId id) const {
    const uint32_t slot = impl_->edits.find(id);
    const auto found = slot == EditList::kNone ? impl_->mover_of.end() : impl_->mover_of.find(slot);
    if (found == impl_->mover_of.end()) return std::nullopt;
    return impl_->movers.at(found->second).pose;
}

}  // namespace kiln

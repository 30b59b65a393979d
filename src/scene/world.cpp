// SPDX-License-Identifier: MIT
// World: the scene's data, and the list of edits that is compiled change by change. Files are in world_files.cpp.

#include "scene/world_impl.h"

#include "scene/schema.h"

#include "sdf/tables.h"

#include "base/assert.h"
#include "base/format.h"

#include <algorithm>
#include <utility>

namespace kiln {

using scene::SceneData;

World::World() : impl_(std::make_unique<Impl>()) {}
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;
World::~World() = default;

Result<World> World::parse(std::string_view json, const std::string& file_name) {
    World world;
    if (auto read = world.impl_->read(world, std::string(json), file_name); !read) return read.error();
    if (auto ready = world.impl_->get_ready(world); !ready) return ready.error();
    return world;
}

Result<void> World::Impl::read(World& world, std::string text, const std::string& name) {
    auto scene = scene::read_scene(std::move(text), name);
    if (!scene) return scene.error();
    data = std::move(*scene);
    world.field_settings = std::move(data.stage.field);
    world.lights = std::move(data.stage.lights);
    world.environment = std::move(data.stage.environment);
    world.cameras = std::move(data.stage.cameras);
    for (Object& object : data.objects) scene::make_canonical(object);
    for (auto& [material_name, material] : data.materials) scene::make_canonical(material);
    adopt(std::exchange(data.edits, {}), data.edit_places);
    data.edit_places = {};
    return {};
}

Result<void> World::Impl::get_ready(World& world) {
    // Compiled now, so that faults which only the whole scene shows come with their place.
    if (auto done = compile_all(); !done) return done;
    meshes = scene::load_meshes(data);
    if (!world.environment || world.environment->file.empty()) return {};
    return read_sky(world.environment->file);
}

World World::Impl::copy_of(const World& of) {
    World out;
    out.field_settings = of.field_settings;
    out.lights = of.lights;
    out.environment = of.environment;
    out.cameras = of.cameras;
    Impl& to = *out.impl_;
    Impl& from = *of.impl_;
    to.data = from.data;
    to.edits = from.edits.copy();
    to.names_given = from.names_given;
    to.list = from.list;
    to.grids = from.grids;
    to.meshes = from.meshes;
    to.generations = from.generations;
    to.mover_of = from.mover_of;
    to.all_is_new = true;
    {
        const std::lock_guard lock(from.mutex);
        to.program = from.program;
        to.all = from.all;
        to.asked = from.asked;
        to.built = from.built;
        to.built_with = from.built_with;
        to.built_apart = from.built_apart;
        to.changes = from.changes;
        to.inserted_since = from.inserted_since;
        to.bricks = from.bricks;
        to.levels = from.levels;
        to.levels_with = from.levels_with;
        to.levels_apart = from.levels_apart;
        to.level_changes = from.level_changes;
        to.movers = from.movers;
        to.brick_sets = from.brick_sets;
        to.sky_image = from.sky_image;
    }
    for (auto& [key, m] : to.movers) {
        m.pose = m.before = scene::frame_of(*to.edits[key].edit);
        const auto settled = to.settle_mover(m);
        KILN_ASSERT(bool(settled), "a row that was compiled compiles no more");
    }
    return out;
}

std::string World::to_json() const { return impl_->json(*this); }

MaterialId World::add_material(const std::string& name, const Material& material) {
    if (scene::check_material(name, material)) return {};
    SceneData& data = impl_->data;
    const auto found = data.material_numbers.find(name);
    const auto number = found == data.material_numbers.end() ? uint32_t(data.materials.size()) : found->second;
    auto held = std::make_unique<std::pair<std::string, Material>>(name, material);
    scene::make_canonical(held->second);
    scene::Change change{.what = scene::Change::What::Material, .id = {number, 0}, .held = std::move(held)};
    return impl_->make(*this, std::move(change)) ? MaterialId{number, 0} : MaterialId{};
}

Result<ObjectId> World::add_object(Object object) {
    SceneData& data = impl_->data;
    if (auto fault = scene::check_object(object, data.objects.size(), data.materials.size()))
        return Error{object.name + ": " + fault->message, fault->kind};
    if (data.object_numbers.contains(object.name))
        return Error{object.name + ": there is an object of this name; choose another", ErrorKind::Usage};
    const ObjectId id{uint32_t(data.objects.size()), 0};
    scene::make_canonical(object);
    scene::Change change{
        .what = scene::Change::What::Object, .id = {id.index, 0}, .held = std::make_unique<Object>(std::move(object))};
    if (auto made = impl_->make(*this, std::move(change)); !made) return made.error();
    return id;
}

Result<EditId> World::add(Edit edit) { return insert(std::move(edit), {}); }

Result<EditId> World::insert(Edit edit, EditId before) {
    Impl& m = *impl_;
    if (before && m.edits.find(before) == scene::EditList::kNone)
        return Error{"insert: the edit to stand before is gone", ErrorKind::Usage};
    if (!edit.name.empty() && m.edits.find(edit.name) != scene::EditList::kNone)
        return Error{edit.name + ": there is an edit of this name; choose another", ErrorKind::Usage};
    if (auto fault = scene::check_edit(edit, m.data.objects.size(), m.data.materials.size()))
        return Error{(edit.name.empty() ? "edit" : edit.name) + ": " + fault->message, fault->kind};
    scene::make_canonical(edit);
    if (edit.name.empty()) edit.name = m.free_name(edit);
    const EditId id = m.edits.free_id();
    scene::Change change{.what = scene::Change::What::Presence,
                         .id = id,
                         .before = before,
                         .held = std::make_unique<Edit>(std::move(edit))};
    if (auto made = m.make(*this, std::move(change)); !made) return made.error();
    return id;
}

Result<void> World::change(EditId id, Edit edit) {
    Impl& m = *impl_;
    const uint32_t slot = m.edits.find(id);
    if (slot == scene::EditList::kNone) return Error{"change: the edit is gone", ErrorKind::Usage};
    const Edit& old = *m.edits[slot].edit;
    if (edit.name.empty()) edit.name = old.name;
    if (edit.name != old.name && m.edits.find(edit.name) != scene::EditList::kNone)
        return Error{edit.name + ": there is an edit of this name; choose another", ErrorKind::Usage};
    if (auto fault = scene::check_edit(edit, m.data.objects.size(), m.data.materials.size()))
        return Error{edit.name + ": " + fault->message, fault->kind};
    scene::make_canonical(edit);
    return m.make(
        *this,
        scene::Change{.what = scene::Change::What::Content, .id = id, .held = std::make_unique<Edit>(std::move(edit))});
}

Result<void> World::remove(EditId id) {
    if (impl_->edits.find(id) == scene::EditList::kNone) return Error{"remove: the edit is gone", ErrorKind::Usage};
    return impl_->make(*this, scene::Change{.what = scene::Change::What::Presence, .id = id});
}

Result<void> World::reorder(EditId id, EditId before) {
    const scene::EditList& edits = impl_->edits;
    const uint32_t slot = edits.find(id);
    if (slot == scene::EditList::kNone) return Error{"reorder: the edit is gone", ErrorKind::Usage};
    const uint32_t next = before ? edits.find(before) : scene::EditList::kNone;
    if (before && next == scene::EditList::kNone)
        return Error{"reorder: the edit to stand before is gone", ErrorKind::Usage};
    if (next == slot || edits[slot].next == next) return {};
    return impl_->make(*this, scene::Change{.what = scene::Change::What::Order, .id = id, .before = before});
}

const Edit* World::find(EditId id) const {
    const uint32_t slot = impl_->edits.find(id);
    return slot == scene::EditList::kNone ? nullptr : impl_->edits[slot].edit.get();
}

std::optional<EditId> World::find_edit(std::string_view name) const {
    const uint32_t slot = impl_->edits.find(name);
    return slot == scene::EditList::kNone ? std::nullopt : std::optional(impl_->edits.id(slot));
}

std::vector<EditId> World::edits() const {
    std::vector<EditId> out;
    out.reserve(impl_->edits.size());
    impl_->edits.each([&](uint32_t slot) { out.push_back(impl_->edits.id(slot)); });
    return out;
}

const Material* World::material(MaterialId id) const {
    return id && id.index < impl_->data.materials.size() ? &impl_->data.materials[id.index].second : nullptr;
}

std::string_view World::material_name(MaterialId id) const {
    return id && id.index < impl_->data.materials.size() ? std::string_view(impl_->data.materials[id.index].first)
                                                         : std::string_view();
}

std::string scene_schema_json() { return scene::schema_json(); }

// The implementation's own parts.

void World::Impl::adopt(std::vector<Edit> list_of, const std::vector<scene::JsonIndex>& places) {
    edits.reserve(list_of.size());
    for (size_t i = 0; i < list_of.size(); ++i) {
        scene::make_canonical(list_of[i]);
        edits.insert(edits.free_id(), std::make_unique<Edit>(std::move(list_of[i])), scene::EditList::kNone, places[i]);
    }
    generations.resize_pages(edits.slots() / generations.kPageSize + 1);
}

std::string World::Impl::free_name(const Edit& edit) {
    const Node& n = edit.node;
    const std::string base(n.kind == Node::Kind::Shape ? sdf::shape_rows()[n.shape.kind].name
                                                       : data.objects[n.object.index].name);
    std::string name = formatted("{}-{}", base, edits.size() + 1);
    if (edits.find(name) == scene::EditList::kNone) return name;
    // The count's own name is taken where edits have been removed: the search goes on where the last one ended.
    for (names_given = std::max<uint64_t>(names_given, edits.size() + 1);; ++names_given) {
        name = formatted("{}-{}", base, names_given);
        if (edits.find(name) == scene::EditList::kNone) return name;
    }
}

std::string World::Impl::json(const World& world) const {
    std::vector<scene::PlacedEdit> placed;
    placed.reserve(edits.size());
    edits.each([&](uint32_t slot) { placed.push_back({edits[slot].edit.get(), edits[slot].place}); });
    return scene::write_scene(data, {world.field_settings, world.lights, world.environment, world.cameras}, placed);
}

Result<uint32_t> World::Impl::compile_edit(const Edit& edit, uint64_t order, uint32_t owner) {
    // A shape needs none of the objects, which may be many.
    static const std::vector<Object> kNone;
    const std::vector<Object>& objects = edit.node.kind == Node::Kind::Object ? data.objects : kNone;
    auto source = scene::with_grids(std::span(&edit, 1), objects, data.folder, grids);
    if (!source) return Error{edit.name + ": " + source.error().message, source.error().kind};
    auto row = sdf::insert(list, source->edits[0], source->objects, grids.grids, order, owner, nullptr, grids.meshes);
    if (!row) return Error{edit.name + ": " + row.error().message, row.error().kind};
    return row;
}

std::optional<Error> World::Impl::object_fault(const Edit& placed) {
    auto source = scene::with_grids(std::span(&placed, 1), data.objects, data.folder, grids);
    if (!source) return source.error();
    auto alone = sdf::compile(source->source());
    return alone ? std::nullopt : std::optional(alone.error());
}

uint64_t World::Impl::order_before(uint32_t slot, uint32_t moving) {
    constexpr uint32_t kNone = scene::EditList::kNone;
    uint32_t previous = slot == kNone ? edits.last() : edits[slot].previous;
    if (previous != kNone && previous == moving) previous = edits[previous].previous;
    const auto order_of = [&](uint32_t s, uint64_t none) { return s == kNone ? none : list.edits[edits[s].row].order; };
    const auto between = [&] { return sdf::order_between(order_of(previous, 0), order_of(slot, UINT64_MAX)); };
    if (const uint64_t order = between()) return order;
    // Room again, by numbering the whole list.
    std::vector<uint32_t> rows;
    rows.reserve(edits.size());
    edits.each([&](uint32_t s) { rows.push_back(edits[s].row); });
    list.number_anew(rows);
    {
        const std::lock_guard lock(mutex);
        program.reset();
        asked.reset();
    }
    return between();
}

}  // namespace kiln

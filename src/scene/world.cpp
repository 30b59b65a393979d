// SPDX-License-Identifier: MIT
// World: the scene's data, compiled when it is first asked and again after a change.

#include "scene/world_impl.h"

#include "scene/bundled.h"
#include "scene/framing.h"
#include "scene/heights.h"
#include "scene/schema.h"
#include "scene/suggest.h"

#include "sdf/tables.h"

#include "base/atomic_file.h"
#include "base/format.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <sys/stat.h>
#include <utility>

namespace kiln {

using scene::SceneData;

World::World() : impl_(std::make_unique<Impl>()) {}
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;
World::~World() = default;

namespace {

Result<std::string> read_file(const std::string& path) {
    struct stat info {};
    if (::stat(path.c_str(), &info) != 0)
        return Error{formatted("{}: cannot be read: {}; check the name", path, std::strerror(errno)), ErrorKind::Input};
    if (S_ISDIR(info.st_mode)) return Error{path + ": is a folder; name a scene file in it", ErrorKind::Input};
    std::ifstream in(path, std::ios::binary);
    if (!in) return Error{formatted("{}: cannot be read: {}", path, std::strerror(errno)), ErrorKind::Input};
    std::string text;
    text.resize(size_t(std::max<off_t>(info.st_size, 0)));
    in.read(text.data(), std::streamsize(text.size()));
    text.resize(size_t(in.gcount()));
    // Pipes and devices have no size to tell.
    char more[65536];
    while (in.good() && in.peek() != std::ifstream::traits_type::eof()) {
        in.read(more, sizeof more);
        text.append(more, size_t(in.gcount()));
    }
    if (in.bad()) return Error{path + ": cannot be read to its end", ErrorKind::Input};
    return text;
}

}  // namespace

Result<World> World::load(const std::string& path_or_name) {
    struct stat info {};
    const bool is_name = path_or_name.find('/') == std::string::npos && path_or_name.find('.') == std::string::npos;
    if (is_name && ::stat(path_or_name.c_str(), &info) != 0) {
        std::vector<std::string_view> names;
        for (const scene::BundledScene& file : scene::bundled_files()) {
            if (file.name == path_or_name) return parse(file.json, path_or_name);
            names.push_back(file.name);
        }
        return Error{formatted("{}: neither a file nor a bundled scene; {}", path_or_name,
                               scene::suggestion(path_or_name, names)),
                     ErrorKind::Input};
    }
    auto text = read_file(path_or_name);
    if (!text) return text.error();
    return parse(*text, path_or_name);
}

Result<World> World::parse(std::string_view json, const std::string& file_name) {
    auto data = scene::read_scene(std::string(json), file_name);
    if (!data) return data.error();
    World world;
    Impl& impl = *world.impl_;
    impl.data = std::move(*data);
    world.field_settings = std::move(impl.data.stage.field);
    world.lights = std::move(impl.data.stage.lights);
    world.environment = std::move(impl.data.stage.environment);
    world.cameras = std::move(impl.data.stage.cameras);
    impl.number_all();
    // Compiled now, so that faults which only the whole scene shows come with their place.
    if (auto compiled = impl.compile_all(); !compiled) return compiled.error();
    if (world.environment && !world.environment->file.empty())
        if (auto read = impl.read_sky(world.environment->file); !read) return read.error();
    return world;
}

std::string World::to_json() const {
    return scene::write_scene(impl_->data, {field_settings, lights, environment, cameras});
}

Result<void> World::save(const std::string& path) const {
    auto file = AtomicFile::create(path);
    if (!file) return file.error();
    if (auto done = file->write(to_json()); !done) return done;
    return file->commit();
}

MaterialId World::add_material(const std::string& name, const Material& material) {
    auto& materials = impl_->data.materials;
    for (uint32_t i = 0; i < materials.size(); ++i) {
        if (materials[i].first != name) continue;
        materials[i].second = material;
        return {i, 0};
    }
    materials.emplace_back(name, material);
    return {uint32_t(materials.size() - 1), 0};
}

Result<ObjectId> World::add_object(Object object) {
    SceneData& data = impl_->data;
    if (auto fault = scene::check_object(object, data.objects.size(), data.materials.size()))
        return Error{object.name + ": " + fault->message, fault->kind};
    for (const Object& other : data.objects)
        if (other.name == object.name)
            return Error{object.name + ": there is an object of this name; choose another", ErrorKind::Usage};
    data.objects.push_back(std::move(object));
    Edit placed;
    placed.node.kind = Node::Kind::Object;
    placed.node.object = {uint32_t(data.objects.size() - 1), 0};
    if (auto fault = impl_->object_fault(placed)) {
        data.objects.pop_back();
        return std::move(*fault);
    }
    return placed.node.object;
}

Result<EditId> World::add(Edit edit) {
    SceneData& data = impl_->data;
    if (!edit.name.empty() && impl_->position_of(edit.name))
        return Error{edit.name + ": there is an edit of this name; choose another", ErrorKind::Usage};
    const uint32_t count = uint32_t(data.edits.size());
    const uint32_t slot = impl_->free_slots.empty() ? uint32_t(impl_->slots.size()) : impl_->free_slots.back();
    const auto row = impl_->compile_edit(edit, impl_->order_between(count - 1, UINT32_MAX), slot);
    if (!row) return row.error();
    if (edit.name.empty()) edit.name = impl_->free_name(edit);
    data.edits.push_back(std::move(edit));
    data.edit_places.push_back(SceneData::kNowhere);
    const EditId id = impl_->new_id(count);
    impl_->slots[id.index].row = *row;
    impl_->row_changed(field::kNoRow, *row);
    return id;
}

Result<void> World::change(EditId id, Edit edit) {
    const auto at = impl_->position(id);
    if (!at) return Error{"change: the edit is gone", ErrorKind::Usage};
    Edit& old = impl_->data.edits[*at];
    if (edit.name.empty()) edit.name = old.name;
    if (edit.name != old.name && impl_->position_of(edit.name))
        return Error{edit.name + ": there is an edit of this name; choose another", ErrorKind::Usage};
    uint32_t& row = impl_->slots[id.index].row;
    const auto made = impl_->compile_edit(edit, impl_->list.edits[row].order, id.index);
    if (!made) return made.error();
    impl_->list.remove(row);
    impl_->rename(old.name, edit.name, *at);
    old = std::move(edit);
    impl_->row_changed(std::exchange(row, *made), *made);
    return {};
}

Result<void> World::remove(EditId id) {
    const auto at = impl_->position(id);
    if (!at) return Error{"remove: the edit is gone", ErrorKind::Usage};
    const uint32_t row = impl_->slots[id.index].row;
    impl_->list.remove(row);
    impl_->erase(*at);
    impl_->row_changed(row, field::kNoRow);
    return {};
}

Result<void> World::reorder(EditId id, EditId before) {
    const auto at = impl_->position(id);
    if (!at) return Error{"reorder: the edit is gone", ErrorKind::Usage};
    const auto next = before ? impl_->position(before) : std::optional(uint32_t(impl_->data.edits.size()));
    if (!next) return Error{"reorder: the edit to stand before is gone", ErrorKind::Usage};
    if (*next == *at || *next == *at + 1) return {};
    const uint64_t order = impl_->order_between(*next - 1, *next);
    uint32_t& row = impl_->slots[id.index].row;
    const auto made = impl_->compile_edit(impl_->data.edits[*at], order, id.index);
    if (!made) return made.error();
    impl_->list.remove(row);
    impl_->move_position(*at, *next);
    impl_->row_changed(std::exchange(row, *made), *made);
    return {};
}

const Edit* World::find(EditId id) const {
    const auto at = impl_->position(id);
    return at ? &impl_->data.edits[*at] : nullptr;
}

std::optional<EditId> World::find_edit(std::string_view name) const {
    const auto at = impl_->position_of(name);
    return at ? std::optional(impl_->ids[*at]) : std::nullopt;
}

std::vector<EditId> World::edits() const { return impl_->ids; }

const Material* World::material(MaterialId id) const {
    return id && id.index < impl_->data.materials.size() ? &impl_->data.materials[id.index].second : nullptr;
}

std::string_view World::material_name(MaterialId id) const {
    return id && id.index < impl_->data.materials.size() ? std::string_view(impl_->data.materials[id.index].first)
                                                         : std::string_view();
}

std::string scene_schema_json() { return scene::schema_json(); }
void discard_unfinished_files() noexcept { AtomicFile::remove_temporaries_from_signal(); }

// The implementation's own parts.

void World::Impl::number_all() {
    ids.clear();
    slots.clear();
    names.clear();
    generations = {};
    names.reserve(data.edits.size());
    for (uint32_t i = 0; i < data.edits.size(); ++i) {
        ids.push_back({i, 0});
        slots.push_back({i, 0, i});
        generations.resize_pages(i / generations.kPageSize + 1);
        names.emplace(data.edits[i].name, i);
    }
}

EditId World::Impl::new_id(uint32_t position) {
    uint32_t slot = uint32_t(slots.size());
    if (free_slots.empty()) {
        slots.push_back({position, 0, field::kNoRow});
        generations.resize_pages(slot / generations.kPageSize + 1);
    } else {
        slot = free_slots.back();
        free_slots.pop_back();
        slots[slot].position = position;
    }
    ids.push_back({slot, slots[slot].generation});
    names.emplace(data.edits[position].name, position);
    return ids.back();
}

std::optional<uint32_t> World::Impl::position(EditId id) const {
    if (id.index >= slots.size() || slots[id.index].generation != id.generation ||
        slots[id.index].position == UINT32_MAX)
        return std::nullopt;
    return slots[id.index].position;
}

std::optional<uint32_t> World::Impl::position_of(std::string_view name) const {
    const auto at = names.find(std::string(name));
    return at == names.end() ? std::nullopt : std::optional(at->second);
}

void World::Impl::rename(const std::string& old_name, const std::string& name, uint32_t position) {
    if (old_name == name) return;
    names.erase(old_name);
    names.emplace(name, position);
}

void World::Impl::erase(uint32_t position) {
    const uint32_t slot = ids[position].index;
    slots[slot] = {UINT32_MAX, slots[slot].generation + 1, field::kNoRow};
    generations.write(slot) = slots[slot].generation;
    free_slots.push_back(slot);
    names.erase(data.edits[position].name);
    data.edits.erase(data.edits.begin() + position);
    data.edit_places.erase(data.edit_places.begin() + position);
    ids.erase(ids.begin() + position);
    for (uint32_t i = position; i < ids.size(); ++i) {
        slots[ids[i].index].position = i;
        names[data.edits[i].name] = i;
    }
}

std::string World::Impl::free_name(const Edit& edit) const {
    const Node& n = edit.node;
    const std::string base(n.kind == Node::Kind::Shape ? sdf::shape_rows()[n.shape.kind].name
                                                       : data.objects[n.object.index].name);
    for (size_t i = data.edits.size() + 1;; ++i) {
        std::string name = formatted("{}-{}", base, i);
        if (!names.contains(name)) return name;
    }
}

Result<uint32_t> World::Impl::compile_edit(const Edit& edit, uint64_t order, uint32_t owner) {
    const std::string name = edit.name.empty() ? "edit" : edit.name;
    if (auto fault = scene::check_edit(edit, data.objects.size(), data.materials.size()))
        return Error{name + ": " + fault->message, fault->kind};
    auto source = scene::with_grids(std::span(&edit, 1), data.objects, data.folder, grids);
    if (!source) return Error{name + ": " + source.error().message, source.error().kind};
    auto row = sdf::insert(list, source->edits[0], source->objects, grids.grids, order, owner, nullptr, grids.meshes);
    if (!row) return Error{name + ": " + row.error().message, row.error().kind};
    return row;
}

std::optional<Error> World::Impl::object_fault(const Edit& placed) {
    auto source = scene::with_grids(std::span(&placed, 1), data.objects, data.folder, grids);
    if (!source) return source.error();
    auto alone = sdf::compile(source->source());
    return alone ? std::nullopt : std::optional(alone.error());
}

uint64_t World::Impl::order_between(uint32_t before, uint32_t after) {
    const auto order_of = [&](uint32_t position) { return list.edits[slots[ids[position].index].row].order; };
    const auto between = [&] {
        return sdf::order_between(before < ids.size() ? order_of(before) : 0,
                                  after < ids.size() ? order_of(after) : UINT64_MAX);
    };
    if (const uint64_t order = between()) return order;
    // Room again, by numbering the whole list.
    std::vector<uint32_t> rows(ids.size());
    for (size_t i = 0; i < rows.size(); ++i) rows[i] = slots[ids[i].index].row;
    list.number_anew(rows);
    {
        const std::lock_guard lock(mutex);
        program.reset();
        asked.reset();
    }
    return between();
}

void World::Impl::move_position(uint32_t from, uint32_t to) {
    const auto turn = [&](auto& list_of) {
        const auto begin = list_of.begin();
        if (from < to)
            std::rotate(begin + from, begin + from + 1, begin + to);
        else
            std::rotate(begin + to, begin + from, begin + from + 1);
    };
    turn(data.edits);
    turn(data.edit_places);
    turn(ids);
    for (uint32_t i = std::min(from, to); i < std::min<uint32_t>(std::max(from, to) + 1, uint32_t(ids.size())); ++i) {
        slots[ids[i].index].position = i;
        names[data.edits[i].name] = i;
    }
}

}  // namespace kiln

// SPDX-License-Identifier: MIT
// World: changes, each an exchange of what it holds with what the world has; the history that keeps them, and its record in the journal.

#include "scene/world_impl.h"

#include "scene/json_source.h"

#include "base/assert.h"
#include "base/format.h"

#include <algorithm>
#include <utility>

namespace kiln {

using scene::Change;
using scene::CommandKind;
using scene::EditList;
using scene::SceneData;
using What = Change::What;

namespace {

/// Rows of changed edits stay in the program as long as it lives; when there are so many more than edits, it is compiled anew.
constexpr size_t kMostOldRows = 65536;

bool uses_material(const Node& node, uint32_t material) { return node.material && node.material.index == material; }
bool uses_object(const Node& node, uint32_t object) {
    return node.kind == Node::Kind::Object && node.object.index == object;
}

Error in_use(const std::string& name) {
    return {name + ": still in use, or others came after it; take those away first", ErrorKind::Usage};
}

}  // namespace

Result<void> World::Impl::exchange_edit(Change& change) {
    uint32_t removed = field::kNoRow, inserted = field::kNoRow;
    const auto compile = [&](const Edit& edit, uint64_t order) -> Result<void> {
        const auto row = compile_edit(edit, order, change.id.index);
        if (!row) return row.error();
        inserted = *row;
        return {};
    };
    const uint32_t slot = edits.find(change.id);
    Edit* const held = change.get<Edit>();
    if (change.what == What::Presence && held != nullptr) {
        const uint32_t before = change.before ? edits.find(change.before) : EditList::kNone;
        if (!compile_later)
            if (auto done = compile(*held, order_before(before)); !done) return done;
        edits.insert(change.id, std::get<std::unique_ptr<Edit>>(std::exchange(change.held, {})), before, change.place);
        generations.resize_pages(change.id.index / generations.kPageSize + 1);
        if (generations[change.id.index] != change.id.generation)
            generations.write(change.id.index) = change.id.generation;
        edits.set_row(change.id.index, inserted);
    } else if (change.what == What::Presence) {
        removed = edits[slot].row;
        change.before = edits.id(edits[slot].next);
        change.place = edits[slot].place;
        change.held = edits.erase(slot);
    } else if (change.what == What::Content) {
        removed = edits[slot].row;
        if (!compile_later)
            if (auto done = compile(*held, list.edits[removed].order); !done) return done;
        change.held = edits.exchange(slot, std::get<std::unique_ptr<Edit>>(std::move(change.held)));
        edits.set_row(slot, inserted);
    } else {
        removed = edits[slot].row;
        const uint32_t before = change.before ? edits.find(change.before) : EditList::kNone;
        if (!compile_later)
            if (auto done = compile(*edits[slot].edit, order_before(before, slot)); !done) return done;
        change.before = edits.id(edits[slot].next);
        edits.move(slot, before);
        edits.set_row(slot, inserted);
    }
    if (compile_later) return {};
    if (removed != field::kNoRow) list.remove(removed);
    changed_since_frame(change.id.index, change.what == What::Order ? edits[slot].edit.get() : change.get<Edit>(),
                        removed, inserted);
    row_changed(removed, inserted);
    mover_changed(change.id.index, removed, inserted);
    if (list.edits.size() > 4 * size_t(edits.size()) + kMostOldRows) return compile_all();
    return {};
}

Result<void> World::Impl::exchange_material(Change& change) {
    auto* const held = change.get<std::pair<std::string, Material>>();
    const uint32_t number = change.id.index;
    if (held == nullptr) {
        bool used = number + 1 != data.materials.size();
        edits.each([&](uint32_t slot) { used = used || uses_material(edits[slot].edit->node, number); });
        for (const Object& object : data.objects)
            for (const Node& node : object.nodes) used = used || uses_material(node, number);
        if (used) return in_use(data.materials[number].first);
        data.material_numbers.erase(data.materials[number].first);
        change.held = std::make_unique<std::pair<std::string, Material>>(std::move(data.materials[number]));
        data.materials.pop_back();
    } else if (number == data.materials.size()) {
        data.material_numbers.emplace(held->first, number);
        data.materials.push_back(std::move(*held));
        change.held = {};
    } else {
        std::swap(data.materials[number].second, held->second);
        // What light now goes through, or no longer does, stands apart, or no longer does.
        const bool through = data.materials[number].second.opacity < 1;
        if (!compile_later && through != (held->second.opacity < 1)) apart_anew();
    }
    return {};
}

void World::Impl::apart_anew() {
    find_movers();
    const std::lock_guard lock(mutex);
    program.reset();
    all.reset();
    asked.reset();
}

// Files are read again only where they, or what they are painted with, may be others.
Result<void> World::Impl::exchange_meshes(Change& change) {
    std::vector<scene::SceneMesh>& held = *change.get<std::vector<scene::SceneMesh>>();
    std::swap(data.meshes, held);
    if (compile_later) return {};
    const bool same =
        std::equal(held.begin(), held.end(), data.meshes.begin(), data.meshes.end(),
                   [](const auto& a, const auto& b) { return a.file == b.file && a.material == b.material; });
    if (!same) meshes = scene::load_meshes(data);
    return {};
}

Result<void> World::Impl::exchange_object(Change& change) {
    const uint32_t number = change.id.index;
    if (Object* const held = change.get<Object>()) {
        data.object_numbers.emplace(held->name, number);
        data.objects.push_back(std::move(*held));
        Edit placed;
        placed.node.kind = Node::Kind::Object;
        placed.node.object = {number, 0};
        if (auto fault = compile_later ? std::nullopt : object_fault(placed)) {
            *held = std::move(data.objects.back());
            data.objects.pop_back();
            data.object_numbers.erase(held->name);
            return std::move(*fault);
        }
        change.held = {};
        return {};
    }
    bool used = number + 1 != data.objects.size();
    edits.each([&](uint32_t slot) { used = used || uses_object(edits[slot].edit->node, number); });
    if (used) return in_use(data.objects[number].name);
    data.object_numbers.erase(data.objects[number].name);
    change.held = std::make_unique<Object>(std::move(data.objects[number]));
    data.objects.pop_back();
    return {};
}

Result<void> World::Impl::exchange(World& world, Change& change) {
    const auto with_stage = [&](auto& now, auto& recorded) {
        std::swap(now, *change.get<std::remove_reference_t<decltype(now)>>());
        recorded = now;
        return Result<void>();
    };
    SceneData& d = data;
    switch (change.what) {
    case What::Presence:
    case What::Content:
    case What::Order:
        return exchange_edit(change);
    case What::Meshes:
        return exchange_meshes(change);
    case What::Bodies:
        std::swap(d.bodies, *change.get<std::vector<scene::SceneBody>>());
        if (!compile_later) apart_anew();
        return {};
    case What::Characters:
        std::swap(d.characters, *change.get<std::vector<scene::SceneCharacter>>());
        return {};
    case What::Material:
        return exchange_material(change);
    case What::Object:
        return exchange_object(change);
    case What::Field:
        return with_stage(world.field_settings, log->stage.field);
    case What::Lights:
        return with_stage(world.lights, log->stage.lights);
    case What::Environment:
        return with_stage(world.environment, log->stage.environment);
    case What::Cameras:
        return with_stage(world.cameras, log->stage.cameras);
    }
    return {};
}

void World::Impl::take_back(World& world, Change& change) {
    const auto done = exchange(world, change);
    KILN_ASSERT(bool(done), "what was there a moment ago cannot come back: {}", done ? "" : done.error().message);
}

std::string World::Impl::command_of(const World& world, const Change& change) const {
    scene::CommandView view{CommandKind::Add};
    const uint32_t slot = edits.find(change.id);
    const auto next_name = [&]() -> std::string_view {
        const uint32_t next = edits[slot].next;
        return next == EditList::kNone ? std::string_view() : edits[next].edit->name;
    };
    const Edit* const held = change.get<Edit>();
    switch (change.what) {
    case What::Presence:
        if (held != nullptr) {
            view = {.kind = CommandKind::Remove, .id = held->name};
        } else {
            view = {.kind = CommandKind::Add, .before = next_name(), .edit = edits[slot].edit.get()};
        }
        break;
    case What::Content:
        view = {.kind = CommandKind::Change, .id = held->name, .edit = edits[slot].edit.get()};
        break;
    case What::Order:
        view = {.kind = CommandKind::Reorder, .id = edits[slot].edit->name, .before = next_name()};
        break;
    case What::Material:
        if (change.id.index < data.materials.size()) {
            const auto& [name, material] = data.materials[change.id.index];
            view = {.kind = CommandKind::Material, .id = name, .material = &material};
        } else {
            view = {.kind = CommandKind::Material, .id = change.get<std::pair<std::string, Material>>()->first};
        }
        break;
    case What::Object:
        if (change.id.index < data.objects.size()) {
            const Object& object = data.objects[change.id.index];
            view = {.kind = CommandKind::Object, .id = object.name, .object = &object};
        } else {
            view = {.kind = CommandKind::Object, .id = change.get<Object>()->name};
        }
        break;
    case What::Meshes:
        view.kind = CommandKind::Meshes;
        break;
    case What::Bodies:
        view.kind = CommandKind::Bodies;
        break;
    case What::Characters:
        view.kind = CommandKind::Characters;
        break;
    case What::Field:
        view.kind = CommandKind::Field;
        break;
    case What::Lights:
        view.kind = CommandKind::Lights;
        break;
    case What::Environment:
        view.kind = CommandKind::Environment;
        break;
    case What::Cameras:
        view.kind = CommandKind::Cameras;
        break;
    }
    return scene::write_command(data, {world.field_settings, world.lights, world.environment, world.cameras}, view);
}

Result<void> World::Impl::journal_change(const World& world, const Change& change, uint32_t& sequence) {
    sequence = scene::Log::kNoSequence;
    if (!journal) return {};
    const std::string command = command_of(world, change);
    // What code assigned has not been checked by anyone yet, and the journal must be readable.
    if (change.what >= What::Field)
        if (auto read = scene::read_command(command, command.substr(2, command.find('"', 2) - 2), names()); !read)
            return Error{read.error().message, ErrorKind::Usage};
    if (log->depth > 0 && log->open_sequence == scene::Log::kNoSequence) {
        const uint32_t begin = journal->file.next_sequence();
        if (auto written = journal->file.append(scene::begin_record(log->title)); !written) return written;
        log->open_sequence = begin;
    }
    const uint32_t own = journal->file.next_sequence();
    if (auto written = journal->file.append(command); !written) return written;
    sequence = own;
    return {};
}

Result<void> World::Impl::record_stage(const World& world) {
    if (!log) return {};
    const auto record = [&](What what, const auto& now, auto& recorded) -> Result<void> {
        if (now == recorded) return {};
        using Part = std::remove_reference_t<decltype(recorded)>;
        Change change{.what = what, .held = std::make_unique<Part>(recorded)};
        uint32_t sequence = 0;
        if (auto written = journal_change(world, change, sequence); !written) return written;
        recorded = now;
        log->push(std::move(change), sequence);
        return {};
    };
    scene::SceneData::Stage& was = log->stage;
    if (auto done = record(What::Field, world.field_settings, was.field); !done) return done;
    if (auto done = record(What::Lights, world.lights, was.lights); !done) return done;
    if (auto done = record(What::Environment, world.environment, was.environment); !done) return done;
    return record(What::Cameras, world.cameras, was.cameras);
}

Result<void> World::Impl::make(World& world, Change change) {
    if (auto recorded = record_stage(world); !recorded) return recorded;
    if (auto done = exchange(world, change); !done) return done;
    if (!log) return {};
    uint32_t sequence = 0;
    if (auto written = journal_change(world, change, sequence); !written) {
        take_back(world, change);
        return written;
    }
    log->push(std::move(change), sequence);
    return {};
}

Result<void> World::Impl::go_to(World& world, uint32_t target) {
    if (log->depth > 0) return Error{"history: a group of changes is open; end it first", ErrorKind::Usage};
    if (auto recorded = record_stage(world); !recorded) return recorded;
    if (target >= log->steps.size())
        return Error{formatted("history: there is no step {}; the last is {}", target, log->steps.size() - 1),
                     ErrorKind::Usage};
    std::vector<scene::Log::Step>& steps = log->steps;
    const uint32_t from = log->now, meeting = log->meeting(from, target);
    const bool tell = journal && steps[target].sequence == scene::Log::kNoSequence;
    std::vector<uint32_t> exchanged;  // numbers of changes
    std::vector<std::string> commands;
    Result<void> done;
    const auto one = [&](uint32_t number) {
        done = exchange(world, log->changes[number]);
        if (!done) return;
        exchanged.push_back(number);
        if (tell) commands.push_back(command_of(world, log->changes[number]));
    };
    for (uint32_t s = from; s != meeting && done; s = steps[s].parent)
        for (uint32_t k = steps[s].count; k-- > 0 && done;) one(steps[s].first + k);
    std::vector<uint32_t> down;
    for (uint32_t s = target; s != meeting; s = steps[s].parent) down.push_back(s);
    for (auto s = down.rbegin(); s != down.rend() && done; ++s)
        for (uint32_t k = 0; k < steps[*s].count && done; ++k) one(steps[*s].first + k);
    if (done && journal && from != target) {
        const uint32_t own = journal->file.next_sequence();
        done = journal->file.append(tell ? scene::step_record(target < from ? "undo" : "redo", commands)
                                         : scene::go_record(steps[target].sequence));
        if (done && tell) steps[target].sequence = own;
    }
    if (!done) {
        for (auto number = exchanged.rbegin(); number != exchanged.rend(); ++number)
            take_back(world, log->changes[*number]);
        return done;
    }
    for (uint32_t s = from; s != meeting; s = steps[s].parent) steps[steps[s].parent].redo = s;
    for (const uint32_t s : down) steps[steps[s].parent].redo = s;
    log->now = target;
    return {};
}

Result<void> World::Impl::end_group(World& world) {
    if (log->depth == 0) return Error{"history: no group of changes is open; begin one first", ErrorKind::Usage};
    if (auto recorded = record_stage(world); !recorded) return recorded;
    if (log->depth > 1) {
        --log->depth;
        return {};
    }
    const uint32_t sequence = log->open_sequence;
    if (journal && sequence != scene::Log::kNoSequence)
        if (auto written = journal->file.append(scene::kEndRecord); !written) return written;
    log->depth = 0;
    log->close(sequence);
    return {};
}

Result<void> World::Impl::cancel_group(World& world) {
    if (log->depth == 0) return Error{"history: no group of changes is open; begin one first", ErrorKind::Usage};
    if (auto recorded = record_stage(world); !recorded) return recorded;
    std::vector<Change>& made = log->changes;
    const size_t first = log->closed();
    for (size_t i = made.size(); i-- > first;) take_back(world, made[i]);
    if (journal && log->open_sequence != scene::Log::kNoSequence) {
        if (auto written = journal->file.append(scene::kCancelRecord); !written) {
            for (size_t i = first; i < made.size(); ++i) take_back(world, made[i]);
            return written;
        }
    }
    made.resize(first);
    log->depth = 0;
    log->close(scene::Log::kNoSequence);
    return {};
}

void World::Impl::keep_log(const World& world) {
    if (log) return;
    log = std::make_unique<scene::Log>();
    log->stage = {world.field_settings, world.lights, world.environment, world.cameras};
}

scene::CommandNames World::Impl::names() const {
    return {data.material_numbers, data.object_numbers,
            [this](std::string_view name) -> const Edit* {
                const uint32_t slot = edits.find(name);
                return slot == EditList::kNone ? nullptr : edits[slot].edit.get();
            },
            &data};
}

// What was there stands where it stood in the file.
template <typename T>
Result<void> World::Impl::make_section(World& world, What what, std::vector<T> items, const std::vector<T>& had) {
    std::unordered_map<std::string_view, scene::JsonIndex> places;
    for (const T& item : had) places.emplace(item.id, item.place);
    for (T& item : items) {
        const auto was = places.find(item.id);
        item.place = was == places.end() ? SceneData::kNowhere : was->second;
    }
    return make(world, Change{.what = what, .held = std::make_unique<std::vector<T>>(std::move(items))});
}

// Names have been looked up by the reader.
Result<void> World::Impl::apply(World& world, scene::Command command) {
    const auto id = [&](const std::string& name) {
        return name.empty() ? EditId{} : edits.id(edits.find(std::string_view(name)));
    };
    const auto number_of = [](const scene::NameNumbers& numbers, const std::string& name) {
        const auto found = numbers.find(name);
        return found == numbers.end() ? UINT32_MAX : found->second;
    };
    switch (command.kind) {
    case CommandKind::Add: {
        auto added = world.insert(std::move(*command.edit), id(command.before));
        return added ? Result<void>() : Result<void>(added.error());
    }
    case CommandKind::Change:
        return world.change(id(command.id), std::move(*command.edit));
    case CommandKind::Remove:
        return world.remove(id(command.id));
    case CommandKind::Reorder:
        return world.reorder(id(command.id), id(command.before));
    case CommandKind::Material: {
        const uint32_t number = number_of(data.material_numbers, command.id);
        if (!command.material && number == UINT32_MAX)
            return Error{command.id + ": there is no such material to take away", ErrorKind::Usage};
        Change change{.what = What::Material,
                      .id = {number == UINT32_MAX ? uint32_t(data.materials.size()) : number, 0}};
        if (command.material) {
            scene::make_canonical(*command.material);
            change.held = std::make_unique<std::pair<std::string, Material>>(command.id, *command.material);
        }
        return make(world, std::move(change));
    }
    case CommandKind::Object: {
        if (command.object) {
            auto added = world.add_object(std::move(*command.object));
            return added ? Result<void>() : Result<void>(added.error());
        }
        const uint32_t number = number_of(data.object_numbers, command.id);
        if (number == UINT32_MAX) return Error{command.id + ": there is no such object to take away", ErrorKind::Usage};
        return make(world, Change{.what = What::Object, .id = {number, 0}});
    }
    case CommandKind::Field:
        world.field_settings = command.stage.field;
        break;
    case CommandKind::Lights:
        world.lights = std::move(command.stage.lights);
        break;
    case CommandKind::Environment:
        world.environment = std::move(command.stage.environment);
        break;
    case CommandKind::Cameras:
        world.cameras = std::move(command.stage.cameras);
        break;
    case CommandKind::Meshes:
        return make_section(world, What::Meshes, std::move(command.meshes), data.meshes);
    case CommandKind::Bodies:
        return make_section(world, What::Bodies, std::move(command.bodies), data.bodies);
    case CommandKind::Characters:
        return make_section(world, What::Characters, std::move(command.characters), data.characters);
    }
    return record_stage(world);
}

// ---- the public handle

History World::history() {
    impl_->keep_log(*this);
    return History(*this);
}

uint32_t History::now() const { return world_.impl_->log->now; }

std::vector<HistoryStep> History::steps() const { return world_.impl_->steps(); }

Result<bool> History::undo() {
    World::Impl& m = *world_.impl_;
    if (auto recorded = m.record_stage(world_); !recorded) return recorded.error();
    if (m.log->now == scene::Log::kBeginning) return false;
    if (auto gone = m.go_to(world_, m.log->steps[m.log->now].parent); !gone) return gone.error();
    return true;
}

Result<bool> History::redo() {
    World::Impl& m = *world_.impl_;
    if (auto recorded = m.record_stage(world_); !recorded) return recorded.error();
    const uint32_t next = m.log->steps[m.log->now].redo;
    if (next == 0) return false;
    if (auto gone = m.go_to(world_, next); !gone) return gone.error();
    return true;
}

Result<void> History::go_to(uint32_t step) { return world_.impl_->go_to(world_, step); }

void History::begin_group(std::string title) {
    scene::Log& log = *world_.impl_->log;
    // What was assigned before belongs to the step before; where it cannot be written now, the next change will say so.
    if (log.depth == 0) (void)world_.impl_->record_stage(world_);
    for (char& c : title)
        if (!scene::is_utf8(title) && uint8_t(c) >= 0x80) c = '?';
    if (log.depth++ == 0) log.title = std::move(title);
}

Result<void> History::end_group() { return world_.impl_->end_group(world_); }
Result<void> History::cancel_group() { return world_.impl_->cancel_group(world_); }
Result<void> History::record() { return world_.impl_->record_stage(world_); }

Result<void> History::forget() {
    World::Impl& m = *world_.impl_;
    if (m.log->depth > 0) return Error{"history: a group of changes is open; end it first", ErrorKind::Usage};
    if (auto recorded = m.record_stage(world_); !recorded) return recorded;
    // The state of now keeps its name in the journal.
    const uint32_t sequence = m.log->steps[m.log->now].sequence;
    m.log.reset();
    m.keep_log(world_);
    m.log->steps[0].sequence = sequence;
    m.let_old_rows_go();
    return {};
}

}  // namespace kiln

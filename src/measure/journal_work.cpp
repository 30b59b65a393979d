// SPDX-License-Identifier: MIT

#include "measure/journal_work.h"

#include "base/hash.h"

#include <kiln/world.h>

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

namespace kiln {

namespace fs = std::filesystem;

struct JournalWork::Impl {
    std::vector<Edit> edits;
    float voxel_size;
    std::string folder;
    std::optional<World> world{};
    std::vector<EditId> ids{};

    std::string scene() const { return folder + "/s.kiln.json"; }
};

JournalWork::JournalWork(std::vector<Edit> edits, float voxel_size)
    : impl_(std::make_unique<Impl>(Impl{std::move(edits), voxel_size, {}})) {
    std::string name = (fs::temp_directory_path() / "kiln-bench-XXXXXX").string();
    if (::mkdtemp(name.data()) != nullptr) impl_->folder = name;
}

JournalWork::~JournalWork() {
    impl_->world.reset();
    std::error_code failed;
    if (!impl_->folder.empty()) fs::remove_all(impl_->folder, failed);
}

Result<void> JournalWork::prepare(bool journaled) {
    impl_->world.reset();
    World made;
    made.field_settings.voxel_size = impl_->voxel_size;
    made.field_settings.bounds = Box3{{-1, -1, -1}, {1, 1, 1}};
    for (const Edit& edit : impl_->edits)
        if (auto added = made.add(edit); !added) return added.error();
    if (journaled) {
        std::error_code failed;
        fs::remove(impl_->scene() + ".journal", failed);
        if (auto saved = made.save(impl_->scene()); !saved) return saved;
        auto opened = World::open(impl_->scene());
        if (!opened) return opened.error();
        impl_->world.emplace(std::move(*opened));
    } else {
        impl_->world.emplace(std::move(made));
    }
    (void)impl_->world->history();
    impl_->ids = impl_->world->edits();
    return {};
}

Result<void> JournalWork::change(uint32_t commands) {
    World& world = *impl_->world;
    EditId added;
    for (uint32_t i = 0; i < commands; ++i) {
        const size_t at = (size_t(i) * 7919) % impl_->ids.size();
        Result<void> done;
        if (i % 4 == 0) {
            auto id = world.add(impl_->edits[at]);
            if (!id) return id.error();
            added = *id;
        } else if (i % 4 == 3) {
            done = world.remove(added);
        } else {
            Edit edit = *world.find(impl_->ids[at]);
            edit.node.transform.position.x += i % 8 < 4 ? 0.001f : -0.001f;
            done = world.change(impl_->ids[at], std::move(edit));
        }
        if (!done) return done;
    }
    return {};
}

Result<uint64_t> JournalWork::reopen() const {
    const auto world = World::load(impl_->scene());
    if (!world) return world.error();
    return hash64(world->to_json());
}

uint64_t JournalWork::hash() const { return hash64(impl_->world->to_json()); }

Result<void> JournalWork::edit(uint32_t i) {
    World& world = *impl_->world;
    const EditId id = impl_->ids[(size_t(i) * 7919) % impl_->ids.size()];
    Edit moved = *world.find(id);
    moved.node.transform.position.y += 0.01f;
    if (auto changed = world.change(id, std::move(moved)); !changed) return changed;
    const auto frame = world.frame();
    return frame ? Result<void>() : Result<void>(frame.error());
}

Result<void> JournalWork::undo() {
    if (auto undone = impl_->world->history().undo(); !undone) return undone.error();
    const auto frame = impl_->world->frame();
    return frame ? Result<void>() : Result<void>(frame.error());
}

}  // namespace kiln

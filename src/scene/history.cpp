// SPDX-License-Identifier: MIT

#include "scene/history.h"

#include <algorithm>

namespace kiln::scene {

void Log::push(Change change, uint32_t sequence) {
    if (depth == 0) {
        changes.push_back(std::move(change));
        return close(sequence);
    }
    if (open_changes() > 0 && change.what == Change::What::Content && changes.back().what == Change::What::Content &&
        changes.back().id == change.id)
        return;  // the older content is kept already
    changes.push_back(std::move(change));
}

void Log::close(uint32_t sequence) {
    const uint32_t count = open_changes();
    if (count > 0) {
        const auto step = uint32_t(steps.size());
        steps.push_back({now, 0, closed(), count, sequence});
        steps[now].redo = step;
        if (!title.empty()) titles.emplace(step, std::move(title));
        now = step;
    }
    title.clear();
    open_sequence = kNoSequence;
}

// A parent's number is below its children's.
uint32_t Log::meeting(uint32_t a, uint32_t b) const {
    while (a != b) (a > b ? a : b) = steps[std::max(a, b)].parent;
    return a;
}

void Log::lose_sequences() {
    for (Step& step : steps) step.sequence = kNoSequence;
}

void Log::lose_places() {
    const auto of = [](auto* list) {
        if (list != nullptr)
            for (auto& item : *list) item.place = SceneData::kNowhere;
    };
    for (Change& change : changes) {
        change.place = SceneData::kNowhere;
        of(change.get<std::vector<SceneMesh>>());
        of(change.get<std::vector<SceneBody>>());
        of(change.get<std::vector<SceneCharacter>>());
    }
}

}  // namespace kiln::scene

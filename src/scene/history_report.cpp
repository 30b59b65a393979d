// SPDX-License-Identifier: MIT
// The history in words: its steps, and what a journal held.

#include "scene/world_impl.h"

#include "base/format.h"

#include <nlohmann/json.hpp>

namespace kiln {

namespace {

using scene::Change;
using What = Change::What;

// Of a change whose step is in the world now, or is not.
std::string words_of(const World::Impl& m, const Change& change, bool done) {
    const Edit* const held = change.get<Edit>();
    const uint32_t slot = m.edits.find(change.id);
    // Branches that are not in the world may name what came and went: then there is only the number.
    const std::string name = change.what == What::Presence && held != nullptr ? held->name
                             : slot != scene::EditList::kNone                 ? m.edits[slot].edit->name
                             : held != nullptr                                ? held->name
                                                                              : formatted("#{}", change.id.index);
    switch (change.what) {
    case What::Presence:
        return ((held == nullptr) == done ? "add " : "remove ") + name;
    case What::Content:
        return "change " + name;
    case What::Order:
        return "reorder " + name;
    case What::Material:
        if (change.id.index < m.data.materials.size()) return "material " + m.data.materials[change.id.index].first;
        if (const auto* const away = change.get<std::pair<std::string, Material>>()) return "material " + away->first;
        return formatted("material #{}", change.id.index);
    case What::Object:
        if (change.id.index < m.data.objects.size()) return "object " + m.data.objects[change.id.index].name;
        if (const Object* const away = change.get<Object>()) return "object " + away->name;
        return formatted("object #{}", change.id.index);
    case What::Meshes:
        return "meshes";
    case What::Bodies:
        return "bodies";
    case What::Characters:
        return "characters";
    case What::Field:
        return "field";
    case What::Lights:
        return "lights";
    case What::Environment:
        return "environment";
    case What::Cameras:
        return "cameras";
    }
    return {};
}

std::vector<bool> done_steps(const scene::Log& log) {
    std::vector<bool> done(log.steps.size(), false);
    for (uint32_t s = log.now;; s = log.steps[s].parent) {
        done[s] = true;
        if (s == scene::Log::kBeginning) return done;
    }
}

}  // namespace

std::vector<HistoryStep> World::Impl::steps() const {
    std::vector<HistoryStep> out;
    const std::vector<bool> done = done_steps(*log);
    for (uint32_t s = 1; s < log->steps.size(); ++s) {
        const scene::Log::Step& step = log->steps[s];
        const auto title = log->titles.find(s);
        out.push_back({s, step.parent,
                       title != log->titles.end() ? title->second : words_of(*this, log->changes[step.first], done[s]),
                       step.count, done[s]});
    }
    return out;
}

std::string World::history_json() const {
    using Json = nlohmann::ordered_json;
    Json out;
    const Impl& m = *impl_;
    out["journal"] = nullptr;
    if (m.report) {
        const JournalReport& r = *m.report;
        out["journal"] = {{"file", r.file},
                          {"commands", r.commands},
                          {"dropped_bytes", r.dropped_bytes},
                          {"reason", r.reason},
                          {"foreign", r.foreign}};
    }
    out["now"] = m.log ? m.log->now : 0;
    Json steps = Json::array();
    if (m.log) {
        const std::vector<bool> done = done_steps(*m.log);
        for (const HistoryStep& step : m.steps()) {
            Json changes = Json::array();
            const scene::Log::Step& s = m.log->steps[step.number];
            for (uint32_t i = 0; i < s.count; ++i)
                changes.push_back(words_of(m, m.log->changes[s.first + i], done[step.number]));
            steps.push_back({{"step", step.number},
                             {"parent", step.parent},
                             {"title", step.title},
                             {"done", step.done},
                             {"changes", changes}});
        }
    }
    out["steps"] = steps;
    return out.dump(2) + "\n";
}

}  // namespace kiln

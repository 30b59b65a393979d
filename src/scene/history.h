// SPDX-License-Identifier: MIT
// What a world remembers of its changes. A Change holds the state that its thing does not have now: exchanging it with the world undoes
// the change, exchanging it again redoes it, so each costs what the change cost and nothing is kept twice. Steps (a change, or a group of
// them) are a tree: after an undo a new change begins another branch, and what was undone can still be reached.
#pragma once

#include "scene/edit_list.h"
#include "scene/scene_file.h"

#include <kiln/world.h>

#include <memory>
#include <string>
#include <unordered_map>
#include <utility>
#include <variant>
#include <vector>

namespace kiln::scene {

struct Change {
    enum class What : uint8_t {
        Presence,
        Content,
        Order,
        Material,
        Object,
        Meshes,
        Bodies,
        Characters,
        Field,
        Lights,
        Environment,
        Cameras
    };
    using Cameras = std::vector<std::pair<std::string, Camera>>;
    /// Nothing: the thing is there now and would be away, or (Order) has no content of its own.
    using Held = std::variant<std::monostate, std::unique_ptr<Edit>, std::unique_ptr<std::pair<std::string, Material>>,
                              std::unique_ptr<Object>, std::unique_ptr<FieldSettings>,
                              std::unique_ptr<std::vector<Light>>, std::unique_ptr<std::optional<Environment>>,
                              std::unique_ptr<Cameras>, std::unique_ptr<std::vector<SceneMesh>>,
                              std::unique_ptr<std::vector<SceneBody>>, std::unique_ptr<std::vector<SceneCharacter>>>;

    What what = What::Presence;
    JsonIndex place = SceneData::kNowhere;  ///< of an edit that is away
    EditId id{};                            ///< Material, Object: the number in it is theirs
    EditId before{};                        ///< of an edit that is away, or Order: what it would stand before
    Held held{};

    template <typename T>
    T* get() const {
        const auto* const p = std::get_if<std::unique_ptr<T>>(&held);
        return p != nullptr ? p->get() : nullptr;
    }
};

class Log {
public:
    static constexpr uint32_t kBeginning = 0, kNoSequence = UINT32_MAX;

    struct Step {
        uint32_t parent = 0;
        uint32_t redo = 0;                ///< the child that was last left or made; 0: none
        uint32_t first = 0, count = 0;    ///< its changes
        uint32_t sequence = kNoSequence;  ///< by which the journal knows the state after it
    };

    std::vector<Step> steps{Step{}};
    std::vector<Change> changes;  ///< of the steps one after another, then of the open group
    std::unordered_map<uint32_t, std::string> titles;
    uint32_t now = kBeginning;
    SceneData::Stage stage;  ///< as it was last recorded

    // The open group.
    int depth = 0;
    std::string title;
    uint32_t open_sequence = kNoSequence;  ///< of its beginning in the journal, once it has a change

    uint32_t closed() const { return steps.back().first + steps.back().count; }
    uint32_t open_changes() const { return uint32_t(changes.size()) - closed(); }
    /// Takes in a change that the world has made. In a group, changes of one edit's content in a row are one.
    void push(Change change, uint32_t sequence);
    /// Makes the open changes a step.
    void close(uint32_t sequence);
    /// The last step on the way from the beginning to both.
    uint32_t meeting(uint32_t a, uint32_t b) const;
    /// Forgets by which numbers the journal knew steps, or where edits stood in the source.
    void lose_sequences();
    void lose_places();
};

}  // namespace kiln::scene

// SPDX-License-Identifier: MIT
// A world that is played and changed at once. Two worlds, one play:
//   world   what the user has: each dig is a change of it, in its journal and its history
//   base    as it was when the play began, and stays: the play runs on it, and is told the same digs
// So undoing is exact in the world, and a play without what was undone is run again from the base, to where it was.
#pragma once

#include "player/watched_file.h"

#include <kiln/world.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace kiln::player {

class Session {
public:
    /// A file is opened for editing, where its folder lets us; a bundled scene is changed in memory.
    static Result<std::unique_ptr<Session>> open(const std::string& scene, const std::string& backend);

    const World& world() const { return *world_; }
    Play& play() { return *play_; }
    PlayCounts counts() const { return play_->counts(); }
    /// Steps that the play has made.
    int64_t steps() const { return steps_; }
    double time() const { return play_->time(); }
    /// Steps that it has still to make to be where it was before something was undone.
    int64_t behind() const { return wanted_ > steps_ ? wanted_ - steps_ : 0; }

    /// So much time has gone by. What the play is behind is made up for first, for `budget` seconds at most.
    Result<void> advance(double seconds, double budget);
    Result<void> step();

    /// Digs made between the two are one step back.
    void begin_stroke(const std::string& title);
    Result<void> end_stroke();
    bool in_stroke() const { return stroke_.has_value(); }
    /// A ball taken away or put there, in a stroke: of the ground, or of the body of that id. Nothing while the play is behind.
    Result<void> dig(vec3 at, float radius, bool add, const std::string& body = {});
    /// Likewise, without a stroke.
    Result<void> launch(const Edit& edit, vec3 velocity);
    /// Somebody walks (Play::enter), which a play that is run again does too, or does no more. Nothing while the play is behind.
    Result<void> enter(vec3 feet);
    void walk(vec3 velocity, float jump);
    Result<void> leave();
    std::optional<PlayWalker> walker() const { return play_->walker(); }

    /// False when there is none.
    Result<bool> undo();
    Result<bool> redo();
    int undo_depth() const { return int(done_); }
    /// From the start, with what was dug and thrown coming at the times it did no more: the ground is as it was left, all else begins.
    Result<void> restart();
    /// The world becomes what the play has made of it.
    Result<void> keep();

    /// Says where it was written, and where what another program had written there is now.
    Result<std::string> save();
    /// The world has changes that the scene file had not when it was last read or written here.
    bool dirty() const;
    /// Whether another program has written the scene file, or one that the scene names. Without changes of our own the scene is loaded
    /// again and the play begins anew (true). With some, and where it cannot be loaded, all stays as it is and warning() says so, as long
    /// as that holds.
    bool look_at_files();
    /// The file for which look_at_files() last loaded the scene again.
    const std::string& changed() const { return changed_; }
    const std::string& warning() const { return warning_; }
    /// What to tell somebody who leaves; empty when nothing is lost or pending. Changes that the next start would not find, since another
    /// program has written the scene file, are put beside it as a scene.
    std::string farewell();
    /// What opening had to tell.
    const std::string& note() const { return note_; }
    const std::string& file() const { return file_; }
    /// Of the world's text.
    uint64_t world_hash();

private:
    /// What the play was told, and when.
    struct Told {
        enum class What { Command, Launch, Enter, Walk, Leave } what = What::Command;
        int64_t at = 0;      ///< steps made before it
        uint64_t order = 0;  ///< among all of one time
        std::string name{}, command{};
        bool of_world = true;  ///< Command: of the ground, not of a body
        Edit edit{};           ///< Launch
        vec3 vector{};         ///< Launch, Walk: velocity; Enter: feet
        float jump = 0;        ///< Walk
    };
    struct Action {
        enum class Kind { Stroke, Launch, Keep } kind = Kind::Stroke;
        std::vector<Told> told{};        ///< digs of a stroke, or the one of a launch
        int parts_before = 0;            ///< that had come loose
        uint32_t before = 0, after = 0;  ///< steps of the world's history
    };

    Session() = default;
    Result<void> start();
    /// All of it from the scene file anew, with nothing undone to go back to. Fails before anything has changed.
    Result<void> reload();
    void watch_parts();
    bool look_at_parts();
    /// What the world is now is what its scene file has.
    void is_saved() { saved_ = world_->history().now(); }
    /// Takes the digs of a stroke out of the play as it is; false where it cut something loose, or the play will not.
    bool fill_in(const Action& stroke);
    /// Makes an action that was undone again, now.
    Result<void> perform(Action& action);
    /// Runs the play anew with the actions that are done.
    Result<void> run_again(int64_t to);
    Result<void> perform_due();
    Result<void> tell(const Told& told);
    Told now(Told::What what) { return {.what = what, .at = steps_, .order = ++order_}; }
    void add(Action action);

    std::string scene_, file_, backend_, note_, warning_, changed_;
    bool journaled_ = false, own_file_ = false;
    std::optional<WatchedFile> watch_;  // of file_, once it is read or written here
    // Files that the scene names.
    struct Part {
        std::string name;
        WatchedFile watch;
        bool there;                     // when the scene was read
        std::optional<uint64_t> tried;  // hash of what could not be loaded
        std::string fault;              // and why
    };
    std::vector<Part> parts_;
    std::optional<uint64_t> tried_;  // hash of what could not be loaded
    std::unique_ptr<World> world_, base_;
    std::optional<Play> play_;
    std::optional<Action> stroke_;
    std::vector<Action> actions_;
    size_t done_ = 0;                // of actions_
    uint32_t first_ = 0;             // step of the history that the base is
    std::optional<uint32_t> saved_;  // … that the scene file is
    int64_t steps_ = 0, wanted_ = 0;
    std::vector<Told> walks_;  // of who walks, in order
    std::vector<Told> due_;    // that a play which is run again has still to be told, in order
    size_t next_due_ = 0;
    uint64_t order_ = 0;
    vec3 walk_{};
    int named_ = 0;
    std::optional<uint64_t> hash_;
};

}  // namespace kiln::player

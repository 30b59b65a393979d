// SPDX-License-Identifier: MIT
// World: scene files and their journals. Reading one is reading the scene, applying what the journal adds to it, and compiling once.

#include "scene/world_impl.h"

#include "scene/bundled.h"
#include "scene/moved_files.h"

#include "base/assert.h"
#include "base/atomic_file.h"
#include "base/format.h"
#include "base/log.h"
#include "base/parallel_for.h"
#include "base/suggest.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <sys/stat.h>
#include <thread>
#include <utility>

namespace kiln {

using scene::JsonDocument;
using scene::JsonIndex;
using scene::JsonType;

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

constexpr int kMostAttempts = 40;

Hash128 hash_of(std::string_view text) { return hash128(std::as_bytes(std::span(text.data(), text.size()))); }

// An error where a word without a dot or a slash is no file: somebody meant a bundled scene.
Result<void> named(const std::string& path_or_name) {
    struct stat info {};
    if (path_or_name.find_first_of("/.") != std::string::npos || ::stat(path_or_name.c_str(), &info) == 0) return {};
    std::vector<std::string_view> names;
    for (const scene::BundledScene& file : scene::bundled_files()) names.push_back(file.name);
    return Error{formatted("{}: neither a file nor a bundled scene; {}", path_or_name, suggestion(path_or_name, names)),
                 ErrorKind::Input};
}

// A name for what is kept of a journal, that no file has.
std::string side_file(const std::string& journal) {
    struct stat info {};
    std::string name = journal + ".dropped";
    for (int i = 2; ::stat(name.c_str(), &info) == 0; ++i) name = formatted("{}.dropped-{}", journal, i);
    return name;
}

}  // namespace

void discard_unfinished_files() noexcept { AtomicFile::remove_temporaries_from_signal(); }

Result<World> World::load(const std::string& path_or_name, int workers, bool past) {
    if (is_bundled_scene(path_or_name)) {
        const auto files = scene::bundled_files();
        const auto found =
            std::find_if(files.begin(), files.end(), [&](const auto& file) { return file.name == path_or_name; });
        return parse(found->json, path_or_name);
    }
    if (auto there = named(path_or_name); !there) return there.error();
    for (int attempt = 0;; ++attempt) {
        auto text = read_file(path_or_name);
        if (!text) return text.error();
        const auto is_file = [&](const std::string& path) {
            struct stat info {};
            return ::stat(path.c_str(), &info) == 0 && S_ISREG(info.st_mode);
        };
        const std::string journal = scene::journal_path(path_or_name), history = scene::past_path(path_or_name);
        const bool journaled = is_file(path_or_name) && is_file(journal);
        past = past && is_file(path_or_name) && is_file(history);
        if (!journaled && !past) return parse(*text, path_or_name);
        // Before its bytes are read: a writer that comes between the two is not there yet.
        const bool held = journaled && RecordFile::is_held(journal);
        const auto bytes = journaled ? read_file(journal) : Result<std::string>(std::string());
        if (!bytes) return bytes.error();
        const auto before = past ? read_file(history) : Result<std::string>(std::string());
        if (!before) return before.error();
        Records records = read_records(*bytes);
        // Someone who saves this instant has written one of the two files only.
        const bool foreign = scene::find_start(records, hash_of(*text)).foreign;
        if (foreign && held && attempt < kMostAttempts) {
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
            continue;
        }
        bool lived = false;
        World world = Impl::with_past(scene::records_to(*before, hash_of(*text)), *text, path_or_name, workers, lived);
        Impl& m = *world.impl_;
        if (auto read = m.read_journaled(world, std::move(*text), path_or_name, *bytes, records, lived, workers); !read)
            return read.error();
        if (held) {  // what is behind the last record may be one that is being written
            m.report->dropped_bytes = 0;
            m.report->reason.clear();
        }
        if (!m.report->foreign && m.report->commands == 0 && m.report->dropped_bytes == 0) m.report.reset();
        return world;
    }
}

// One record after another, as World::apply() does; steps are those of the world's own log. Those of a past are counted anew from each of
// its parts on, as the journal counted them.
class Replay {
public:
    Replay(World& world, World::Impl& impl, const scene::JournalStart& start, size_t records)
        : world_(world), m_(impl), step_of_(records + 1, kNone) {
        step_of_[start.sequence] = m_.log->now;
    }

    Result<void> one(const JsonDocument& doc, uint32_t place) {
        const uint32_t sequence = place - before_;
        if (!doc.is(0, JsonType::Object) || doc.first(0) == doc.next(0)) return wrong("no record");
        const JsonIndex what = doc.first(0);
        const std::string_view key = doc.key(what);
        scene::Log& log = *m_.log;
        if (key == "begin") {
            if (log.depth != 0) return wrong("a group inside another");
            log.depth = 1;
            log.title = doc.text(what);
            group_ = sequence;
            return {};
        }
        if (key == "end" || key == "cancel") {
            if (log.depth != 1) return wrong("the end of no group");
            return key == "end" ? close() : m_.cancel_group(world_);
        }
        if (key == "step") return step(doc, what, sequence);
        if (key == "go") return go(doc, what);
        if (key == "journal") {
            const double next = doc.is(what, JsonType::Number) ? doc.number(what) : 0;
            if (!(next >= 1 && next <= place) || log.depth != 0) return wrong("no part of a past");
            before_ = place + 1 - uint32_t(next);
            if (next == 1) std::fill(step_of_.begin(), step_of_.end(), kNone);
            step_of_[size_t(next) - 1] = log.now;
            return {};
        }
        if (key == "saved") {
            if (log.depth != 0) return wrong("saved inside a group");
            step_of_[sequence] = log.now;
            return {};
        }
        return command(doc, 0, sequence);
    }

    /// What a kill has left open is a step of what is there of it.
    Result<void> close() {
        if (m_.log->depth == 0) return {};
        const uint32_t before = m_.log->now;
        if (auto ended = m_.end_group(world_); !ended) return ended;
        if (m_.log->now != before) known(group_);
        return {};
    }
    uint64_t commands() const { return commands_; }

private:
    static constexpr uint32_t kNone = UINT32_MAX;
    static Error wrong(const std::string& what) { return {what, ErrorKind::Input}; }

    // The step that was made last is what the journal knows by this number.
    void known(uint32_t sequence) {
        m_.log->steps[m_.log->now].sequence = sequence;
        step_of_[sequence] = m_.log->now;
    }

    Result<void> command(const JsonDocument& doc, JsonIndex at, uint32_t sequence) {
        auto read = scene::read_command(doc, at, names_);
        if (!read) return read.error();
        const uint32_t before = m_.log->now;
        if (auto done = m_.apply(world_, std::move(*read)); !done) return done;
        if (m_.log->now != before) known(sequence);
        ++commands_;
        return {};
    }

    Result<void> step(const JsonDocument& doc, JsonIndex title, uint32_t sequence) {
        const auto commands = doc.find(0, "commands");
        if (!commands || !doc.is(*commands, JsonType::Array) || m_.log->depth != 0) return wrong("no step");
        m_.log->depth = 1;
        m_.log->title = doc.text(title);
        group_ = sequence;
        for (JsonIndex c = doc.first(*commands); c < doc.next(*commands); c = doc.next(c)) {
            if (auto done = command(doc, c, sequence); !done) {
                // A step is whole or not at all.
                if (auto undone = m_.cancel_group(world_); !undone) return undone;
                return done;
            }
        }
        return close();
    }

    Result<void> go(const JsonDocument& doc, JsonIndex at) {
        const double to = doc.is(at, JsonType::Number) ? doc.number(at) : -1;
        if (!(to >= 0 && to < double(step_of_.size()))) return wrong("a way to no step");
        const uint32_t step = step_of_[size_t(to)];
        if (step == kNone) return wrong("a way to no step");
        ++commands_;
        return m_.go_to(world_, step);
    }

    World& world_;
    World::Impl& m_;
    const scene::CommandNames names_ = m_.names();
    std::vector<uint32_t> step_of_;  // by the sequences of records
    uint32_t group_ = 0;
    uint32_t before_ = 0;  // records that the journal does not count
    uint64_t commands_ = 0;
};

size_t World::Impl::replay(World& world, std::span<const std::string_view> records, const scene::JournalStart& start,
                           int workers) {
    keep_log(world);
    log->steps[log->now].sequence = start.sequence;
    compile_later = true;
    const auto adds = std::count_if(records.begin() + ptrdiff_t(start.first), records.end(),
                                    [](std::string_view payload) { return payload.starts_with("{\"add\""); });
    edits.reserve(edits.size() + size_t(adds));
    Replay replay(world, *this, start, records.size());
    // Texts are read side by side, commands one after another.
    constexpr size_t kBatch = 8192;
    std::vector<std::optional<Result<JsonDocument>>> documents(kBatch);
    size_t taken = start.first;
    bool good = true;
    for (size_t first = start.first; first < records.size() && good; first += kBatch) {
        const size_t count = std::min(kBatch, records.size() - first);
        parallel_for(
            count, workers,
            [&](int i) {
                documents[size_t(i)].emplace(
                    JsonDocument::parse(std::string(records[first + size_t(i)]), report->file));
            },
            64);
        for (size_t i = 0; i < count && good; ++i) {
            const Result<JsonDocument>& document = *documents[i];
            Result<void> done =
                document ? replay.one(*document, uint32_t(first + i + 1)) : Result<void>(document.error());
            good = bool(done);
            if (good)
                ++taken;
            else
                report->reason = formatted("record {} cannot be applied: {}", first + i + 1, done.error().message);
        }
    }
    group_left_open = log->depth > 0;
    const auto closed = replay.close();
    KILN_ASSERT(bool(closed), "a group that does not end: {}", closed ? "" : closed.error().message);
    compile_later = false;
    report->commands = replay.commands();
    return taken;
}

bool World::Impl::relive(World& world, const Records& lead, const std::string& text, const std::string& scene,
                         int workers) {
    if (auto done = read(world, std::string(lead.payloads[0]), scene); !done) return false;
    report.emplace().file = scene::past_path(scene);
    const bool whole = replay(world, lead.payloads, {false, 1, 0}, workers) == lead.payloads.size();
    report.reset();
    log->lose_sequences();
    // The writer tells every difference from the text that edits have their places in.
    return whole && stand_on(text, scene) && hash_of(json(world)) == hash_of(text);
}

World World::Impl::with_past(const Records& lead, const std::string& text, const std::string& scene, int workers,
                             bool& lived) {
    World world;
    lived = !lead.payloads.empty() && world.impl_->relive(world, lead, text, scene, workers);
    if (lived || lead.payloads.empty()) return world;
    log::warn("{}: does not lead to the scene; what was before the last save cannot be undone",
              scene::past_path(scene));
    return {};
}

Result<void> World::Impl::read_journaled(World& world, std::string text, const std::string& scene,
                                         std::string_view bytes, Records& records, bool lived, int workers) {
    const scene::JournalStart start = scene::find_start(records, hash_of(text));
    if (!lived)
        if (auto done = read(world, std::move(text), scene); !done) return done;
    report.emplace().file = scene::journal_path(scene);
    // One without a record has nothing to lose, whatever it continues.
    const bool holds_nothing = records.has_header && records.payloads.empty() && records.fault.empty();
    report->foreign = start.foreign && records.has_header && !holds_nothing;
    report->reason = records.fault;
    if (start.foreign) {
        records = {};
    } else {
        const size_t taken = replay(world, records.payloads, start, workers);
        if (taken < records.payloads.size()) {
            const size_t end = size_t(records.payloads[taken].data() - bytes.data()) - kRecordHeaderBytes;
            records = read_records(bytes.substr(0, end));
        }
    }
    report->dropped_bytes = holds_nothing ? 0 : bytes.size() - records.good_bytes;
    if (report->foreign) report->reason = "it continues another scene, or another version of this one";
    return get_ready(world);
}

Result<World> World::open(const std::string& path, int workers) {
    if (auto there = named(path); !there) return there.error();
    auto first = read_file(path);  // whether it is there at all, before a journal is made beside it
    if (!first) return first.error();
    std::string bytes;
    auto file = RecordFile::open(scene::journal_path(path), bytes);
    if (!file) return file.error();
    auto text = read_file(path);  // as it is while nobody else saves it
    if (!text) return text.error();
    const Hash128 hash = hash_of(*text);
    Records records = read_records(bytes);
    std::string past_bytes;
    auto past = scene::Past::open(path, past_bytes);
    if (!past) return past.error();
    const Records lead = scene::records_to(past_bytes, hash);
    const auto next = uint32_t(scene::find_start(records, hash).first + 1);
    bool lived = false;
    World world = Impl::with_past(lead, *text, path, workers, lived);
    Impl& m = *world.impl_;
    if (auto read = m.read_journaled(world, std::move(*text), path, bytes, records, lived, workers); !read)
        return read.error();
    m.keep_log(world);
    JournalReport& report = *m.report;
    const std::string_view dropped = std::string_view(bytes).substr(records.good_bytes);
    if (report.dropped_bytes > 0) {
        report.kept_in = side_file(report.file);
        auto kept = AtomicFile::create(report.kept_in);
        if (!kept) return kept.error();
        if (auto written = kept->write(dropped); !written) return written.error();
        if (auto written = kept->commit(); !written) return written.error();
    }
    if (records.has_header) {
        const bool open_group = !records.payloads.empty() && m.group_left_open;
        if (auto ready = file->resume(records); !ready) return ready.error();
        if (open_group)
            if (auto ended = file->append(scene::kEndRecord); !ended) return ended.error();
    } else if (auto begun = file->restart(hash); !begun) {
        return begun.error();
    } else {
        m.log->steps[m.log->now].sequence = 0;
    }
    m.journal = std::make_unique<scene::Journal>(scene::Journal{path, std::move(*file)});
    if (!lived)
        past->begin(hash, next);
    else if (auto ready = past->resume(lead, hash, next); !ready)
        return ready.error();
    m.past = std::make_unique<scene::Past>(std::move(*past));
    if (report.commands == 0 && report.dropped_bytes == 0) m.report.reset();
    return world;
}

Result<void> World::Impl::compact(const World& world) {
    if (log->depth > 0) return Error{"save: a group of changes is open; end it first", ErrorKind::Usage};
    if (auto recorded = record_stage(world); !recorded) return recorded;
    std::string text = json(world);
    const Hash128 hash = hash_of(text);
    RecordFile& file = journal->file;
    const uint32_t mark = file.next_sequence();
    if (auto written = file.append(scene::saved_record(hash)); !written) return written;
    // From here on the journal knows this state by the mark: it may be read from here.
    log->lose_sequences();
    log->steps[log->now].sequence = mark;
    if (auto written = file.flush(); !written) return written;
    if (auto kept = past->take_in(*journal, hash); !kept) return kept;
    auto out = AtomicFile::create(journal->scene);
    if (!out) return out.error();
    if (auto written = out->write(text); !written) return written;
    if (auto written = out->commit(); !written) return written;
    // The scene file holds all. Where the journal cannot be emptied it goes on behind the mark.
    const bool emptied = bool(file.restart(hash)) || file.bytes() == 0;
    if (emptied) log->steps[log->now].sequence = 0;
    past->saved(hash, emptied ? 1 : mark + 1);
    const bool stands = stand_on(std::move(text), journal->scene);
    KILN_ASSERT(stands, "{} was saved and cannot be read", journal->scene);
    return {};
}

bool World::Impl::stand_on(std::string text, const std::string& scene) {
    auto again = scene::read_scene(std::move(text), scene);
    if (!again || again->edit_places.size() != edits.size() || again->object_places.size() != data.objects.size())
        return false;
    log->lose_places();
    data.source = std::move(again->source);
    data.object_places = std::move(again->object_places);
    const auto stand = [](auto& items, const auto& read) {
        for (size_t k = 0; k < std::min(items.size(), read.size()); ++k) items[k].place = read[k].place;
    };
    stand(data.meshes, again->meshes);
    stand(data.bodies, again->bodies);
    stand(data.triggers, again->triggers);
    stand(data.characters, again->characters);
    size_t i = 0;
    std::vector<uint32_t> slots;
    edits.each([&](uint32_t slot) { slots.push_back(slot); });
    for (const uint32_t slot : slots) edits.set_place(slot, again->edit_places[i++]);
    return true;
}

namespace {

// Models that a bundled scene has in the program, beside the file that it becomes.
Result<void> bring_models(const scene::SceneData& data, const std::string& folder) {
    for (const auto& mesh : data.meshes) {
        const auto bytes = scene::bundled_model(data, mesh.file);
        if (bytes.empty()) continue;
        const std::string_view model{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
        const std::string path = folder + mesh.file;
        if (std::ifstream there{path, std::ios::binary}) {
            if (std::string{std::istreambuf_iterator<char>(there), {}} == model) continue;
            return Error{path + ": another file is there, where the scene's model belongs; move it away",
                         ErrorKind::Failed};
        }
        auto file = AtomicFile::create(path);
        if (!file) return file.error();
        if (auto done = file->write(model); !done) return done;
        if (auto done = file->commit(); !done) return done;
    }
    return {};
}

}  // namespace

Result<void> World::save(const std::string& path) const {
    if (impl_->journal && scene::same_file(path, impl_->journal->scene)) return impl_->compact(*this);
    const std::string journal = scene::journal_path(path);
    if (RecordFile::is_held(journal))
        return Error{journal + ": held by a program that edits this scene; close it there first", ErrorKind::Failed};
    const std::string folder = path.substr(0, path.find_last_of('/') + 1);
    const bool bundled = scene::is_bundled(impl_->data);
    if (bundled)
        if (auto done = bring_models(impl_->data, folder); !done) return done;
    auto file = AtomicFile::create(path);
    if (!file) return file.error();
    if (auto done = file->write(scene::with_files_from(to_json(), bundled ? folder : impl_->data.folder, folder));
        !done)
        return done;
    return file->commit();
}

Result<void> World::flush() const {
    if (!impl_->journal) return {};
    if (auto recorded = impl_->record_stage(*this); !recorded) return recorded;
    return impl_->journal->file.flush();
}

std::vector<std::string> World::files() const {
    if (scene::is_bundled(impl_->data)) return {};
    std::vector<std::string> out = scene::files_named(to_json(), impl_->data.folder);
    if (!impl_->data.source.empty()) out.emplace_back(impl_->data.source.name());
    std::ranges::sort(out);
    out.erase(std::unique(out.begin(), out.end()), out.end());
    return out;
}

bool World::is_read_from(const std::string& file) const {
    struct stat info {};
    if (::stat(file.c_str(), &info) != 0) return false;
    return std::ranges::any_of(files(), [&](const std::string& read) { return scene::same_file(read, file); });
}

std::optional<JournalReport> World::journal_report() const { return impl_->report; }

std::string JournalReport::sentence() const {
    std::string out;
    if (commands > 0) out = formatted("{}: {} command{} applied", file, commands, commands == 1 ? "" : "s");
    if (dropped_bytes == 0) return out;
    out += formatted(
        "{}{} byte{} of the journal left out: {}; {}", out.empty() ? file + ": " : ", ", dropped_bytes,
        dropped_bytes == 1 ? "" : "s", reason,
        kept_in.empty() ? "opening the scene for editing keeps them in a file beside it" : "kept in " + kept_in);
    return out;
}

Result<void> World::apply(const std::string& command, const std::string& name) {
    auto read = scene::read_command(command, name, impl_->names());
    if (!read) return read.error();
    auto done = impl_->apply(*this, std::move(*read));
    return done ? done : Result<void>(Error{name + ": " + done.error().message, done.error().kind});
}

Result<void> World::apply(const TimedCommand& command) {
    const auto doc = JsonDocument::parse(command.text, command.file, command.line);
    if (!doc) return doc.error();
    const auto at = doc->find(0, "command");
    if (!at) return doc->error(0, "the key \"command\" is missing");
    auto read = scene::read_command(*doc, *at, impl_->names());
    if (!read) return read.error();
    auto done = impl_->apply(*this, std::move(*read));
    // What only the world can refuse is the file's fault as well.
    return done ? done : Result<void>(doc->error(*at, done.error().message));
}

Result<std::vector<TimedCommand>> read_timed_commands(const std::string& path) {
    auto text = read_file(path);
    if (!text) return text.error();
    std::vector<TimedCommand> out;
    uint32_t line = 1;
    for (size_t at = 0; at < text->size(); ++line) {
        const size_t end = std::min(text->find('\n', at), text->size());
        std::string one = text->substr(at, end - at);
        at = end + 1;
        if (!one.empty() && one.back() == '\r') one.pop_back();
        if (one.find_first_not_of(" \t") == std::string::npos) continue;
        const auto doc = JsonDocument::parse(one, path, line);
        if (!doc) return doc.error();
        constexpr std::string_view kExample = "{\"time\": 1, \"command\": {\"remove\": \"lump\"}}";
        if (!doc->is(0, JsonType::Object)) return doc->error(0, formatted("no object; write {}", kExample));
        for (JsonIndex c = doc->first(0); c < doc->next(0); c = doc->next(c))
            if (doc->key(c) != "time" && doc->key(c) != "command")
                return doc->error_at_key(c, formatted("unknown key; write {}", kExample));
        const auto time = doc->find(0, "time"), command = doc->find(0, "command");
        if (!time || !command)
            return doc->error(0, formatted("the key \"{}\" is missing; write {}", time ? "command" : "time", kExample));
        if (!doc->is(*time, JsonType::Number) || !(doc->number(*time) >= 0))
            return doc->error(*time, "no time; write seconds from the start, 0 or more");
        if (auto fault = scene::command_fault(*doc, *command)) return std::move(*fault);
        out.push_back({doc->number(*time), path, std::move(one), line});
    }
    std::stable_sort(out.begin(), out.end(),
                     [](const TimedCommand& a, const TimedCommand& b) { return a.time < b.time; });
    return out;
}

}  // namespace kiln

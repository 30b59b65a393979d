// SPDX-License-Identifier: MIT

#include "scene/past.h"

#include "base/format.h"
#include "base/log.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string_view>
#include <vector>

namespace kiln::scene {
namespace {

Hash128 hash_of(std::string_view text) { return hash128(std::as_bytes(std::span(text.data(), text.size()))); }

Result<std::string> bytes_of(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    std::string out{std::istreambuf_iterator<char>(in), {}};
    if (!in.is_open() || in.bad())
        return Error{formatted("{}: cannot be read: {}", path, std::strerror(errno)), ErrorKind::Failed};
    return out;
}

}  // namespace

std::string past_path(const std::string& scene) {
    const std::string journal = journal_path(scene);
    return journal.substr(0, journal.rfind('.')) + ".history";
}

std::string chunk_record(uint32_t first) { return formatted("{{\"journal\":{}}}", first); }

Records records_to(std::string_view bytes, const Hash128& scene) {
    Records out = read_records(bytes);
    if (out.payloads.empty() || hash_of(out.payloads[0]) != out.base) return {};
    const std::string mark = saved_record(scene);
    size_t count = out.payloads.size();
    while (count > 1 && out.payloads[count - 1] != mark) --count;
    if (count < 2) return {};
    const size_t end = size_t(out.payloads[count - 1].data() - bytes.data()) + out.payloads[count - 1].size();
    return read_records(bytes.substr(0, end));
}

Result<Past> Past::open(const std::string& scene, std::string& bytes) {
    auto file = RecordFile::open(past_path(scene), bytes);
    if (!file) return file.error();
    return Past(std::move(*file));
}

Result<void> Past::resume(const Records& records, const Hash128& scene, uint32_t next) {
    saved(scene, next);
    leads_ = true;
    first_bytes_ = records.payloads[0].size();
    return file_.resume(records);
}

void Past::begin(const Hash128& scene, uint32_t next) {
    saved(scene, next);
    leads_ = false;
}

Result<void> Past::take_in(const Journal& journal, const Hash128& scene) {
    const auto bytes = bytes_of(journal.file.path());
    if (!bytes) return bytes.error();
    const std::vector<std::string_view> records = read_records(*bytes).payloads;
    const auto size_from = [&](uint32_t first) {
        uint64_t out = 0;
        for (size_t i = first - 1; i < records.size(); ++i) out += kRecordHeaderBytes + records[i].size();
        return out;
    };
    if (file_.bytes() + size_from(after_end_) > first_bytes_ + kMostPastBytes) leads_ = false;
    const uint32_t first = leads_ ? after_end_ : after_scene_;
    const auto write = [&]() -> Result<void> {
        if (!leads_) {
            const auto text = bytes_of(journal.scene);
            // Somebody else may have written the scene file, or the step may be too long for any past: the next save begins one.
            if (!text || hash_of(*text) != scene_ || size_from(first) > kMostPastBytes) return file_.restart(scene_);
            if (auto begun = file_.restart(scene_); !begun) return begun;
            if (auto written = file_.append(*text); !written) return written;
            first_bytes_ = text->size();
        }
        if (auto written = file_.append(chunk_record(first)); !written) return written;
        for (size_t i = first - 1; i < records.size(); ++i)
            if (auto written = file_.append(records[i]); !written) return written;
        if (auto written = file_.flush(); !written) return written;
        leads_ = true;
        end_ = scene;
        after_end_ = uint32_t(records.size()) + 1;
        return {};
    };
    Result<void> done = write();
    if (done || !leads_) return done;
    // A part of it may be there.
    const auto now = bytes_of(file_.path());
    const Records kept = now ? records_to(*now, end_) : Records{};
    leads_ = !kept.payloads.empty() && bool(file_.resume(kept));
    return done;
}

}  // namespace kiln::scene

// SPDX-License-Identifier: MIT

#include "scene/journal.h"

#include "base/format.h"

#include <filesystem>

namespace kiln::scene {

std::string journal_path(const std::string& scene) {
    std::error_code failed;
    if (!std::filesystem::is_symlink(scene, failed)) return scene + ".journal";
    const auto target = std::filesystem::weakly_canonical(scene, failed);
    return (failed ? scene : target.string()) + ".journal";
}

bool same_file(const std::string& a, const std::string& b) {
    std::error_code failed;
    return a == b || std::filesystem::equivalent(a, b, failed);
}

std::string saved_record(const Hash128& scene) {
    return formatted("{{\"saved\":\"{}{}\"}}", hex(scene.high), hex(scene.low));
}
std::string go_record(uint32_t sequence) { return formatted("{{\"go\":{}}}", sequence); }
std::string begin_record(const std::string& title) { return formatted("{{\"begin\":{}}}", json_quoted(title)); }

std::string step_record(const std::string& title, const std::vector<std::string>& commands) {
    std::string out = formatted("{{\"step\":{},\"commands\":[", json_quoted(title));
    for (size_t i = 0; i < commands.size(); ++i) out += (i ? "," : "") + commands[i];
    return out + "]}";
}

JournalStart find_start(const Records& records, const Hash128& scene) {
    JournalStart out;
    if (!records.has_header) return out;
    out.foreign = records.base != scene;
    const std::string mark = saved_record(scene);
    for (size_t i = records.payloads.size(); i-- > 0;) {
        if (records.payloads[i] != mark) continue;
        return {false, i + 1, uint32_t(i + 1)};
    }
    return out;
}

}  // namespace kiln::scene

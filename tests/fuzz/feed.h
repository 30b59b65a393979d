// SPDX-License-Identifier: MIT
// What every reader of files promises of any bytes, for the deterministic tests and for libFuzzer. Each answers the broken promise, or
// nothing.
#pragma once

#include "base/record_file.h"
#include "complaint.h"
#include "scene/command.h"
#include "scene/heights.h"
#include "scene/scene_file.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <span>
#include <string>

namespace kiln::scene {

// A scene, which is saved and read again unchanged, or an error of kind Input of one line with a place.
inline std::string scene_complaint(const std::string& text) {
    const auto scene = read_scene(text, "f.json");
    if (!scene) return error_complaint(scene.error(), "f.json");
    const std::string saved = write_scene(*scene, scene->stage);
    const auto again = read_scene(saved, "f.json");
    if (!again) return again.error().message + "\n" + saved.substr(0, 2000);
    return write_scene(*again, again->stage) == saved ? "" : "saved again it differs:\n" + saved.substr(0, 2000);
}

// A command that is written and read again unchanged, or an error of kind Input with a place.
inline std::string payload_complaint(const std::string& text) {
    const Edit lump;
    SceneData scene;
    scene.materials = {{"clay", {}}};
    scene.objects = {{"ring", {Node{}}}};
    scene.material_numbers = {{"clay", 0}};
    scene.object_numbers = {{"ring", 0}};
    const CommandNames names{scene.material_numbers, scene.object_numbers,
                             [&](std::string_view name) { return name.empty() ? nullptr : &lump; }};
    const auto command = read_command(text, "f.journal", names);
    if (!command) return error_complaint(command.error(), "f.journal");
    const auto written = [&](const Command& c) {
        return write_command(scene, c.stage,
                             {c.kind, c.id, c.before, c.edit.get(), c.material ? &*c.material : nullptr,
                              c.object ? &*c.object : nullptr});
    };
    const std::string saved = written(*command);
    const auto again = read_command(saved, "f.journal", names);
    if (!again) return again.error().message + "\n" + saved;
    return written(*again) == saved ? "" : "written again it differs:\n" + saved;
}

// Good records that lie one after another from the beginning, and are the same without what is behind them.
inline std::string journal_complaint(std::string_view bytes) {
    const Records records = read_records(bytes);
    if (records.good_bytes > bytes.size()) return "more good bytes than there are";
    if (records.fault.empty() != (records.good_bytes == bytes.size()))
        return "a fault without a rest, or a rest without";
    const Records again = read_records(bytes.substr(0, records.good_bytes));
    if (again.payloads != records.payloads || !again.fault.empty()) return "the good part is not good alone";
    for (const std::string_view payload : records.payloads)
        if (std::string complaint = payload_complaint(std::string(payload)); !complaint.empty()) return complaint;
    return "";
}

// A grid of numbers in [0, 1], or an error of kind Input that names the file.
inline std::string heights_complaint(std::span<const uint8_t> bytes) {
    const int file = memfd_create("heights.png", 0);
    if (file < 0 || write(file, bytes.data(), bytes.size()) != ssize_t(bytes.size())) return "no file in memory";
    const std::string path = "/proc/self/fd/" + std::to_string(file);
    const auto grid = load_heights(path);
    close(file);
    if (!grid) return error_complaint(grid.error(), path);
    if (grid->columns < 2 || grid->rows < 2) return "less than 2 x 2";
    if (grid->values.size() != size_t(grid->columns) * size_t(grid->rows)) return "columns x rows are not its numbers";
    for (const float v : grid->values)
        if (!(v >= 0 && v <= 1)) return "a height of " + std::to_string(v);
    return "";
}

}  // namespace kiln::scene

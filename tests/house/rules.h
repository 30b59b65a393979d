// SPDX-License-Identifier: MIT
// The rules of the house as functions of a file's path and text, so that each can be shown to fail on a bad example.
// Each answers one sentence a fault, empty when there is none. Paths are relative to the root, with '/'.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace kiln::house {

using Faults = std::vector<std::string>;

/// A header prefix that only one folder of src/ may include.
struct Pin {
    std::string header;  // "nlohmann/" or "png.h"
    std::string folder;  // "src/scene/"
};

/// src/modules.txt.
struct Modules {
    std::map<std::string, std::vector<std::string>> may_include;
    std::vector<std::string> order;
    std::vector<Pin> pins;
};
/// Faults: rows that are no rows, modules named before they are declared (so arrows cannot make a circle).
Modules parse_modules(std::string_view text, Faults& faults);

struct Include {
    int line = 0;
    bool angled = false;
    std::string path;
};
std::vector<Include> includes_of(std::string_view text);

/// Text with comments blanked out, lines kept.
std::string without_comments(std::string_view text);

/// Includes of a file under src/: arrows, pins, and no third-party header that nobody pinned.
Faults module_faults(const Modules& modules, const std::string& path, std::string_view text);

/// Includes of a file under apps/ or samples/: the public interface, std, the system, and (apps) the command line parser; the window system in
/// apps/player alone, which apps/cli may use.
Faults client_faults(const std::string& path, std::string_view text);

/// Includes of a file under include/kiln: std and kiln/ only.
Faults public_header_faults(const std::string& path, std::string_view text);

/// Tokens of graphics APIs outside src/rhi/<backend>/, and barriers outside the graph.
Faults token_faults(const std::string& path, std::string_view text);

/// No SPDX line among the first two, a TODO without an issue.
Faults text_faults(const std::string& path, std::string_view text);

}  // namespace kiln::house

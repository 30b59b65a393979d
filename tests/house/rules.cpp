// SPDX-License-Identifier: MIT
#include "house/rules.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <regex>
#include <sstream>

namespace kiln::house {
namespace {

std::vector<std::string> words(const std::string& text) {
    std::istringstream in(text);
    std::vector<std::string> out;
    for (std::string word; in >> word;) out.push_back(word);
    return out;
}

std::string at(const std::string& path, int line, const std::string& what) {
    return path + ":" + std::to_string(line) + ": " + what;
}

// C++'s own headers have no dot; of C and the system only these.
bool is_system_header(const std::string& header) {
    static const std::regex known(
        "[a-z_0-9]+|sys/"
        "[a-z]+\\.h|(unistd|fcntl|dlfcn|signal|poll|immintrin|cpuid|termios|time|math|stdint|string|stddef)\\.h");
    return std::regex_match(header, known);
}

std::string module_of(const std::string& path) {  // "src/field/bake.cpp" -> "field"
    const size_t from = 4, to = path.find('/', from);
    return to == std::string::npos ? "" : path.substr(from, to - from);
}

template <typename Fn>
void each_line(std::string_view text, Fn&& fn) {
    int line = 1;
    for (size_t from = 0; from <= text.size(); ++line) {
        const size_t to = std::min(text.find('\n', from), text.size());
        fn(line, std::string(text.substr(from, to - from)));
        from = to + 1;
    }
}

}  // namespace

Modules parse_modules(std::string_view text, Faults& faults) {
    static const std::regex row("([a-z_]+):([a-z_ ]*)(\\|(.*))?");
    Modules out;
    each_line(text, [&](int number, const std::string& line) {
        if (line.empty() || line[0] == '#') return;
        std::smatch part;
        if (!std::regex_match(line, part, row)) {
            faults.push_back(at("src/modules.txt", number, "not a row: " + line));
            return;
        }
        const std::string name = part[1];
        for (const std::string& lower : words(part[2])) {
            if (!out.may_include.contains(lower)) {
                faults.push_back(at("src/modules.txt", number,
                                    name + " may not include " + lower + ", which is not above it in the file"));
            }
        }
        out.may_include[name] = words(part[2]);
        out.order.push_back(name);
        for (const std::string& pin : words(part[4])) {
            const size_t sign = pin.find('@');
            const std::string folder = sign == std::string::npos ? "" : pin.substr(sign + 1) + "/";
            out.pins.push_back({pin.substr(0, sign), "src/" + name + "/" + folder});
        }
    });
    return out;
}

std::vector<Include> includes_of(std::string_view text) {
    static const std::regex directive("\\s*#\\s*include\\s*([<\"])([^>\"]+)[>\"].*");
    std::vector<Include> out;
    each_line(without_comments(text), [&](int number, const std::string& line) {
        std::smatch part;
        if (std::regex_match(line, part, directive)) out.push_back({number, part[1] == "<", part[2]});
    });
    return out;
}

std::string without_comments(std::string_view text) {
    enum { Code, Line, Block, String, Character } state = Code;
    std::string out(text);
    for (size_t i = 0; i < out.size(); ++i) {
        const char c = out[i], next = i + 1 < out.size() ? out[i + 1] : '\0';
        switch (state) {
        case Code:
            if (c == '/' && (next == '/' || next == '*')) {
                state = next == '/' ? Line : Block;
                out[i] = out[i + 1] = ' ';
                ++i;
            } else if (c == '"' && i > 0 && out[i - 1] == 'R') {  // raw string: skip to )mark"
                const std::string end = ")" + out.substr(i + 1, out.find('(', i) - i - 1) + "\"";
                i = std::min(out.find(end, i), out.size() - end.size()) + end.size() - 1;
            } else if (c == '"') {
                state = String;
            } else if (c == '\'' && !(i > 0 && std::isalnum(static_cast<unsigned char>(out[i - 1])))) {  // not 1'000
                state = Character;
            }
            break;
        case Line:
            if (c == '\n')
                state = Code;
            else
                out[i] = ' ';
            break;
        case Block:
            if (c == '*' && next == '/') {
                state = Code;
                out[i] = out[i + 1] = ' ';
                ++i;
            } else if (c != '\n') {
                out[i] = ' ';
            }
            break;
        case String:
        case Character:
            if (c == '\\')
                ++i;
            else if (c == '\n' || c == (state == String ? '"' : '\''))
                state = Code;
            break;
        }
    }
    return out;
}

Faults module_faults(const Modules& modules, const std::string& path, std::string_view text) {
    Faults faults;
    const std::string module = module_of(path);
    const auto row = modules.may_include.find(module);
    if (row == modules.may_include.end()) return {path + ": src/modules.txt has no row for this folder"};

    for (const Include& include : includes_of(text)) {
        const auto fault = [&](const std::string& what) { faults.push_back(at(path, include.line, what)); };
        const std::string& header = include.path;
        bool pinned = false, here = false;
        std::string home;
        for (const Pin& pin : modules.pins) {
            if (header.starts_with(pin.header)) {
                pinned = true;
                here = here || path.starts_with(pin.folder);
                home = pin.folder;
            }
        }
        if (pinned && !here) {
            fault("<" + header + "> may be included under " + home + " only");
        } else if (pinned || header.starts_with("kiln/")) {
            continue;
        } else if (include.angled) {
            if (!is_system_header(header)) fault("<" + header + "> is pinned to no module in src/modules.txt");
        } else {
            const std::string other = header.substr(0, header.find('/'));
            if (other == module || other == "shaders") continue;
            if (!modules.may_include.contains(other)) {
                fault("\"" + header + "\" does not start with a module's folder");
            } else if (std::ranges::count(row->second, other) == 0) {
                fault(module + " may not include " + other + " (\"" + header + "\")");
            }
        }
    }
    return faults;
}

Faults client_faults(const std::string& path, std::string_view text) {
    Faults faults;
    const bool app = path.starts_with("apps/");
    const std::string folder = app ? path.substr(5, path.find('/', 5) - 5) + "/" : "";
    for (const Include& include : includes_of(text)) {
        const std::string& header = include.path;
        const bool parser = app && include.angled && header.starts_with("CLI/");
        const bool own =
            app && !include.angled && (header.starts_with(folder) || header.find('/') == std::string::npos);
        // The window system is the player's alone, and the command line is made with the player.
        const bool window = folder == "player/" && include.angled && header.starts_with("SDL2/");
        const bool player = folder == "cli/" && !include.angled && header.starts_with("player/");
        const bool interface = include.angled && header.starts_with("kiln/");
        if (!parser && !own && !window && !player && !interface && !(include.angled && is_system_header(header))) {
            faults.push_back(at(path, include.line, "\"" + header + "\" is not of the public interface"));
        }
    }
    return faults;
}

Faults public_header_faults(const std::string& path, std::string_view text) {
    Faults faults;
    for (const Include& include : includes_of(text)) {
        const bool allowed = include.angled && (include.path.starts_with("kiln/") || is_system_header(include.path));
        if (!allowed) faults.push_back(at(path, include.line, "a public header includes \"" + include.path + "\""));
    }
    return faults;
}

Faults token_faults(const std::string& path, std::string_view text) {
    struct Api {
        std::regex token;
        std::string folder;
    };
    static const std::array<Api, 3> apis{{
        {std::regex("\\b(vk[A-Z]\\w*|Vk[A-Z]\\w*|VK_\\w*|volk\\w*)"), "src/rhi/vulkan/"},
        {std::regex("\\b(WGPU\\w*|wgpu[A-Z]\\w*)"), "src/rhi/webgpu/"},
        {std::regex("\\b(ID3D12\\w*|D3D12\\w*|IDXGI\\w*)"), "src/rhi/d3d12/"},
    }};
    static const std::regex barrier("(->|\\.)barrier\\(");
    Faults faults;
    const bool may_barrier = path.starts_with("src/rhi/") || path.starts_with("src/render/graph");
    each_line(without_comments(text), [&](int number, const std::string& line) {
        std::smatch found;
        for (const Api& api : apis) {
            if (!path.starts_with(api.folder) && std::regex_search(line, found, api.token)) {
                faults.push_back(at(path, number, "`" + found[0].str() + "` belongs under " + api.folder));
            }
        }
        if (!may_barrier && std::regex_search(line, barrier)) {
            faults.push_back(at(path, number, "only the render graph places barriers"));
        }
    });
    return faults;
}

Faults text_faults(const std::string& path, std::string_view text) {
    Faults faults;
    const size_t two_lines = std::min(text.find('\n', std::min(text.find('\n'), text.size() - 1) + 1), text.size());
    if (text.substr(0, two_lines).find("SPDX-License-Identifier: MIT") == std::string_view::npos) {
        faults.push_back(path + ": no SPDX line at its beginning");
    }
    static const std::regex loose("\\b(TODO(?!\\(issue \\d+\\):)|FIXME|XXX)\\b");
    each_line(text, [&](int number, const std::string& line) {
        if (std::regex_search(line, loose))
            faults.push_back(at(path, number, "a note without its issue: TODO(issue N): …"));
    });
    return faults;
}

}  // namespace kiln::house

// SPDX-License-Identifier: MIT
#include "render/live_shaders.h"

#include "base/format.h"
#include "base/log.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <unistd.h>

// Takes ShaderSource as its own name for it.
using kiln::render::ShaderSource;
#include "shaders/list_of_kiln_render.h"

namespace kiln::render {

namespace {

constexpr std::chrono::milliseconds kBetweenLooks{200};

std::string read(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

// For a shell.
std::string shell_word(std::string_view word) {
    std::string out = "'";
    for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return out + "'";
}

struct Ran {
    int status = -1;
    std::string said;  // on both streams
};
Ran run_command(const std::string& command) {
    Ran out;
    FILE* const pipe = ::popen((command + " 2>&1").c_str(), "r");
    if (pipe == nullptr) return out;
    std::array<char, 4096> bytes;
    for (size_t n = 0; (n = std::fread(bytes.data(), 1, bytes.size(), pipe)) > 0;) out.said.append(bytes.data(), n);
    out.status = ::pclose(pipe);
    return out;
}

// What its #include lines name.
std::vector<std::string> included(std::string_view text) {
    std::vector<std::string> out;
    constexpr std::string_view kWord = "#include \"";
    for (size_t at = text.find(kWord); at != std::string_view::npos; at = text.find(kWord, at + 1)) {
        const size_t first = at + kWord.size(), last = text.find('"', first);
        if (last != std::string_view::npos) out.emplace_back(text.substr(first, last - first));
    }
    return out;
}

// The line that names the file and the line, if there is one.
std::string first_error(const std::string& said) {
    size_t at = 0;
    while (at < said.size()) {
        const size_t end = std::min(said.find('\n', at), said.size());
        const std::string line = said.substr(at, end - at);
        if (line.find(": error:") != std::string::npos) return line;
        at = end + 1;
    }
    return said.substr(0, said.find('\n'));
}

}  // namespace

std::span<const ShaderSource> shader_sources() { return kShaderSources; }

Result<std::unique_ptr<LiveShaders>> LiveShaders::from_environment() {
    const char* const named = std::getenv("KILN_LIVE_SHADERS");
    if (named == nullptr || *named == '\0') return std::unique_ptr<LiveShaders>();
    std::vector<std::string> folders;
    const std::string_view list = named;
    for (size_t at = 0; at <= list.size();) {
        const size_t end = std::min(list.find(':', at), list.size());
        if (end > at) folders.emplace_back(list.substr(at, end - at));
        at = end + 1;
    }
    return watch(std::move(folders));
}

Result<std::unique_ptr<LiveShaders>> LiveShaders::watch(std::vector<std::string> folders,
                                                        std::span<const ShaderSource> sources) {
    const std::string first = folders.empty() ? "" : folders[0];
    for (const ShaderSource& source : sources) {
        std::error_code ignored;
        if (!std::filesystem::is_regular_file(first + "/" + std::string(source.file), ignored))
            return Error{
                formatted("KILN_LIVE_SHADERS: '{}' has no {}; an installed program has no shader sources: name "
                          "the folder src of a checkout, and after a colon the folder generated of its build",
                          first, source.file),
                ErrorKind::Usage};
    }
    if (run_command("glslc --version").status != 0)
        return Error{
            "KILN_LIVE_SHADERS: there is no glslc on the PATH; install it (Debian: glslc), or unset the variable",
            ErrorKind::Usage};
    return std::unique_ptr<LiveShaders>(new LiveShaders(std::move(folders), sources));
}

LiveShaders::LiveShaders(std::vector<std::string> folders, std::span<const ShaderSource> sources)
    : folders_(std::move(folders)), sources_(sources) {
    Files files;
    for (const ShaderSource& source : sources_) seen_.push_back(contents_of(std::string(source.file), files));
    thread_ = std::thread([this] { run(); });
}

LiveShaders::~LiveShaders() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    changed_.notify_all();
    thread_.join();
}

void LiveShaders::run() {
    std::unique_lock lock(mutex_);
    while (!stop_) {
        const uint64_t asked = asked_;
        lock.unlock();
        std::vector<Compiled> found = look();
        lock.lock();
        for (Compiled& c : found) {
            std::erase_if(ready_, [&](const Compiled& older) { return older.source == c.source; });
            ready_.push_back(std::move(c));
        }
        looked_ = asked;
        changed_.notify_all();
        changed_.wait_for(lock, kBetweenLooks, [this] { return stop_ || asked_ > looked_; });
    }
}

void LiveShaders::finish() {
    std::unique_lock lock(mutex_);
    const uint64_t mine = ++asked_;
    changed_.notify_all();
    changed_.wait(lock, [&] { return looked_ >= mine; });
}

std::string LiveShaders::find(std::string_view name) const {
    for (const std::string& folder : folders_) {
        std::string path = folder + "/" + std::string(name);
        std::error_code ignored;
        if (std::filesystem::is_regular_file(path, ignored)) return path;
    }
    return {};
}

// Of a file and all that it includes. `files`: what was read in this look.
Hash128 LiveShaders::contents_of(const std::string& file, Files& files) const {
    std::string all;
    std::set<std::string> met{file};
    std::vector<std::string> open{file};
    while (!open.empty()) {
        const std::string name = std::move(open.back());
        open.pop_back();
        auto known = files.find(name);
        if (known == files.end()) {
            const std::string path = find(name);
            known = files.emplace(name, path.empty() ? std::string() : read(path)).first;
        }
        all += name + '\n' + known->second + '\n';
        for (std::string& next : included(known->second))
            if (met.insert(next).second) open.push_back(std::move(next));
    }
    return hash128(std::as_bytes(std::span(all)));
}

std::vector<LiveShaders::Compiled> LiveShaders::look() {
    std::vector<Compiled> out;
    Files files;
    for (size_t i = 0; i < sources_.size(); ++i) {
        const Hash128 now = contents_of(std::string(sources_[i].file), files);
        if (now == seen_[i]) continue;
        seen_[i] = now;
        out.push_back(compile(sources_[i]));
    }
    return out;
}

LiveShaders::Compiled LiveShaders::compile(const ShaderSource& source) const {
    Compiled out{.source = &source, .words = {}, .fault = {}};
    std::string made = (std::filesystem::temp_directory_path() / "kiln-shader-XXXXXX").string();
    const int file = ::mkstemp(made.data());
    if (file < 0) {
        out.fault = formatted("{}: cannot write {}", source.file, made);
        return out;
    }
    ::close(file);
    std::string command = "glslc --target-env=vulkan1.3 -O -Werror";
    for (const std::string& folder : folders_) command += " -I " + shell_word(folder);
    command += " -o " + shell_word(made) + " " + shell_word(folders_[0] + "/" + std::string(source.file));
    const Ran ran = run_command(command);
    if (ran.status == 0) {
        const std::string bytes = read(made);
        out.words.resize(bytes.size() / 4);
        if (!out.words.empty()) std::memcpy(out.words.data(), bytes.data(), out.words.size() * 4);
    }
    std::error_code ignored;
    std::filesystem::remove(made, ignored);
    if (out.words.empty()) out.fault = first_error(ran.said);
    return out;
}

std::vector<std::string> LiveShaders::apply(PipelineLibrary& pipelines) {
    std::vector<Compiled> ready;
    {
        const std::lock_guard lock(mutex_);
        ready.swap(ready_);
    }
    std::vector<std::string> errors;
    for (const Compiled& c : ready) {
        std::string fault = c.fault;
        if (fault.empty()) {
            if (auto ok = pipelines.replace_words(c.source->words, c.words); ok)
                ++swapped_;
            else
                fault = formatted("{}: {}; the pass in C++ says what a kernel binds, so that needs a new build",
                                  c.source->file, ok.error().message);
        }
        // Many shaders include one file: its error is told once.
        if (!fault.empty() && std::find(errors.begin(), errors.end(), fault) == errors.end()) errors.push_back(fault);
    }
    for (const std::string& sentence : errors) log::error("shader kept as it was: {}", sentence);
    return errors;
}

}  // namespace kiln::render

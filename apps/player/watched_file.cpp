// SPDX-License-Identifier: MIT
#include "player/watched_file.h"

#include <chrono>
#include <fstream>
#include <iterator>
#include <utility>

namespace kiln::player {

namespace {

// File systems count time in steps, of up to two seconds (FAT): what is written twice within one may look untouched.
constexpr std::chrono::seconds kTimeStep{2};
constexpr std::string_view kEnding = ".kiln.json";

}  // namespace

uint64_t hash_of(std::string_view text) {
    uint64_t h = 0xcbf29ce484222325ull;  // FNV-1a, 64 bits
    for (const char c : text) h = (h ^ uint8_t(c)) * 0x100000001b3ull;
    return h;
}

std::string text_of(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

std::string free_name_beside(const std::string& scene, const std::string& word) {
    const std::string_view ending = scene.ends_with(kEnding) ? kEnding : std::string_view{};
    const std::string stem = scene.substr(0, scene.size() - ending.size()) + "." + word;
    std::string name = stem;
    std::error_code ignored;
    for (int i = 2; std::filesystem::exists(name + std::string(ending), ignored); ++i)
        name = stem + "-" + std::to_string(i);
    return name + std::string(ending);
}

WatchedFile::WatchedFile(std::string path) : path_(std::move(path)) {
    (void)look();
    known_ = found_;
}

WatchedFile::State WatchedFile::look() {
    std::error_code failed;
    const auto time = std::filesystem::last_write_time(path_, failed);
    const uintmax_t size = failed ? 0 : std::filesystem::file_size(path_, failed);
    if (failed) {
        settled_ = false;
        return State::Gone;
    }
    if (!settled_ || time != time_ || size != size_) {
        const auto now = std::filesystem::file_time_type::clock::now();
        found_ = hash_of(text_of(path_));
        time_ = time;
        size_ = size;
        settled_ = now - time > kTimeStep;
    }
    return found_ == known_ ? State::Same : State::Changed;
}

}  // namespace kiln::player

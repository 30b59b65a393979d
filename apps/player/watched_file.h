// SPDX-License-Identifier: MIT
// A file that other programs may write, too: whether it holds something else than what was last read or written here.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace kiln::player {

uint64_t hash_of(std::string_view text);
/// All of a file; empty where it cannot be read.
std::string text_of(const std::string& path);
/// `a/b.kiln.json` and `other`: `a/b.other.kiln.json`, or the first `a/b.other-2.kiln.json` … that no file has.
std::string free_name_beside(const std::string& scene, const std::string& word);

class WatchedFile {
public:
    /// What it holds now is what is known of it.
    explicit WatchedFile(std::string path);

    enum class State { Same, Changed, Gone };
    /// Reads the file only where its time or size are not those of the last look, or so young that they do not tell.
    State look();
    /// Of what the last look() found.
    uint64_t found() const { return found_; }
    /// What is known of it from now on.
    void know(uint64_t hash) { known_ = hash; }

private:
    std::string path_;
    uint64_t known_ = 0, found_ = 0;
    std::filesystem::file_time_type time_{};
    uintmax_t size_ = 0;
    bool settled_ = false;  // time and size tell whether it was written again
};

}  // namespace kiln::player

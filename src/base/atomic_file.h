// SPDX-License-Identifier: MIT
// AtomicFile: a file that appears whole or not at all. Bytes go to a temporary beside the target; commit() flushes it to
// the disk and renames it over the target; without commit() the destructor removes it and the old file is untouched.
// A target that exists and is no regular file (a device, a pipe) is written to directly. Parent folders are never created.
#pragma once

#include <kiln/result.h>

#include <cstddef>
#include <cstdio>
#include <span>
#include <string>
#include <string_view>

namespace kiln {

class AtomicFile {
public:
    /// Errors name the path and the reason: "cannot write a/b.png: No such file or directory".
    static Result<AtomicFile> create(const std::string& path);
    AtomicFile(AtomicFile&& other) noexcept;
    AtomicFile& operator=(AtomicFile&& other) noexcept;
    ~AtomicFile();

    /// Appends. A failure is remembered: commit() reports it too.
    Result<void> write(std::span<const std::byte> bytes);
    Result<void> write(std::string_view text) { return write(std::as_bytes(std::span(text.data(), text.size()))); }
    /// For libraries that write to a FILE*, or by name (the temporary's). Null after commit().
    FILE* stream() const { return stream_; }
    const std::string& temporary_path() const { return temporary_; }

    /// After this the target holds the new bytes, also after a power cut. Once only.
    Result<void> commit();

    /// Removes every temporary of this process. For handlers of signals that end it: calls only unlink().
    static void remove_temporaries_from_signal() noexcept;

private:
    AtomicFile() = default;
    void discard() noexcept;
    Error failure(int error) const;

    std::string path_;       // as the caller named it
    std::string target_;     // with symbolic links followed
    std::string temporary_;  // == target_ when written directly
    FILE* stream_ = nullptr;
    int slot_ = -1;   // in the table that signals read
    int failed_ = 0;  // errno of the first failed write
};

}  // namespace kiln

// SPDX-License-Identifier: MIT
// Talking: data goes to stdout, everything for people to stderr.
#pragma once

#include <kiln/result.h>

#include <chrono>
#include <string>
#include <string_view>
#include <utility>

namespace kiln::cli {

enum Exit { kDone = 0, kFailed = 1, kUsage = 2, kBadInput = 3, kNoDevice = 4, kOutOfMemory = 5, kInterrupted = 130 };

/// One line on stderr.
void say(std::string_view line);
/// A measure for people: two decimals below 10, else none.
std::string brief(double value, const char* unit);
/// An error in what was asked for.
inline Error usage(std::string message) { return {std::move(message), ErrorKind::Usage}; }
/// Says the error in one line, with a hint where one helps; answers its exit code.
int fail(const Error& error);
/// Data on stdout; an answer of false means that nobody could take it (disk full, closed pipe).
bool put(std::string_view data);
/// Flushes stdout. Exit code of a verb that wrote data: kDone, or kFailed with a message.
int finish_data();

/// Why `path` cannot be written, known before any work is done; nothing when it looks writable.
Result<void> writable(const std::string& path);

/// A line that tells what goes on, on terminals only, and gone when done.
class Progress {
public:
    Progress();
    ~Progress();
    void stage(std::string_view what);
    /// With a bar beside it; `done` is in [0, 1].
    void bar(std::string_view what, double done);

private:
    bool shown_ = false, used_ = false;
};

class Stopwatch {
public:
    double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace kiln::cli

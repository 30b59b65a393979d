// SPDX-License-Identifier: MIT

#include "cli/talk.h"

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sys/stat.h>
#include <unistd.h>

namespace kiln::cli {

void say(std::string_view line) {
    std::string out(line);
    out += '\n';
    (void)std::fwrite(out.data(), 1, out.size(), stderr);
}

std::string brief(double value, const char* unit) {
    char buffer[64];
    std::snprintf(buffer, sizeof buffer, value < 10 ? "%.2f %s" : "%.0f %s", value, unit);
    return buffer;
}

int fail(const Error& error) {
    switch (error.kind) {
    case ErrorKind::Usage:
        say("kiln: " + error.message);
        return kUsage;
    case ErrorKind::Input:
        say(error.message);
        return kBadInput;
    case ErrorKind::NoDevice:
        say("kiln: " + error.message + " (`kiln doctor` tells what this machine can do)");
        return kNoDevice;
    case ErrorKind::OutOfMemory:
        say("kiln: " + error.message);
        return kOutOfMemory;
    case ErrorKind::Failed:
        break;
    }
    say("kiln: " + error.message);
    return kFailed;
}

bool put(std::string_view data) { return std::fwrite(data.data(), 1, data.size(), stdout) == data.size(); }

int finish_data() {
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return kDone;
    say(std::string("kiln: cannot write to stdout: ") + std::strerror(errno));
    return kFailed;
}

Result<void> writable(const std::string& path) {
    const auto cannot = [&](int code) {
        return Error{"cannot write " + path + ": " + std::strerror(code), ErrorKind::Failed};
    };
    struct stat info {};
    if (::stat(path.c_str(), &info) == 0) {
        if (S_ISDIR(info.st_mode)) return cannot(EISDIR);
        if (!S_ISREG(info.st_mode))
            return ::access(path.c_str(), W_OK) == 0 ? Result<void>() : Result<void>(cannot(errno));
    }
    const size_t slash = path.find_last_of('/');
    const std::string folder = slash == std::string::npos ? "." : path.substr(0, slash + 1);
    if (::stat(folder.c_str(), &info) != 0) return cannot(errno);
    if (!S_ISDIR(info.st_mode)) return cannot(ENOTDIR);
    if (::access(folder.c_str(), W_OK) != 0) return cannot(errno);
    return {};
}

Progress::Progress() {
    const char* terminal = std::getenv("TERM");
    shown_ = ::isatty(STDERR_FILENO) == 1 && (!terminal || std::strcmp(terminal, "dumb") != 0);
}

Progress::~Progress() {
    if (used_) std::fputs("\r\033[K", stderr);
}

void Progress::bar(std::string_view what, double done) {
    constexpr int kWidth = 30;
    const int filled = int(done * kWidth + 0.5);
    const auto width = size_t(filled < 0 ? 0 : filled > kWidth ? kWidth : filled);
    stage("[" + std::string(width, '#') + std::string(kWidth - width, '.') + "] " + std::string(what));
}

void Progress::stage(std::string_view what) {
    if (!shown_) return;
    used_ = true;
    std::fprintf(stderr, "\r\033[K%.*s ...", int(what.size()), what.data());
    std::fflush(stderr);
}

}  // namespace kiln::cli

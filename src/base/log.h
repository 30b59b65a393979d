// SPDX-License-Identifier: MIT
// Log for people, to stderr: log::warn("{} edits refused", n). Data never goes through here. Any thread.
// KILN_LOG=debug|info|warn|error|off sets the least level that is shown (default: warn); NO_COLOR is honoured.
#pragma once

#include "base/format.h"

namespace kiln::log {

enum class Level : uint8_t { Debug, Info, Warn, Error, Off };

/// Shows messages of `least` and above from now on; wins over KILN_LOG.
void set_level(Level least);
bool shown(Level level);
void write(Level level, std::string_view message);

template <typename... Args>
void debug(std::string_view pattern, const Args&... args) {
    if (shown(Level::Debug)) write(Level::Debug, formatted(pattern, args...));
}
template <typename... Args>
void info(std::string_view pattern, const Args&... args) {
    if (shown(Level::Info)) write(Level::Info, formatted(pattern, args...));
}
template <typename... Args>
void warn(std::string_view pattern, const Args&... args) {
    if (shown(Level::Warn)) write(Level::Warn, formatted(pattern, args...));
}
template <typename... Args>
void error(std::string_view pattern, const Args&... args) {
    if (shown(Level::Error)) write(Level::Error, formatted(pattern, args...));
}

}  // namespace kiln::log

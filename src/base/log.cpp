// SPDX-License-Identifier: MIT
#include "base/log.h"

#include <spdlog/logger.h>
#include <spdlog/sinks/stdout_color_sinks.h>

#include <cstdlib>
#include <memory>

namespace kiln::log {

static spdlog::level::level_enum spdlog_level(Level level) {
    switch (level) {
    case Level::Debug:
        return spdlog::level::debug;
    case Level::Info:
        return spdlog::level::info;
    case Level::Warn:
        return spdlog::level::warn;
    case Level::Error:
        return spdlog::level::err;
    case Level::Off:
        break;
    }
    return spdlog::level::off;
}

static Level level_from_environment() {
    const char* text = std::getenv("KILN_LOG");
    const std::string_view name = text ? text : "";
    if (name == "debug") return Level::Debug;
    if (name == "info") return Level::Info;
    if (name == "error") return Level::Error;
    if (name == "off") return Level::Off;
    return Level::Warn;
}

// Never destroyed: other static objects may still log while the program ends.
static spdlog::logger& logger() {
    static spdlog::logger* const one = [] {
        const char* no_color = std::getenv("NO_COLOR");
        const auto color = no_color && *no_color ? spdlog::color_mode::never : spdlog::color_mode::automatic;
        auto* made = new spdlog::logger("kiln", std::make_shared<spdlog::sinks::stderr_color_sink_mt>(color));
        made->set_pattern("%^%l%$: %v");
        made->set_level(spdlog_level(level_from_environment()));
        return made;
    }();
    return *one;
}

void set_level(Level least) { logger().set_level(spdlog_level(least)); }

bool shown(Level level) { return level != Level::Off && logger().should_log(spdlog_level(level)); }

void write(Level level, std::string_view message) {
    logger().log(spdlog_level(level), spdlog::string_view_t(message.data(), message.size()));
}

}  // namespace kiln::log

// SPDX-License-Identifier: MIT
// What every reader of files promises of its errors.
#pragma once

#include <kiln/result.h>

#include <string>

namespace kiln {

/// Nothing for one line of kind Input that begins with the file's name, as the reader was told it; else what is wrong with it.
inline std::string error_complaint(const Error& error, const std::string& name) {
    if (error.kind != ErrorKind::Input) return "kind of: " + error.message;
    if (!error.message.starts_with(name + ":")) return "no file named: " + error.message;
    return error.message.find('\n') == std::string::npos ? "" : "several lines: " + error.message;
}

}  // namespace kiln

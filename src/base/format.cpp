// SPDX-License-Identifier: MIT
#include "base/format.h"

#include <fmt/args.h>
#include <fmt/format.h>

#include <exception>

namespace kiln {

std::string format_args(std::string_view pattern, std::initializer_list<FormatArg> args) {
    try {
        fmt::dynamic_format_arg_store<fmt::format_context> store;
        for (const FormatArg& arg : args) {
            std::visit(
                [&](auto v) {
                    if constexpr (std::is_same_v<decltype(v), std::string_view>) {
                        store.push_back(fmt::string_view(v.data(), v.size()));
                    } else {
                        store.push_back(v);
                    }
                },
                arg.value());
        }
        return fmt::vformat(fmt::string_view(pattern.data(), pattern.size()), store);
    } catch (const std::exception& fault) {
        return std::string(pattern) + " (bad format: " + fault.what() + ")";
    }
}

std::string one_line(std::string_view text) {
    std::string out(text);
    for (char& c : out) c = uint8_t(c) < 0x20 || c == 0x7f ? ' ' : c;
    while (out.ends_with(' ')) out.pop_back();
    return out;
}

}  // namespace kiln

// SPDX-License-Identifier: MIT
// Golden files and their renewal: `./test --accept NAME` sets KILN_ACCEPT=NAME (all: every one), and refuses under CI.
#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <string>

namespace kiln {

/// True where the golden file of this name is to be made anew. Never under CI, where nobody looks at what is accepted.
inline bool golden_accepted(const std::string& name) {
    const char* asked = std::getenv("KILN_ACCEPT");
    if (!asked || (asked != name && std::string(asked) != "all")) return false;
    const char* ci = std::getenv("CI");
    if (ci && *ci) {
        ADD_FAILURE() << "golden files are not renewed under CI";
        return false;
    }
    return true;
}

/// One line that ./test looks for.
inline void golden_renewed(const std::string& name, const std::string& old_to_new) {
    std::printf("accepted %s: %s\n", name.c_str(), old_to_new.c_str());
}

}  // namespace kiln

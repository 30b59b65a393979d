// SPDX-License-Identifier: MIT
// Jolt's start-up test. A library whose headers were read with other options than it was made with ends the program in its first
// function, so that is found out before.
#ifdef KILN_JOLT

#include "physics/jolt/jolt_world.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace kiln::physics {

// jolt_fault() once more, compiled with Jolt's profiler on (cmake).
std::string_view jolt_fault_of_other_options();

namespace {

TEST(JoltTrap, ALibraryMadeWithOtherOptionsIsToldWithTheMendAndTheRightOneRuns) {
    const std::string told(jolt_fault_of_other_options());
    EXPECT_THAT(told, testing::HasSubstr("other options than its headers"));
    EXPECT_THAT(told, testing::HasSubstr("build Jolt as Release or Distribution"));
    EXPECT_THAT(std::string(jolt_fault()), testing::Not(testing::HasSubstr("other options")));
    EXPECT_EQ(backends().front().name == "jolt", jolt_fault().empty()) << "the default where it runs";
}

}  // namespace
}  // namespace kiln::physics

#endif

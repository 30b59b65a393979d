// SPDX-License-Identifier: MIT
// Part of every module's test program. A file whose tests start threads says so in a line of its own, "// Starts threads.": the thread
// sanitizer has nothing to see in the others, so they are not built for it. Here stands who finds a file that does not say it: between
// the tests and pthread_create.
#include <gtest/gtest.h>

#include <dlfcn.h>
#include <pthread.h>

#include <atomic>
#include <fstream>
#include <string>

namespace {

std::atomic<int> threads_started{0};

// As the compiler was given it: from wherever the build is.
bool says_so(const std::string& path) {
    std::ifstream in(KILN_SOURCE_DIR "/" + path.substr(path.rfind("tests/")));
    std::string line;
    while (std::getline(in, line)) {
        if (line == "// Starts threads.") return true;
    }
    return false;
}

class Watch : public testing::EmptyTestEventListener {
    void OnTestStart(const testing::TestInfo&) override { threads_started = 0; }
    void OnTestEnd(const testing::TestInfo& test) override {
        // A software device has threads of its own.
        const std::string name = std::string(test.test_suite_name()) + "." + test.name();
        if (threads_started == 0 || name.find("Gpu") != std::string::npos || says_so(test.file())) return;
        ADD_FAILURE() << test.file() << " starts threads; give it the line \"// Starts threads.\" below its licence";
    }
};

[[maybe_unused]] const bool watched = [] {
    testing::UnitTest::GetInstance()->listeners().Append(new Watch);
    return true;
}();

}  // namespace

extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*run)(void*), void* with) {
    static const auto real = reinterpret_cast<decltype(&::pthread_create)>(::dlsym(RTLD_NEXT, "pthread_create"));
    ++threads_started;
    return real(thread, attributes, run, with);
}

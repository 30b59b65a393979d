// SPDX-License-Identifier: MIT
// CPU time by name: KILN_PROFILE("bake"); measures from there to the end of the enclosing block. Any thread; two clock reads a use.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace kiln {

/// A place in the code that is measured; lives as long as the program.
class ProfileSite {
public:
    explicit ProfileSite(const char* name);
    void add(std::chrono::nanoseconds spent) {
        calls.fetch_add(1, std::memory_order_relaxed);
        nanoseconds.fetch_add(uint64_t(spent.count()), std::memory_order_relaxed);
    }
    const char* const name;
    std::atomic<uint64_t> calls = 0, nanoseconds = 0;
};

class ProfileScope {
public:
    explicit ProfileScope(ProfileSite& site) : site_(site), start_(std::chrono::steady_clock::now()) {}
    ~ProfileScope() { site_.add(std::chrono::steady_clock::now() - start_); }
    ProfileScope(const ProfileScope&) = delete;
    ProfileScope& operator=(const ProfileScope&) = delete;

private:
    ProfileSite& site_;
    std::chrono::steady_clock::time_point start_;
};

struct ProfileRow {
    std::string name;
    uint64_t calls = 0;
    double total_ms = 0;  // wall time summed over threads; nested scopes count in both
};
/// Every site that has run, sites of one name together, by name.
std::vector<ProfileRow> profile_report();
void profile_reset();

}  // namespace kiln

#define KILN_PROFILE_JOIN_(a, b) a##b
#define KILN_PROFILE_JOIN(a, b) KILN_PROFILE_JOIN_(a, b)
#define KILN_PROFILE(name)                                                    \
    static ::kiln::ProfileSite KILN_PROFILE_JOIN(kiln_site_, __LINE__){name}; \
    const ::kiln::ProfileScope KILN_PROFILE_JOIN(kiln_scope_, __LINE__) { KILN_PROFILE_JOIN(kiln_site_, __LINE__) }

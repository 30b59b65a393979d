// SPDX-License-Identifier: MIT
#include "base/profile.h"

#include <map>
#include <mutex>

namespace kiln {
namespace {

struct Sites {
    std::mutex mutex;
    std::vector<ProfileSite*> all;
};
Sites& sites() {
    static Sites* const one = new Sites;  // outlives every site
    return *one;
}

}  // namespace

ProfileSite::ProfileSite(const char* site_name) : name(site_name) {
    const std::lock_guard lock(sites().mutex);
    sites().all.push_back(this);
}

std::vector<ProfileRow> profile_report() {
    std::map<std::string, ProfileRow> rows;
    const std::lock_guard lock(sites().mutex);
    for (const ProfileSite* site : sites().all) {
        if (site->calls == 0) continue;
        ProfileRow& row = rows[site->name];
        row.name = site->name;
        row.calls += site->calls;
        row.total_ms += double(site->nanoseconds) * 1e-6;
    }
    std::vector<ProfileRow> out;
    for (auto& [name, row] : rows) out.push_back(std::move(row));
    return out;
}

void profile_reset() {
    const std::lock_guard lock(sites().mutex);
    for (ProfileSite* site : sites().all) {
        site->calls = 0;
        site->nanoseconds = 0;
    }
}

}  // namespace kiln

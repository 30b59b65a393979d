// SPDX-License-Identifier: MIT
// kiln doctor: what this machine can do, and what to install where it cannot.

#include "cli/json.h"
#include "cli/talk.h"
#include "cli/verbs.h"

#include <kiln/renderer.h>
#include <kiln/world.h>

#include <memory>
#include <thread>

namespace kiln::cli {

namespace {

// What `render --tier` may be given.
std::string tiers_of(const DeviceInfo& d, bool json) {
    std::string out;
    for (const auto& [name, there] :
         {std::pair("compute", true), std::pair("rt", d.rt_pipeline), std::pair("mesh", d.mesh_shader)})
        if (there) out += (out.empty() ? "" : ", ") + (json ? Json::quoted(name) : std::string(name));
    return json ? "[" + out + "]" : out;
}

int doctor(bool json) {
    const std::vector<DeviceInfo> found = devices();
    bool usable = false;
    for (const DeviceInfo& d : found) usable = usable || d.usable;
    const std::string advice =
        found.empty() ? "no Vulkan driver found; on Debian or Ubuntu: apt install mesa-vulkan-drivers"
        : usable      ? ""
                      : "no device is usable; a CPU renderer always is: apt install mesa-vulkan-drivers";
    std::string engines, default_engine;
    for (const PhysicsBackend& b : physics_backends()) {
        if (!b.why_not.empty()) continue;
        if (engines.empty()) default_engine = b.name;
        engines += (engines.empty() ? "" : ", ") + Json::quoted(b.name);
    }
    if (json) {
        std::string list;
        for (const DeviceInfo& d : found) {
            Json one;
            one.text("name", d.name).text("kind", d.kind).text("backend", d.backend).text("driver", d.driver);
            one.text("api_version", d.api_version).flag("usable", d.usable);
            if (d.usable) one.raw("tiers", tiers_of(d, true));
            if (!d.usable) one.text("why_not", d.why_not);
            list += (list.empty() ? "" : ", ") + one.object();
        }
        Json out;
        out.text("version", version()).number("threads", std::thread::hardware_concurrency());
        out.raw("devices", "[" + list + "]")
            .raw("physics", "[" + engines + "]")
            .text("default_physics", default_engine);
        if (!advice.empty()) out.text("advice", advice);
        (void)put(out.line());
        return finish_data();
    }
    (void)put("kiln " + std::string(version()) + ", " + std::to_string(std::thread::hardware_concurrency()) +
              " threads\n");
    for (const DeviceInfo& d : found) {
        (void)put((d.usable ? "usable   " : "unusable ") + d.name + " (" + d.kind + ", " + d.backend + " " +
                  d.api_version + ", " + d.driver + ")" +
                  (d.usable ? ", tiers " + tiers_of(d, false) : ": " + d.why_not) + "\n");
    }
    for (const PhysicsBackend& b : physics_backends()) {
        (void)put((b.why_not.empty() ? "physics  " : "unusable ") + std::string(b.name) +
                  (b.name == default_engine ? " (default)" : "") +
                  (b.why_not.empty() ? "" : ": " + std::string(b.why_not)) + "\n");
    }
    if (!advice.empty()) (void)put("mend     " + advice + "\n");
    (void)put("works    query, inspect, validate and schema need no device\n");
    return finish_data();
}

}  // namespace

void add_doctor(CLI::App& app, Run& run) {
    auto json = std::make_shared<bool>(false);
    CLI::App* verb = app.add_subcommand("doctor",
                                        "Tells what this machine can do.\n\n"
                                        "Examples:\n"
                                        "  kiln doctor\n"
                                        "  kiln doctor --json");
    verb->add_flag("--json", *json, "one object, on stdout");
    verb->callback([json, &run] { run = [json] { return doctor(*json); }; });
}

}  // namespace kiln::cli

// SPDX-License-Identifier: MIT
#include "measure/peers.h"

#include "base/log.h"

#include <kiln/shapes.h>

#include <cstdlib>
#include <dlfcn.h>
#include <string>
#include <unistd.h>

namespace kiln::measure {
namespace {

std::string plugin_path() {
    if (const char* named = std::getenv("KILN_PEERS")) return named;
    char path[4096];
    const ssize_t size = ::readlink("/proc/self/exe", path, sizeof path);
    if (size <= 0) return {};
    const std::string program(path, size_t(size));
    return program.substr(0, program.find_last_of('/') + 1) + "kiln_peers.so";
}

const KilnPeerTable* open_plugin() {
    const std::string path = plugin_path();
    if (path.empty() || ::access(path.c_str(), R_OK) != 0) return nullptr;
    void* const library = ::dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (library == nullptr) {
        log::warn("peers: {} cannot be opened: {}; published figures stand in", path, ::dlerror());
        return nullptr;
    }
    const auto function = reinterpret_cast<KilnPeersFunction>(::dlsym(library, "kiln_peers"));
    const KilnPeerTable* const table = function != nullptr ? function() : nullptr;
    if (table == nullptr || table->version != kKilnPeerVersion) {
        log::warn("peers: {} is of another version; build it again, published figures stand in", path);
        return nullptr;
    }
    return table;
}

}  // namespace

const KilnPeerTable* peers() {
    static const KilnPeerTable* const table = open_plugin();
    return table;
}

std::vector<KilnPeerEdit> peer_edits(std::span<const Edit> edits) {
    std::vector<KilnPeerEdit> out;
    out.reserve(edits.size());
    for (const Edit& edit : edits) {
        KilnPeerEdit& e = out.emplace_back();
        const vec3 c = edit.node.transform.position;
        const bool box = edit.node.shape.kind == uint16_t(ShapeKind::Box);
        const auto& params = edit.node.shape.params;
        e = {{c.x, c.y, c.z},
             {params[0], box ? params[1] : params[0], box ? params[2] : params[0]},
             box ? 1u : 0u,
             edit.op == Op::Subtract ? 1u : 0u};
    }
    return out;
}

}  // namespace kiln::measure

// SPDX-License-Identifier: MIT

#include "scene/bundled.h"

#include "scene/json_source.h"

#include <kiln/world.h>

#include <algorithm>
#include <iterator>
#include <sys/stat.h>

namespace kiln::scene {

namespace {
#include "scene/bundled.gen.inl"
}  // namespace

std::span<const BundledScene> bundled_files() { return kBundled; }

namespace {

bool is_name(std::string_view scene) {
    return std::any_of(std::begin(kBundled), std::end(kBundled), [&](const auto& row) { return row.name == scene; });
}

}  // namespace

bool is_bundled(const SceneData& scene) {
    return scene.folder.empty() && !scene.source.empty() && is_name(scene.source.name());
}

std::span<const unsigned char> bundled_model(const SceneData& scene, std::string_view file) {
    if (!is_bundled(scene)) return {};
    const auto found =
        std::find_if(std::begin(kModels), std::end(kModels), [&](const auto& row) { return row.name == file; });
    return found == std::end(kModels) ? std::span<const unsigned char>{} : found->bytes;
}

}  // namespace kiln::scene

namespace kiln {

bool is_bundled_scene(const std::string& path_or_name) {
    struct stat info {};
    return scene::is_name(path_or_name) && ::stat(path_or_name.c_str(), &info) != 0;
}

std::string_view version() { return scene::kVersion; }

std::vector<std::pair<std::string, std::string>> bundled_scenes() {
    std::vector<std::pair<std::string, std::string>> out;
    for (const scene::BundledScene& file : scene::bundled_files()) {
        std::string description;
        if (auto document = scene::JsonDocument::parse(std::string(file.json), std::string(file.name)))
            if (const auto at = document->find(0, "description")) description = document->text(*at);
        out.emplace_back(file.name, std::move(description));
    }
    return out;
}

}  // namespace kiln

// SPDX-License-Identifier: MIT
#include "scene/moved_files.h"

#include "scene/json_source.h"
#include "scene/region.h"

#include <filesystem>
#include <vector>

namespace kiln::scene {

namespace {

namespace fs = std::filesystem;

fs::path whole(const std::string& folder) {
    std::error_code fault;
    const fs::path path = fs::absolute(folder.empty() ? "." : folder, fault);
    fs::path real = fs::weakly_canonical(path, fault);
    if (fault) real = path.lexically_normal();
    return real.has_filename() ? real : real.parent_path();
}

// Not where it holds what others have in a file: a region.
bool names_file(const JsonDocument& doc, JsonIndex i) {
    return doc.key(i) == "file" && doc.is(i, JsonType::String) && !doc.text(i).empty() &&
           !doc.text(i).starts_with(kRegion);
}

}  // namespace

std::vector<std::string> files_named(const std::string& scene, const std::string& folder) {
    std::vector<std::string> out;
    const auto doc = JsonDocument::parse(scene, "scene");
    if (!doc) return out;
    for (JsonIndex i = 0; i < doc->next(0); ++i)
        if (names_file(*doc, i)) out.push_back((fs::path(folder) / doc->text(i)).generic_string());
    return out;
}

std::string with_files_from(std::string scene, const std::string& from, const std::string& to) {
    const fs::path old_folder = whole(from), new_folder = whole(to);
    if (old_folder == new_folder) return scene;
    const auto doc = JsonDocument::parse(scene, "scene");
    if (!doc) return scene;
    JsonDocument out;
    bool moved = false;
    std::vector<JsonIndex> ends;  // of the containers that are open
    for (JsonIndex i = 0;; ++i) {
        while (!ends.empty() && ends.back() == i) {
            out.close();
            ends.pop_back();
        }
        if (i > 0 && ends.empty()) break;
        if (doc->is(i, JsonType::Object) || doc->is(i, JsonType::Array)) {
            out.open(doc->type(i), doc->key(i));
            ends.push_back(doc->next(i));
        } else if (names_file(*doc, i) && fs::path(doc->text(i)).is_relative()) {
            out.add_text((old_folder / doc->text(i)).lexically_normal().lexically_relative(new_folder).generic_string(),
                         doc->key(i));
            moved = true;
        } else {
            out.add_copy(*doc, i, doc->key(i));
        }
    }
    return moved ? out.print() : scene;
}

}  // namespace kiln::scene

// SPDX-License-Identifier: MIT
// Files that a scene names: which they are, and that they stay where they are when the scene goes elsewhere.
#pragma once

#include <string>
#include <vector>

namespace kiln::scene {

/// `scene`, the text of one in the folder `from`, as one in the folder `to`: every relative "file" in it leads to the same file. The same
/// text where both are one folder, or nothing is named. Folders are paths as a user gives them, "" the current one.
std::string with_files_from(std::string scene, const std::string& from, const std::string& to);

/// The files that `scene`, a text in that folder, names; each as often as it does.
std::vector<std::string> files_named(const std::string& scene, const std::string& folder);

}  // namespace kiln::scene

// SPDX-License-Identifier: MIT
// JSON Schema (2020-12) of the scene format, generated from the reader's own tables.
#pragma once

#include <string>

namespace kiln::scene {

std::string schema_json();

}  // namespace kiln::scene

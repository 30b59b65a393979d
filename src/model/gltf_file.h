// SPDX-License-Identifier: MIT
// glTF 2.0, text and binary, through tinygltf, and safe ways into what it holds. For the files of this folder.
#pragma once

#include "model/matrix.h"

#include <kiln/result.h>

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

// Images stay as bytes: image/png_file.h and jpeg_file.h decode them.
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#include <tiny_gltf.h>

namespace kiln::model {

/// `folder`, with its slash, is where files beside this one are. Nothing is thrown.
Result<tinygltf::Model> load_gltf(std::string_view bytes, const std::string& name, const std::string& folder);

/// "NAME: refers to WHAT; the file is damaged, export it again".
Error gltf_fault(const std::string& name, const std::string& what);

/// An accessor's elements, `stride` apart, all there.
struct AccessorBytes {
    const unsigned char* at = nullptr;
    size_t stride = 0;
    size_t count = 0;
    std::shared_ptr<const std::vector<unsigned char>>
        made;  ///< where no buffer has them as they are: of a sparse accessor
};
/// `element`: bytes of one. Errors name the file.
Result<AccessorBytes> accessor_bytes(const tinygltf::Model& model, const tinygltf::Accessor& accessor, size_t element,
                                     const std::string& name);

/// Translation, rotation and scale, or a matrix.
Matrix node_matrix(const tinygltf::Node& node);

}  // namespace kiln::model

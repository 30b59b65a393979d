// SPDX-License-Identifier: MIT

#include "image/file.h"

#include "base/format.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

namespace kiln::image {

Result<std::vector<std::byte>> read_bytes(const std::string& path) {
    auto failure = [&](int error) {
        return Error{formatted("cannot read {}: {}", path, std::strerror(error)), ErrorKind::Input};
    };
    const std::unique_ptr<FILE, int (*)(FILE*)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
    if (!file) return failure(errno);
    std::vector<std::byte> bytes;
    for (;;) {
        const size_t old = bytes.size();
        bytes.resize(old + (old < (1u << 16) ? (1u << 16) : old));
        errno = 0;
        const size_t got = std::fread(bytes.data() + old, 1, bytes.size() - old, file.get());
        bytes.resize(old + got);
        if (std::ferror(file.get())) return failure(errno ? errno : EIO);
        if (got == 0) return bytes;
    }
}

}  // namespace kiln::image

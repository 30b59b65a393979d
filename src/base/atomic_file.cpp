// SPDX-License-Identifier: MIT
#include "base/atomic_file.h"

#include "base/format.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace kiln {
namespace {

// Temporaries that exist now, where a signal handler can find them without a lock: slots are claimed by state.
struct Slot {
    std::atomic<int> state = 0;  // 0 free, 1 being written, 2 holds a path
    char path[PATH_MAX] = {};
};
std::array<Slot, 32> slots;

int remember(const std::string& path) {
    for (size_t i = 0; i < slots.size(); ++i) {
        int expected = 0;
        if (path.size() < sizeof slots[i].path && slots[i].state.compare_exchange_strong(expected, 1)) {
            std::memcpy(slots[i].path, path.c_str(), path.size() + 1);
            slots[i].state = 2;
            return int(i);
        }
    }
    return -1;  // more open at once than slots: only a signal would leave this one behind
}

void forget(int slot) {
    if (slot >= 0) slots[size_t(slot)].state = 0;
}

// The file a name leads to, also when the last link points to something that does not exist yet.
std::string followed(std::string path) {
    for (int links = 0; links < 40; ++links) {
        char next[PATH_MAX];
        const ssize_t size = readlink(path.c_str(), next, sizeof next);
        if (size < 0 || size >= ssize_t(sizeof next)) break;
        const std::string target(next, size_t(size));
        const size_t slash = path.rfind('/');
        path = target.starts_with('/') || slash == std::string::npos ? target : path.substr(0, slash + 1) + target;
    }
    return path;
}

// umask() can only be read by setting it: once, before there are threads.
const mode_t process_umask = [] {
    const mode_t mask = umask(0);
    umask(mask);
    return mask;
}();

std::string folder_of(const std::string& path) {
    const size_t slash = path.rfind('/');
    return slash == std::string::npos ? "." : slash == 0 ? "/" : path.substr(0, slash);
}

}  // namespace

Error AtomicFile::failure(int error) const {
    return {formatted("cannot write {}: {}", path_, std::strerror(error)), ErrorKind::Failed};
}

Result<AtomicFile> AtomicFile::create(const std::string& path) {
    AtomicFile file;
    file.path_ = path;
    file.target_ = followed(path);
    if (path.empty()) return file.failure(ENOENT);

    struct stat old;
    const bool exists = stat(file.target_.c_str(), &old) == 0;
    if (exists && S_ISDIR(old.st_mode)) return file.failure(EISDIR);
    if (exists && !S_ISREG(old.st_mode)) {
        file.temporary_ = file.target_;
        file.stream_ = std::fopen(file.target_.c_str(), "wb");
        if (!file.stream_) return file.failure(errno);
        return file;
    }
    // A file that may not be written must not be replaced either, though rename() would allow it.
    if (exists && access(file.target_.c_str(), W_OK) != 0) return file.failure(errno);

    const size_t slash = file.target_.rfind('/');
    const std::string name = slash == std::string::npos ? file.target_ : file.target_.substr(slash + 1);
    if (name.empty()) return file.failure(EISDIR);
    // The extension stays last: libraries choose a format by it. Long names are cut to keep the sum within a file system's 255.
    const size_t dot = name.rfind('.');
    const std::string extension = dot == std::string::npos || name.size() - dot > 16 ? "" : name.substr(dot);
    file.temporary_ = formatted("{}/.{}.XXXXXX{}", folder_of(file.target_), name.substr(0, 200), extension);
    const int fd = mkostemps(file.temporary_.data(), int(extension.size()), O_CLOEXEC);
    if (fd < 0) return file.failure(errno);
    file.slot_ = remember(file.temporary_);
    const mode_t mode = exists ? (old.st_mode & 07777) : (0666 & ~process_umask);
    if (fchmod(fd, mode) == 0) file.stream_ = fdopen(fd, "wb");
    if (!file.stream_) {
        const int error = errno;
        close(fd);
        file.discard();
        return file.failure(error);
    }
    return file;
}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept { *this = std::move(other); }

AtomicFile& AtomicFile::operator=(AtomicFile&& other) noexcept {
    if (this == &other) return *this;
    discard();
    path_ = std::exchange(other.path_, {});
    target_ = std::exchange(other.target_, {});
    temporary_ = std::exchange(other.temporary_, {});
    stream_ = std::exchange(other.stream_, nullptr);
    slot_ = std::exchange(other.slot_, -1);
    failed_ = std::exchange(other.failed_, 0);
    return *this;
}

AtomicFile::~AtomicFile() { discard(); }

void AtomicFile::discard() noexcept {
    if (stream_) std::fclose(stream_);
    stream_ = nullptr;
    if (!temporary_.empty() && temporary_ != target_) unlink(temporary_.c_str());
    temporary_.clear();
    forget(std::exchange(slot_, -1));
}

Result<void> AtomicFile::write(std::span<const std::byte> bytes) {
    if (!stream_) return failure(EBADF);
    if (std::fwrite(bytes.data(), 1, bytes.size(), stream_) != bytes.size()) {
        if (!failed_) failed_ = errno ? errno : EIO;
        return failure(failed_);
    }
    return {};
}

Result<void> AtomicFile::commit() {
    if (!stream_) return failure(EBADF);
    const bool direct = temporary_ == target_;
    int error = failed_;
    if (!error && std::fflush(stream_) != 0) error = errno;
    if (!error && std::ferror(stream_)) error = EIO;
    if (!error && !direct && fsync(fileno(stream_)) != 0) error = errno;
    if (std::fclose(stream_) != 0 && !error) error = errno;
    stream_ = nullptr;
    if (!error && !direct && rename(temporary_.c_str(), target_.c_str()) != 0) error = errno;
    if (error) {
        discard();
        return failure(error);
    }
    temporary_.clear();  // it is the target now
    forget(std::exchange(slot_, -1));
    if (!direct) {  // the new name itself must reach the disk; a folder that cannot be opened still holds a whole file
        const int folder = open(folder_of(target_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
        if (folder >= 0) {
            fsync(folder);
            close(folder);
        }
    }
    return {};
}

void AtomicFile::remove_temporaries_from_signal() noexcept {
    for (Slot& slot : slots) {
        if (slot.state == 2) unlink(slot.path);
    }
}

}  // namespace kiln

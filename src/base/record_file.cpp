// SPDX-License-Identifier: MIT

#include "base/record_file.h"

#include "base/format.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <limits>
#include <optional>
#include <thread>
#include <utility>

namespace kiln {
namespace {

static_assert(std::endian::native == std::endian::little, "files are little-endian");

constexpr std::string_view kMagic = "KILNREC1";
constexpr size_t kHeaderBytes = 32;
constexpr uint32_t kMostPayload = 1u << 30;

template <typename T>
T take(std::string_view bytes, size_t at) {
    T value;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
}
template <typename T>
void put(std::string& out, T value) {
    out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

uint64_t record_checksum(uint64_t before, uint32_t length, uint32_t sequence, std::string_view payload) {
    return hash64(payload, hash_combine(before, uint64_t(length) << 32 | sequence));
}

std::string header_of(const Hash128& base) {
    std::string out(kMagic);
    put(out, base.low);
    put(out, base.high);
    put(out, hash64(out));
    return out;
}

Error failure(const std::string& path, int error) {
    return {formatted("cannot write {}: {}", path, std::strerror(error)), ErrorKind::Failed};
}

}  // namespace

Records read_records(std::string_view bytes) {
    Records out;
    if (bytes.empty()) return out;
    if (bytes.size() < kHeaderBytes || !bytes.starts_with(kMagic) ||
        take<uint64_t>(bytes, 24) != hash64(bytes.substr(0, 24))) {
        out.fault = bytes.size() < kHeaderBytes  ? "its header is cut short"
                    : !bytes.starts_with(kMagic) ? "it does not begin as a journal does"
                                                 : "its header is damaged";
        return out;
    }
    out.has_header = true;
    out.base = {take<uint64_t>(bytes, 8), take<uint64_t>(bytes, 16)};
    out.checksum = take<uint64_t>(bytes, 24);
    size_t at = kHeaderBytes;
    while (at < bytes.size()) {
        const size_t left = bytes.size() - at;
        const uint32_t expected = uint32_t(out.payloads.size()) + 1;
        const uint32_t length = left < kRecordHeaderBytes ? 0 : take<uint32_t>(bytes, at);
        if (left < kRecordHeaderBytes || (length <= kMostPayload && length > left - kRecordHeaderBytes)) {
            out.fault = formatted("record {} is cut short", expected);
            break;
        }
        const uint32_t sequence = take<uint32_t>(bytes, at + 4);
        const std::string_view payload =
            length <= kMostPayload ? bytes.substr(at + kRecordHeaderBytes, length) : std::string_view();
        const uint64_t checksum = record_checksum(out.checksum, length, sequence, payload);
        if (length > kMostPayload || sequence != expected || take<uint64_t>(bytes, at + 8) != checksum) {
            out.fault = formatted("record {} is damaged", expected);
            break;
        }
        out.payloads.push_back(payload);
        out.checksum = checksum;
        at += kRecordHeaderBytes + length;
    }
    out.good_bytes = std::min(at, bytes.size());
    return out;
}

CommitClock::Time CommitClock::now() { return std::chrono::steady_clock::now(); }
void CommitClock::wait(std::condition_variable& wake, std::unique_lock<std::mutex>& lock, Time until) {
    if (until == Time::max())
        wake.wait(lock);
    else
        wake.wait_until(lock, until);
}
int CommitClock::sync(int fd) { return fdatasync(fd) == 0 ? 0 : errno; }

struct RecordFile::Impl {
    CommitClock system_clock;
    CommitClock* clock = &system_clock;
    std::string path;
    int fd = -1;
    bool held = false;            // the lock is ours
    uint64_t end = 0;             // bytes; what lies behind is a write that failed
    uint32_t sequence = 1;        // of the next record
    uint64_t checksum = 0;        // of the last
    bool torn = false;            // there may be something behind `end`
    std::optional<Hash128> owed;  // the header that restart() could not write
    std::string buffer;

    // The thread that syncs.
    std::mutex mutex;
    std::condition_variable wake;
    bool dirty = false, stopping = false;
    CommitClock::Time due;  // while dirty
    int failed = 0;         // errno of a flush that did not work
    std::thread flusher;

    ~Impl() {
        {
            const std::lock_guard lock(mutex);
            stopping = true;
        }
        wake.notify_one();
        if (flusher.joinable()) flusher.join();
        if (fd < 0) return;
        struct stat info {};
        if (held && sequence == 1 && fstat(fd, &info) == 0 && info.st_size <= off_t(kHeaderBytes)) unlink(path.c_str());
        close(fd);  // gives the lock back
    }

    void run() {
        std::unique_lock lock(mutex);
        while (dirty || !stopping) {
            if (!stopping && (!dirty || clock->now() < due)) {
                clock->wait(wake, lock, dirty ? due : CommitClock::Time::max());
                continue;
            }
            dirty = false;
            lock.unlock();
            const int error = clock->sync(fd);
            lock.lock();
            if (error) failed = error;
        }
    }

    // What comes during a sync counts from itself: else it would wait for that sync, kGroupCommit, and its own.
    void changed() {
        {
            const std::lock_guard lock(mutex);
            if (dirty) return;
            dirty = true;
            due = clock->now() + kGroupCommit;
            if (!flusher.joinable()) flusher = std::thread([this] { run(); });
        }
        wake.notify_one();
    }

    // Everything or nothing; 0 or errno.
    int write_at_end(std::string_view bytes) {
        {
            const std::lock_guard lock(mutex);
            if (failed) return failed;
        }
        if (torn) {
            if (ftruncate(fd, off_t(end)) != 0) return errno;
            torn = false;
        }
        size_t done = 0;
        while (done < bytes.size()) {
            const ssize_t n = pwrite(fd, bytes.data() + done, bytes.size() - done, off_t(end + done));
            if (n < 0 && errno == EINTR) continue;
            if (n <= 0) {
                const int error = n < 0 ? errno : EIO;
                torn = done > 0 && ftruncate(fd, off_t(end)) != 0;
                return error;
            }
            done += size_t(n);
        }
        end += bytes.size();
        return 0;
    }
};

RecordFile::RecordFile(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RecordFile::RecordFile(RecordFile&&) noexcept = default;
RecordFile& RecordFile::operator=(RecordFile&&) noexcept = default;
RecordFile::~RecordFile() = default;
const std::string& RecordFile::path() const { return impl_->path; }
uint32_t RecordFile::next_sequence() const { return impl_->sequence; }
uint64_t RecordFile::bytes() const { return impl_->end; }

Result<RecordFile> RecordFile::open(const std::string& path, std::string& bytes, CommitClock* clock) {
    auto impl = std::make_unique<Impl>();
    if (clock) impl->clock = clock;
    impl->path = path;
    for (int attempt = 0;; ++attempt) {
        impl->fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
        if (impl->fd < 0) return failure(path, errno);
        if (flock(impl->fd, LOCK_EX | LOCK_NB) == 0) {
            // Its last holder may have taken the name away between the two calls.
            struct stat ours {
            }, named{};
            if (fstat(impl->fd, &ours) == 0 && stat(path.c_str(), &named) == 0 && ours.st_ino == named.st_ino &&
                ours.st_dev == named.st_dev) {
                impl->held = true;
                break;
            }
        } else if (errno != EWOULDBLOCK) {
            return failure(path, errno);
        } else if (attempt >= 5) {
            return Error{path + ": held by a program that edits this scene; close it there first", ErrorKind::Failed};
        } else {
            std::this_thread::sleep_for(std::chrono::milliseconds(10));  // is_held() holds it for an instant
        }
        close(std::exchange(impl->fd, -1));
    }
    bytes.clear();
    std::array<char, 65536> part;
    while (true) {
        const ssize_t n = pread(impl->fd, part.data(), part.size(), off_t(bytes.size()));
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return Error{formatted("{}: cannot be read: {}", path, std::strerror(errno)), ErrorKind::Input};
        if (n == 0) break;
        bytes.append(part.data(), size_t(n));
    }
    impl->end = bytes.size();
    if (bytes.empty()) {  // perhaps new: its name must be on the disk before a record counts as being there
        const size_t slash = path.rfind('/');
        const int folder = ::open(slash == std::string::npos ? "." : path.substr(0, slash + 1).c_str(),
                                  O_RDONLY | O_DIRECTORY | O_CLOEXEC);
        if (folder >= 0) {
            fsync(folder);
            close(folder);
        }
    }
    return RecordFile(std::move(impl));
}

bool RecordFile::is_held(const std::string& path) {
    const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (fd < 0) return false;
    const bool held = flock(fd, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
    close(fd);
    return held;
}

Result<void> RecordFile::resume(const Records& records) {
    if (ftruncate(impl_->fd, off_t(records.good_bytes)) != 0) return failure(impl_->path, errno);
    impl_->end = records.good_bytes;
    impl_->sequence = uint32_t(records.payloads.size()) + 1;
    impl_->checksum = records.checksum;
    impl_->torn = false;
    return {};
}

Result<void> RecordFile::restart(const Hash128& base) {
    // First nothing, then the header: between the two the file is empty, which is right for a scene just saved.
    if (ftruncate(impl_->fd, 0) != 0) return failure(impl_->path, errno);
    impl_->end = 0;
    impl_->owed = base;
    const std::string header = header_of(base);
    if (const int error = impl_->write_at_end(header)) return failure(impl_->path, error);
    impl_->owed.reset();
    impl_->sequence = 1;
    impl_->checksum = take<uint64_t>(header, 24);
    impl_->changed();
    return {};
}

Result<void> RecordFile::append(std::string_view payload) {
    Impl& m = *impl_;
    if (payload.size() > kMostPayload || m.sequence == std::numeric_limits<uint32_t>::max())
        return Error{m.path + ": full; save the scene", ErrorKind::Failed};
    if (m.owed)
        if (auto begun = restart(Hash128(*m.owed)); !begun) return begun;
    const auto length = uint32_t(payload.size());
    const uint64_t checksum = record_checksum(m.checksum, length, m.sequence, payload);
    m.buffer.clear();
    put(m.buffer, length);
    put(m.buffer, m.sequence);
    put(m.buffer, checksum);
    m.buffer += payload;
    if (const int error = m.write_at_end(m.buffer)) return failure(m.path, error);
    m.checksum = checksum;
    ++m.sequence;
    m.changed();
    return {};
}

Result<void> RecordFile::flush() {
    Impl& m = *impl_;
    {
        const std::lock_guard lock(m.mutex);
        m.dirty = false;
    }
    const int error = m.clock->sync(m.fd);
    const std::lock_guard lock(m.mutex);
    if (error) m.failed = error;
    return m.failed ? Result<void>(failure(m.path, m.failed)) : Result<void>();
}

}  // namespace kiln

// SPDX-License-Identifier: MIT
// RecordFile: an append-only file of records for journals. A record that append() has taken survives the end of this process at once, and a
// power cut a tenth of a second later at most, where the disk syncs in half of that. What a broken file still holds for certain can always be told:
//   header   "KILNREC1"  base.low  base.high  checksum                   eight bytes each, little-endian
//   record   length (4)  sequence (4)  checksum (8)  payload             sequences count from 1
// A checksum covers its record and the checksum before it, so a record is right only at its own place in its own file.
#pragma once

#include "base/hash.h"

#include <kiln/result.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace kiln {

/// Before a record's payload.
inline constexpr size_t kRecordHeaderBytes = 16;

/// What the bytes of such a file hold.
struct Records {
    bool has_header = false;
    Hash128 base;                            ///< what the file says it continues
    std::vector<std::string_view> payloads;  ///< in the bytes; the record's sequence is its index + 1
    size_t good_bytes = 0;                   ///< header and records up to the first that is broken; 0 without a header
    uint64_t checksum = 0;                   ///< of the last good one
    std::string fault;                       ///< why the rest is not taken; empty when there is no rest
};
/// Reads any bytes. The payloads look into them.
Records read_records(std::string_view bytes);

/// From the first record that is not on the disk to the sync that brings it and all before it there.
inline constexpr std::chrono::milliseconds kGroupCommit{50};

/// Time and disk, as the thread that syncs a RecordFile sees them. A test brings its own.
class CommitClock {
public:
    using Time = std::chrono::steady_clock::time_point;
    virtual ~CommitClock() = default;
    virtual Time now();
    /// Until woken or `until`, or for no reason; the lock is held again when it returns.
    virtual void wait(std::condition_variable& wake, std::unique_lock<std::mutex>& lock, Time until);
    /// What was written is on the disk when this returns; 0 or errno. From any thread.
    virtual int sync(int fd);
};

/// A file without records is removed when it is closed.
class RecordFile {
public:
    /// Opens or creates the file for one writer: fails while another holds it, in this process or another. `bytes` is what was in it.
    /// A clock outlives the file; none: the system's.
    static Result<RecordFile> open(const std::string& path, std::string& bytes, CommitClock* clock = nullptr);
    /// Whether some writer holds the file now.
    static bool is_held(const std::string& path);
    RecordFile(RecordFile&&) noexcept;
    RecordFile& operator=(RecordFile&&) noexcept;
    ~RecordFile();

    const std::string& path() const;
    /// Sequence of the next record.
    uint32_t next_sequence() const;
    uint64_t bytes() const;

    /// Continues after the good part of what was read; what lies behind it is cut off.
    Result<void> resume(const Records& records);
    /// Empties the file and begins it anew.
    Result<void> restart(const Hash128& base);
    /// Written when this returns; where it fails the file is as it was.
    Result<void> append(std::string_view payload);
    /// On the disk when this returns, with all before it.
    Result<void> flush();

private:
    struct Impl;
    explicit RecordFile(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace kiln

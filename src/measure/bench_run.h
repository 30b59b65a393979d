// SPDX-License-Identifier: MIT
// What a family of rows gets to do its work with: options, which rows are wanted, where results and faults go.
#pragma once

#include "base/format.h"
#include "base/hash.h"

#include <kiln/bench.h>

#include <optional>
#include <set>

namespace kiln::measure {

class BenchRun {
public:
    BenchRun(const BenchOptions& asked, std::set<std::string> rows, const BenchProgress& progress, double stages)
        : options(asked), rows_(std::move(rows)), progress_(progress), stages_(stages) {}

    const BenchOptions options;

    bool wanted(std::string_view family, std::string_view row) const {
        return rows_.contains(formatted("{}/{}", family, row));
    }
    void stage(std::string_view what) {
        if (progress_) progress_(what, stages_ > 0 ? stage_ / stages_ : 0);
        stage_ += 1;
    }
    void add(BenchRow row) { out_.push_back(std::move(row)); }
    /// A row whose result must equal the slow way's; a difference ends the run with an error.
    void add_checked(BenchRow row, uint64_t checksum, uint64_t slow_way) {
        row.checksum = hex(checksum);
        if (checksum != slow_way && !fault_)
            fault_ =
                Error{formatted("bench {} (kind {}, seed {}, {} edits): checksum {} differs from the slow way's {}; "
                                "the figure is of wrong work, please report it",
                                row.name, row.kind, row.seed, row.count, row.checksum, hex(slow_way)),
                      ErrorKind::Failed};
        add(std::move(row));
    }
    void fail(Error error) {
        if (!fault_) fault_ = std::move(error);
    }
    const std::optional<Error>& fault() const { return fault_; }
    std::vector<BenchRow> take() { return std::move(out_); }

private:
    std::set<std::string> rows_;  // "family/row"
    const BenchProgress& progress_;
    double stages_, stage_ = 0;
    std::vector<BenchRow> out_;
    std::optional<Error> fault_;
};

/// A family: its words, how many stages it reports, and its work.
struct BenchFamily {
    BenchInfo info;
    void (*run)(BenchRun&);
};
BenchFamily edits_family();
BenchFamily expression_family();
BenchFamily field_family();
BenchFamily frame_family();
BenchFamily gpu_family();
BenchFamily journal_family();
BenchFamily physics_family();
BenchFamily world_family();

}  // namespace kiln::measure

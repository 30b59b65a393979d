// SPDX-License-Identifier: MIT
// `bench journal`: changing a world that keeps a journal, reading it again, and undoing. What was done live must read back as the same text.

#include "measure/bench_run.h"

#include "measure/contest.h"
#include "measure/journal_work.h"
#include "measure/recipes.h"

#include <algorithm>

namespace kiln::measure {
namespace {

constexpr uint32_t kAppendedAnEdit = 100;   // commands of `append` an edit of the world
constexpr uint32_t kReopenedAnEdit = 1000;  // and of `reopen`
constexpr uint32_t kUndone = 20;
constexpr int kMostReopened = 3;  // times: each is seconds

class JournalRows {
public:
    JournalRows(BenchRun& run, int kind)
        : run_(run),
          kind_(kind),
          work_(recipe(kind, run.options.seed, run.options.count), 2.0f / float(run.options.resolution)) {}

    void all() {
        if (run_.wanted("journal", "append")) append();
        if (run_.wanted("journal", "reopen")) reopen();
        if (run_.wanted("journal", "undo")) undo();
    }

private:
    BenchRow row(std::string name, double value, std::string unit, bool more_is_better = false) const {
        BenchRow out;
        out.name = std::move(name);
        out.value = value;
        out.unit = std::move(unit);
        out.more_is_better = more_is_better;
        out.kind = kind_;
        out.seed = run_.options.seed;
        out.count = run_.options.count;
        return out;
    }
    static void compare(BenchRow& row, std::string peer, double value) {
        row.peer = std::move(peer);
        row.peer_value = value;
        row.ratio = row.more_is_better ? row.value / value : value / row.value;
    }
    void must(const Result<void>& done) {
        if (!done) run_.fail(done.error());
    }

    void append() {
        run_.stage("append");
        const uint32_t commands = run_.options.count * kAppendedAnEdit;
        const auto turn = [&](bool journaled) {
            must(work_.prepare(journaled));
            return run_.fault() ? 1e300 : seconds_of([&] { must(work_.change(commands)); });
        };
        uint64_t live = 0, read = 0;
        const std::vector<double> least = least_seconds(run_.options.runs, {[&] { return turn(false); },
                                                                            [&] {
                                                                                const double s = turn(true);
                                                                                if (run_.fault()) return s;
                                                                                live = work_.hash();
                                                                                const auto again = work_.reopen();
                                                                                if (!again)
                                                                                    return run_.fail(again.error()), s;
                                                                                read = *again;
                                                                                return s;
                                                                            }});
        if (run_.fault()) return;
        BenchRow out = row("append", commands / least[1], "1/s", true);
        compare(out, "the same world without a journal", commands / least[0]);
        run_.add_checked(out, read, live);
    }

    void reopen() {
        run_.stage("reopen");
        must(work_.prepare(true));
        if (!run_.fault()) must(work_.change(run_.options.count * kReopenedAnEdit));
        if (run_.fault()) return;
        Result<uint64_t> read = Error{};
        double least = 1e300;
        for (int i = 0; i < std::min(run_.options.runs, kMostReopened); ++i)
            least = std::min(least, seconds_of([&] { read = work_.reopen(); }));
        if (!read) return run_.fail(read.error());
        run_.add_checked(row("reopen", least, "s"), *read, work_.hash());
    }

    void undo() {
        run_.stage("undo");
        must(work_.prepare(false));
        if (run_.fault()) return;
        const uint64_t before = work_.hash();
        double edits = 0, undos = 0;
        for (uint32_t i = 0; i < kUndone && !run_.fault(); ++i) {
            const std::vector<double> least =
                least_seconds(run_.options.runs, {[&] { return seconds_of([&] { must(work_.edit(i)); }); },
                                                  [&] { return seconds_of([&] { must(work_.undo()); }); }});
            edits += least[0];
            undos += least[1];
        }
        BenchRow out = row("undo", undos / kUndone * 1e6, "us");
        compare(out, "the edit itself", edits / kUndone * 1e6);
        run_.add_checked(out, work_.hash(), before);
    }

    BenchRun& run_;
    int kind_;
    JournalWork work_;
};

}  // namespace

BenchFamily journal_family() {
    return {{"journal",
             "a world that keeps a journal: commands a second, reading them again, undo beside the edit it takes back",
             {"append", "reopen", "undo"}},
            [](BenchRun& run) {
                for (const int kind : run.options.kinds)
                    if (!run.fault()) JournalRows(run, kind).all();
            }};
}

}  // namespace kiln::measure

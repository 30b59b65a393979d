// SPDX-License-Identifier: MIT
#include "measure/bench_run.h"

#include "base/parallel_for.h"
#include "base/suggest.h"
#include "sdf/eval.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>

namespace kiln {

using namespace measure;

namespace {

const std::vector<BenchFamily>& families() {
    static const std::vector<BenchFamily> all{field_family(),   edits_family(),   expression_family(), world_family(),
                                              physics_family(), journal_family(), frame_family(),      gpu_family()};
    return all;
}

std::string machine() {
    std::string name = "unknown processor", line;
    std::ifstream in("/proc/cpuinfo");
    while (std::getline(in, line)) {
        if (!line.starts_with("model name")) continue;
        name = line.substr(std::min(line.find(':') + 2, line.size()));
        break;
    }
    constexpr const char* kIsas[] = {"scalar", "SSE4", "AVX2", "AVX-512"};
    return formatted("{}, {}, {} cores", name, kIsas[size_t(sdf::best_isa())], hardware_workers());
}

double load() {
    double minute = 0;
    return ::getloadavg(&minute, 1) == 1 ? minute : 0;
}

std::optional<Error> fault_of(const BenchOptions& o) {
    const auto usage = [](std::string text) { return Error{std::move(text), ErrorKind::Usage}; };
    if (o.kinds.empty()) return usage("bench: no kind; there are 0 (pebbles), 1 (carve) and 2 (cluster)");
    for (const int kind : o.kinds)
        if (kind < 0 || kind > 2)
            return usage(
                formatted("bench: there is no kind {}; there are 0 (pebbles), 1 (carve) and 2 (cluster)", kind));
    if (o.count < 1 || o.count > kMostBenchEdits)
        return usage(formatted("bench: {} edits; between 1 and {} are possible", o.count, kMostBenchEdits));
    if (o.threads < 0 || o.threads > 1024)
        return usage(formatted("bench: {} threads; between 1 and 1024 are possible", o.threads));
    if (o.runs < 1 || o.runs > 10000)
        return usage(formatted("bench: {} runs; between 1 and 10000 are possible", o.runs));
    if (o.resolution < 16 || o.resolution > 1024)
        return usage(formatted("bench: {} voxels a side; between 16 and 1024 are possible", o.resolution));
    for (const auto& [width, height] : o.sizes)
        if (width < 1 || height < 1 || width > 16384 || height > 16384)
            return usage(formatted("bench: pictures of {}x{}; sides of 1 to 16384 are possible", width, height));
    return std::nullopt;
}

}  // namespace

std::vector<BenchInfo> bench_list() {
    std::vector<BenchInfo> out;
    for (const BenchFamily& family : families()) out.push_back(family.info);
    return out;
}

Result<BenchReport> run_bench(std::span<const std::string> names, const BenchOptions& options,
                              const BenchProgress& progress) {
    if (auto fault = fault_of(options)) return std::move(*fault);
    const std::string field = "field";
    if (!options.scene.empty()) {
        if (names.empty()) names = {&field, 1};
        for (const std::string& name : names)
            if ((name != field && !name.starts_with("field/")) || name.starts_with("field/edit.") ||
                name == "field/undo")
                return Error{formatted("bench {}: not of a scene; --scene is for the rows of field but edit.* and "
                                       "undo, such as field/bake",
                                       name),
                             ErrorKind::Usage};
    }
    std::set<std::string> rows;
    for (const BenchFamily& family : families()) {
        const std::string prefix = std::string(family.info.name) + "/";
        if (names.empty() || std::ranges::count(names, family.info.name) != 0)
            for (const std::string_view row : family.info.rows) rows.insert(prefix + std::string(row));
        for (const std::string_view row : family.info.rows)
            if (std::ranges::count(names, prefix + std::string(row)) != 0) rows.insert(prefix + std::string(row));
    }
    for (const std::string& name : names) {
        const bool known = std::ranges::any_of(
            families(), [&](const BenchFamily& family) { return name == family.info.name || rows.contains(name); });
        if (known) continue;
        std::vector<std::string> all;
        for (const BenchFamily& family : families()) {
            all.emplace_back(family.info.name);
            for (const std::string_view row : family.info.rows)
                all.push_back(all.back().substr(0, family.info.name.size()) + "/" + std::string(row));
        }
        const std::vector<std::string_view> words(all.begin(), all.end());
        return Error{formatted("there is no benchmark \"{}\"; {}", name,
                               suggestion(name, words, "`kiln bench --list` names them")),
                     ErrorKind::Usage};
    }
    BenchReport report;
    report.machine = machine();
    report.load = load();
    BenchRun run(options, rows, progress, double(rows.size() * options.kinds.size()));
    for (const BenchFamily& family : families()) family.run(run);
    report.load = std::max(report.load, load());
    if (run.fault()) return *run.fault();
    report.rows = run.take();
    return report;
}

}  // namespace kiln

// SPDX-License-Identifier: MIT
// kiln bench [NAME...]: how fast this machine does the engine's work, beside its peers and its roofs.

#include "cli/json.h"
#include "cli/talk.h"
#include "cli/verbs.h"

#include <kiln/bench.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <utility>

namespace kiln::cli {

namespace {

struct BenchWords {
    std::vector<std::string> names;
    BenchOptions bench;
    std::vector<std::string> sizes;
    bool list = false, json = false;
};

// Three digits that count.
std::string short_number(double value) {
    if (!std::isfinite(value)) return "-";
    char text[40];
    const int size = value == 0 ? 0 : int(std::floor(std::log10(std::abs(value))));
    std::snprintf(text, sizeof text, "%.*f", std::clamp(2 - size, 0, 4), value);
    return text;
}

// Letters of UTF-8 text; the table's columns count those.
size_t letters(std::string_view text) {
    return size_t(std::ranges::count_if(text, [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

void print_table(const std::vector<std::vector<std::string>>& rows, std::string& out) {
    std::vector<size_t> width;
    for (const auto& row : rows) {
        width.resize(std::max(width.size(), row.size()));
        for (size_t i = 0; i < row.size(); ++i) width[i] = std::max(width[i], letters(row[i]));
    }
    for (const auto& row : rows) {
        std::string line;
        for (size_t i = 0; i < row.size(); ++i) {
            const std::string gap(width[i] - letters(row[i]), ' ');
            line += i == 0 ? row[i] + gap : "  " + gap + row[i];  // words left, numbers right
        }
        line.erase(line.find_last_not_of(' ') + 1);
        out += line + "\n";
    }
}

std::string table_of(const BenchReport& report) {
    std::string out = report.machine + "; load " + short_number(report.load) + "\n";
    std::vector<std::vector<std::string>> rows;
    std::pair<int, std::string> under;  // which scene the rows are of
    for (const BenchRow& r : report.rows) {
        if (std::pair(r.kind, r.scene) != under || rows.empty()) {
            if (!rows.empty()) print_table(rows, out);
            out += "\n" +
                   (r.scene.empty() ? "kind " + std::to_string(r.kind) + ", seed " + std::to_string(r.seed) : r.scene) +
                   ", " + std::to_string(r.count) + " edits\n";
            rows = {{"row", "value", "unit", "threads", "peer", "peer's", "ratio", "of roof", "bricks", "texels",
                     "checksum"}};
            under = {r.kind, r.scene};
        }
        rows.push_back({r.name, short_number(r.value), r.unit, std::to_string(r.threads), r.peer.empty() ? "-" : r.peer,
                        short_number(r.peer_value), short_number(r.ratio),
                        std::isfinite(r.roof_ratio) ? short_number(100 * r.roof_ratio) + " %" : "-",
                        r.texels > 0 ? short_number(r.bricks) : "-", r.texels > 0 ? std::to_string(r.texels) : "-",
                        r.checksum});
    }
    if (!rows.empty()) print_table(rows, out);
    out +=
        "\nratio: above 1, Kiln is better. of roof: share of what the processor could do at best. bricks, texels: "
        "baked.\n";
    return out;
}

std::string json_of(const BenchReport& report) {
    std::string rows;
    for (const BenchRow& r : report.rows) {
        Json row;
        row.text("name", r.name).number("value", r.value).text("unit", r.unit).number("threads", r.threads);
        if (r.peer.empty()) {
            row.raw("peer", "null");
        } else {
            row.text("peer", r.peer);
        }
        row.number("peer_value", r.peer_value).number("ratio", r.ratio).number("roof_ratio", r.roof_ratio);
        row.number("bricks", r.bricks).number("texels", double(r.texels));
        if (!r.scene.empty()) row.text("scene", r.scene);
        row.text("checksum", r.checksum).number("kind", r.kind).number("seed", r.seed).number("count", r.count);
        rows += (rows.empty() ? "" : ", ") + row.object();
    }
    Json json;
    json.text("machine", report.machine).number("load", report.load).raw("rows", "[" + rows + "]");
    return json.line();
}

int list(bool json) {
    std::string out, families;
    for (const BenchInfo& info : bench_list()) {
        out += std::string(info.name) + ": " + std::string(info.about) + "\n";
        std::string rows;
        for (const std::string_view row : info.rows) {
            out += "  " + std::string(info.name) + "/" + std::string(row) + "\n";
            rows += (rows.empty() ? "" : ", ") + Json::quoted(row);
        }
        Json family;
        family.text("name", info.name).text("about", info.about).raw("rows", "[" + rows + "]");
        families += (families.empty() ? "" : ", ") + family.object();
    }
    (void)put(json ? Json().raw("benchmarks", "[" + families + "]").line() : out);
    return finish_data();
}

int bench(BenchWords o) {
    if (o.list) return list(o.json);
    if (!o.sizes.empty()) o.bench.sizes.clear();
    for (const std::string& size : o.sizes) {
        int width = 0, height = 0, read = 0;
        if (std::sscanf(size.c_str(), "%5dx%5d%n", &width, &height, &read) != 2 || size_t(read) != size.size())
            return fail(usage("--size " + size + ": not a size; write WIDTHxHEIGHT, such as 480x270"));
        o.bench.sizes.emplace_back(width, height);
    }
    Result<BenchReport> report = [&] {
        Progress progress;
        return run_bench(o.names, o.bench, [&](std::string_view stage, double done) { progress.bar(stage, done); });
    }();
    if (!report) return fail(report.error());
    (void)put(o.json ? json_of(*report) : table_of(*report));
    return finish_data();
}

}  // namespace

void add_bench(CLI::App& app, Run& run) {
    auto o = std::make_shared<BenchWords>();
    CLI::App* verb = app.add_subcommand("bench",
                                        "Measures this machine at the engine's work, beside peers and roofs.\n\n"
                                        "Examples:\n"
                                        "  kiln bench --list\n"
                                        "  kiln bench field\n"
                                        "  kiln bench field/rays field/bake --kind 0,1,2 --json\n"
                                        "  kiln bench field --scene potter");
    verb->add_option("NAME", o->names, "a family or a row of --list; everything when none is given");
    verb->add_flag("--list", o->list, "names what can be measured");
    verb->add_flag("--json", o->json, "one object, on stdout");
    CLI::Option* kind =
        verb->add_option("--kind", o->bench.kinds, "scene: 0 pebbles, 1 carve, 2 cluster; several as 0,1,2 (default 0)")
            ->delimiter(',');
    CLI::Option* seed = verb->add_option("--seed", o->bench.seed, "of the scene (default 5)");
    verb->add_option("--runs", o->bench.runs, "a row is the least of so many (default 7)");
    CLI::Option* count = verb->add_option("--count", o->bench.count, "edits of the scene (default 1000)")
                             ->check(CLI::Range(uint32_t{1}, kMostBenchEdits));
    verb->add_option(
            "--scene", o->bench.scene,
            "a scene file or a bundled scene's name, for the rows of field but edits, in place of kind, seed and "
            "count")
        ->excludes(kind)
        ->excludes(seed)
        ->excludes(count);
    verb->add_option("--size", o->sizes, "of the pictures of frame, several as 480x270,1920x1080 (default 480x270)")
        ->delimiter(',');
    verb->add_option("--threads", o->bench.threads, "threads of every row (default: 1, and rows for all cores beside)")
        ->check(CLI::Range(1, 1024));
    verb->callback([o, &run] { run = [o] { return bench(*o); }; });
}

}  // namespace kiln::cli

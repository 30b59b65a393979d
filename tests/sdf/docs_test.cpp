// SPDX-License-Identifier: MIT
// docs/shapes.md is made from the rows. KILN_WRITE_DOCS=1 sdf_tests --gtest_filter=Docs.* writes it anew.

#include "sdf/tables.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace kiln::sdf {
namespace {

void number(std::ostream& out, float v) { out << v; }

void section(std::ostream& out, const KindRow& row, const char* key) {
    static constexpr const char* kHow[] = {"exact outside",   "lower bound",          "lower bound, reads a file",
                                           "a formula",       "tree of shapes",       "a program's own",
                                           "moves the point", "changes the distance", "several copies"};
    out << "\n### `" << row.name << "`\n\n" << row.doc << " *(" << kHow[row.how] << ")*\n\n";
    bool any = false;
    for (const FieldRow& field : row.fields()) {
        if (field.range == "internal") continue;
        if (!any) out << "| field | default | unit | range | |\n|---|---|---|---|---|\n";
        any = true;
        out << "| `" << field.name << "` | ";
        if (field.range == "axis") {
            out << '"' << "xyz"[int(field.defaults[0])] << '"';
        } else if (field.range == "flag") {
            out << (field.defaults[0] != 0 ? "true" : "false");
        } else if (field.arity == 1) {
            number(out, field.defaults[0]);
        } else {
            for (int i = 0; i < field.arity; ++i) {
                out << (i == 0 ? "[" : ", ");
                number(out, field.defaults[size_t(i)]);
            }
            out << ']';
        }
        out << " | " << field.unit << " | "
            << (field.range == "axis"   ? "x, y or z"
                : field.range == "flag" ? "true or false"
                                        : field.range)
            << " | " << field.doc << " |\n";
    }
    if (!any) out << "No fields: `{ \"" << key << "\": \"" << row.name << "\" }`.\n";
}

// Other tests of the process may have registered shapes of their own.
std::vector<KindRow> built_in_rows() {
    std::vector<KindRow> out;
    for (const KindRow& row : shape_rows())
        if (row.how != KindRow::Custom) out.push_back(row);
    return out;
}

std::string shapes_page() {
    std::ostringstream out;
    out << "# Shapes and warps\n\n"
           "Made from the records in `src/sdf/shapes`, `src/sdf/library` and `src/sdf/domain` by "
           "`tests/sdf/docs_test.cpp`; do not edit.\n"
           "Local frame: +Y is the axis, centred at the origin. Lengths in metres, angles in radians.\n\n## Shapes\n";
    for (const KindRow& row : built_in_rows()) section(out, row, "shape");
    out << "\n## Warps\n\nThe first entry of `domain` acts on the bare shape, each next one on the result.\n";
    for (const KindRow& row : warp_rows()) section(out, row, "warp");
    out << "\n### The noise of `displace`\n\n"
           "Lattice point (i, j, k), 32-bit integers that wrap: `hash = mix(i + mix(j + mix(k + seed)))`, with\n\n"
           "```\nmix(x): x ^= x >> 16;  x *= 0x7feb352d;  x ^= x >> 15;  x *= 0x846ca68b;  x ^= x >> 16\n```\n\n"
           "Its gradient is (±1, ±1, ±1), negative where bit 31, 30, 29 of the hash is set (x, y, z). With t the "
           "point's position in its\n"
           "cell and fade(t) = t³ (t (6 t − 15) + 10), the noise is 2/3 of the sum over the eight corners of weight · "
           "gradient · (point −\n"
           "corner); the weight is the product over the axes of fade(t) (upper corner) or 1 − fade(t) (lower corner). "
           "|noise| ≤ 1 and its\n"
           "gradient is at most 3.5 per cell. The surface moves out by amplitude · noise(frequency · p).\n";
    return out.str();
}

TEST(Docs, ShapesPageIsMadeFromTheRows) {
    const std::string path = std::string(KILN_SOURCE_DIR) + "/docs/shapes.md";
    const std::string page = shapes_page();
    if (std::getenv("KILN_WRITE_DOCS") != nullptr) std::ofstream(path) << page;
    std::ostringstream have;
    have << std::ifstream(path).rdbuf();
    EXPECT_TRUE(have.str() == page) << "docs/shapes.md is stale: KILN_WRITE_DOCS=1 sdf_tests --gtest_filter=Docs.*";
}

TEST(Docs, EveryRowAndFieldSaysWhatItIs) {
    const auto check = [](const KindRow& row) {
        EXPECT_GT(row.doc.size(), 10u) << row.name;
        EXPECT_TRUE(row.doc.ends_with('.'))
            << row.name << ": the first line of its text is its description, a whole sentence: " << row.doc;
        for (const FieldRow& field : row.fields()) EXPECT_GT(field.doc.size(), 5u) << row.name << '.' << field.name;
        for (const FieldRow& field : row.fields()) {
            for (int i = 0; i < field.arity; ++i) {
                EXPECT_FALSE(out_of_range(field, field.defaults[size_t(i)]))
                    << "default of " << row.name << '.' << field.name;
            }
        }
    };
    for (const KindRow& row : built_in_rows()) check(row);
    for (const KindRow& row : warp_rows()) check(row);
}

}  // namespace
}  // namespace kiln::sdf

// SPDX-License-Identifier: MIT
// Starts threads.
// Pictures of plane models against every operation at every pixel.

#include "formulas.h"

#include "measure/letters.h"
#include "sdf/expression_image.h"

#include <gtest/gtest.h>

namespace kiln::sdf {
namespace {

TEST(FormulaImage, HasTheBitsOfEveryOperationAtEveryPixel) {
    const auto letters = read_vm(measure::letters_model(60));
    ASSERT_TRUE(letters) << letters.error().message;
    std::vector<Formula> formulas{*letters};
    for (const char* text : {"1", "-1", "x", "y - 0.2", "length(p.xy) - 0.7", "max(x, -y) + z", "x/y",
                             "sqrt(-1 - x) - 0.5", "min(0.25, max(x, -0.5))", "x/0.001 - x/0.001"}) {
        formulas.push_back(*parse_formula(text));
    }
    for (uint32_t seed = 0; seed < 60; ++seed) {
        FormulaMaker make(seed);
        formulas.push_back(*parse_formula(make.make(6, seed % 2 == 0).text));
    }
    for (size_t i = 0; i < formulas.size(); ++i) {
        for (const int size : {16, 100, 256}) {
            const FormulaView view{.size_px = size, .half_width = 1.5f, .z = 0.1f};
            const auto slow = formula_image_slow(formulas[i], view, Isa::Scalar);
            for (Isa isa : {Isa::Scalar, Isa::Sse4, Isa::Avx2, Isa::Avx512}) {
                if (!has_isa(isa)) continue;
                ASSERT_EQ(formula_image(formulas[i], view, isa), slow)
                    << "formula " << i << " size " << size << " isa " << int(isa);
                if (size != 100) continue;
                ASSERT_EQ(formula_image_slow(formulas[i], view, isa), slow) << "formula " << i << " isa " << int(isa);
            }
        }
    }
}

TEST(FormulaImage, ShowsTheModelUpright) {
    const auto picture = formula_image(*parse_formula("max(x, -y)"), {.size_px = 64});  // the quarter x < 0, y > 0
    EXPECT_EQ(picture[0], 255);
    EXPECT_EQ(picture[63], 0);
    EXPECT_EQ(picture[63 * 64], 0);
    EXPECT_EQ(picture[31 * 64 + 31], 255);
    EXPECT_EQ(picture[32 * 64 + 32], 0);
}

TEST(FormulaImage, LooksAtASmallShareOfALargeModel) {
    const auto letters = read_vm(measure::letters_model(200));
    ASSERT_TRUE(letters);
    FormulaImageStats stats;
    (void)formula_image(*letters, {.size_px = 1024}, best_isa(), &stats);
    const double all = double(letters->nodes.size()) * 1024 * 1024;
    EXPECT_LT(double(stats.point_operations), 0.01 * all);
    EXPECT_LT(16 * double(stats.interval_operations) + double(stats.copied_operations), 0.01 * all);
}

}  // namespace
}  // namespace kiln::sdf

// SPDX-License-Identifier: MIT
// `bench expression`: a plane model of 7,866 operations as a picture of 1024 x 1024 pixels, beside every operation at every pixel.

#include "measure/bench_run.h"

#include "base/parallel_for.h"
#include "measure/contest.h"
#include "measure/letters.h"
#include "sdf/expression_image.h"

namespace kiln::measure {
namespace {

constexpr int kSide = 1024;
constexpr int kGlyphs = 224;  // and a tail: 7,866 operations, as many as the public model "prospero.vm" has

BenchRow row(std::string name, std::string unit) {
    BenchRow out;
    out.name = std::move(name);
    out.unit = std::move(unit);
    return out;
}

void picture(BenchRun& run, const sdf::Formula& model, int threads) {
    run.stage("picture");
    const sdf::FormulaView view{.size_px = kSide};
    std::vector<uint8_t> fast, slow;
    const std::vector<double> least = least_seconds(
        run.options.runs,
        {[&] { return seconds_of([&] { fast = sdf::formula_image(model, view, sdf::best_isa(), nullptr, threads); }); },
         [&] { return seconds_of([&] { slow = sdf::formula_image_slow(model, view, sdf::best_isa(), threads); }); }});
    BenchRow out = row("picture", "ms");
    out.value = least[0] * 1e3;
    out.threads = threads;
    out.peer = "every operation at every pixel";
    out.peer_value = least[1] * 1e3;
    out.ratio = least[1] / least[0];
    out.seed = run.options.seed;
    out.count = uint32_t(model.nodes.size());
    run.add_checked(out, hash64_of(std::span<const uint8_t>(fast)), hash64_of(std::span<const uint8_t>(slow)));
}

}  // namespace

BenchFamily expression_family() {
    return {{"expression",
             "a plane model of 7,866 operations (letters) as 1024 x 1024 pixels: through intervals, beside brute force "
             "by SIMD",
             {"picture"}},
            [](BenchRun& run) {
                if (!run.wanted("expression", "picture") || run.fault()) return;
                const auto model = sdf::read_vm(letters_model(kGlyphs, true, run.options.seed));
                if (!model) return run.fail(Error{model.error().message, ErrorKind::Failed});
                const int cores = hardware_workers();
                picture(run, *model, run.options.threads > 0 ? run.options.threads : 1);
                if (run.options.threads == 0 && cores > 1 && !run.fault()) picture(run, *model, cores);
            }};
}

}  // namespace kiln::measure

// SPDX-License-Identifier: MIT
// kiln compare A B: how far two pictures are apart.

#include "cli/json.h"
#include "cli/talk.h"
#include "cli/verbs.h"

#include <kiln/world.h>

#include <memory>

namespace kiln::cli {

namespace {

struct CompareOptions {
    std::string a, b;
    bool json = false;
};

int compare(const CompareOptions& o) {
    const auto d = compare_images(o.a, o.b);
    if (!d) return fail(d.error());
    if (o.json) {
        Json json;
        json.number("flip", d->flip).number("psnr", d->psnr).number("ssim", d->ssim).number("max_abs", d->max_abs);
        json.flag("equal", d->max_abs == 0);
        (void)put(json.line());
        return finish_data();
    }
    char line[200];
    std::snprintf(line, sizeof line,
                  "flip     %.6f   (0 is equal)\npsnr     %.2f dB\nssim     %.6f   (1 is equal)\nmax_abs  %.6f\n",
                  d->flip, d->psnr, d->ssim, d->max_abs);
    (void)put(line);
    return finish_data();
}

}  // namespace

void add_compare(CLI::App& app, Run& run) {
    auto o = std::make_shared<CompareOptions>();
    CLI::App* verb = app.add_subcommand("compare",
                                        "Measures how far two pictures are apart: FLIP, PSNR, SSIM.\n\n"
                                        "Examples:\n"
                                        "  kiln compare before.png after.png");
    verb->add_option("A", o->a, "a picture")->required();
    verb->add_option("B", o->b, "another of the same size")->required();
    verb->add_flag("--json", o->json, "one object, on stdout");
    verb->callback([o, &run] { run = [o] { return compare(*o); }; });
}

}  // namespace kiln::cli

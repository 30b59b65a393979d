// SPDX-License-Identifier: MIT
// Automatic exposure: a histogram of log luminance, its middle without the darkest and the brightest, and an eye that follows it.
// What it follows is approached by an exponential of the time that passed, so the same light gives the same curve at any frame rate, and
// nothing overshoots.

#ifndef KILN_RENDER_LIB_EXPOSURE_GPU_H
#define KILN_RENDER_LIB_EXPOSURE_GPU_H

#include "math/math.gpu.h"
#include "render/lib/color.gpu.h"

#ifdef __cplusplus
namespace kiln::render::shade {
using namespace kiln::gpu;
#endif

// Bin 0 is black; the others are an eighth of a stop each, from 2^-15 cd/m² on.
KILN_CONST int kExposureBins = 256;
KILN_CONST float kExposureLowest = -15.0f;
KILN_CONST float kExposureBinStops = 0.125f;
// Of the pixels that are not black, by luminance: these shares count.
KILN_CONST float kExposureFrom = 0.5f;
KILN_CONST float kExposureTo = 0.95f;
// What the measured middle becomes before the tone map: middle grey.
KILN_CONST float kExposureGrey = 0.18f;
// Seconds in which an eye comes 63 % of the way to more light and to less.
KILN_CONST float kExposureToBright = 0.4f;
KILN_CONST float kExposureToDark = 1.2f;

// What stays from picture to picture.
struct ExposureState {
    float multiplier;  // of radiance, before the tone map
    float stops;       // log2 of the luminance that the eye is used to
    float measured;    // log2 of what this picture's middle has; kExposureLowest - 1 where all is black
    float known;       // 1 once `stops` is
};

KILN_FN int exposure_bin(float light) {
    if (!(light > 0.0f)) return 0;
    float bin = (log2(min(light, 65504.0f)) - kExposureLowest) / kExposureBinStops;
    return bin < 0.0f ? 0 : 1 + int(min(bin, float(kExposureBins - 2)));
}

// Middle of a bin above 0, stops.
KILN_FN float exposure_stops(int bin) { return kExposureLowest + (float(bin) - 0.5f) * kExposureBinStops; }

// What a bin adds to the sums of the middle: it holds `count` of `lit` pixels, `before` of them darker.
KILN_FN float exposure_share(float before, float count, float lit) {
    float from = max(before, kExposureFrom * lit);
    float to = min(before + count, kExposureTo * lit);
    return max(to - from, 0.0f);
}

// The state after `seconds` of this light; 0: the eye is used to it at once. `correction` multiplies.
KILN_FN ExposureState exposure_after(ExposureState was, float measured, float seconds, float correction) {
    ExposureState now = was;
    now.measured = measured;
    if (measured >= kExposureLowest) {
        float lag = measured > was.stops ? kExposureToBright : kExposureToDark;
        float moved = was.known > 0.5f && seconds > 0.0f ? 1.0f - exp(-seconds / lag) : 1.0f;
        now.stops = was.known > 0.5f ? was.stops + (measured - was.stops) * moved : measured;
        now.known = 1.0f;
    }
    now.multiplier = now.known > 0.5f ? correction * kExposureGrey * exp(-now.stops * 0.69314718f) : correction;
    return now;
}

#ifdef __cplusplus
static_assert(sizeof(ExposureState) == 16);
}  // namespace kiln::render::shade
#endif

#endif

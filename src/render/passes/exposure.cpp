// SPDX-License-Identifier: MIT
#include "render/passes/exposure.gpu.h"
#include "render/passes/passes.h"
#include "shaders/exposure_adapt.spv.h"
#include "shaders/exposure_count.spv.h"

namespace kiln::render {

const Kernel kExposureCount{"exposure count", kExposureCountSpv};
const Kernel kExposureAdapt{"exposure adapt", kExposureAdaptSpv};

void expose(Graph& g, const Image& radiance, Buffer& exposure, float seconds, float correction) {
    const ExposurePush push{.seconds = seconds,
                            .correction = correction,
                            .width = int(radiance.size.width),
                            .height = int(radiance.size.height)};
    Buffer histogram = g.create_buffer("histogram", shade::kExposureBins * 4);
    g.clear(histogram);
    const uint32_t side = uint32_t(kExposureGroup * kExposureStep);
    const Groups groups{(radiance.size.width + side - 1) / side, (radiance.size.height + side - 1) / side, 1};
    g.dispatch(kExposureCount, groups, {g.read(radiance), g.read_write(histogram)}, push);
    g.dispatch(kExposureAdapt, Groups{}, {g.read(histogram), g.read_write(exposure)}, push);
}

}  // namespace kiln::render

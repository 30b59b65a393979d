// SPDX-License-Identifier: MIT
#include "rhi/reporter.h"

#include "base/log.h"

namespace kiln::rhi {

void Reporter::set(ErrorSink sink) {
    const std::lock_guard lock(mutex_);
    sink_ = std::move(sink);
}

void Reporter::operator()(std::string_view sentence) {
    const std::lock_guard lock(mutex_);
    if (sink_) {
        sink_(sentence);
    } else {
        log::error("rhi: {}", sentence);
    }
}

}  // namespace kiln::rhi

// SPDX-License-Identifier: MIT
// Where a device's complaints go: the sink the user gave, else the log.
#pragma once

#include "rhi/device.h"

#include <mutex>

namespace kiln::rhi {

class Reporter {
public:
    void set(ErrorSink sink);
    // Any thread (drivers call back from theirs); one sentence at a time.
    void operator()(std::string_view sentence);

private:
    std::mutex mutex_;
    ErrorSink sink_;
};

}  // namespace kiln::rhi

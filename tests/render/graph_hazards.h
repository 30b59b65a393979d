// SPDX-License-Identifier: MIT
// An independent judge of plans: plays one or more frames access by access and barrier by barrier, and asks of every two
// accesses to the same bytes whether a chain of barriers stands between them. Slow and simple; shares no code with compile().
#pragma once

#include "render/graph_plan.h"

#include <span>
#include <string>
#include <vector>

namespace kiln::render::samples {

// Sentences about what is wrong with frames executed one after the other on one device: hazards, wrong layouts, contents
// read that were lost, wrong states left, transients overlapping in memory and time.
std::vector<std::string> find_hazards(std::span<const Plan> frames);

// Sentences as lines: empty where nothing is wrong.
inline std::string joined(const std::vector<std::string>& lines) {
    std::string out;
    for (const std::string& l : lines) out += l + "\n";
    return out;
}

// What is wrong with the choice of passes: a culled one whose result is seen, a kept one that nobody needs, a wrong order.
std::vector<std::string> find_cull_faults(const Graph& graph, const Plan& plan);

}  // namespace kiln::render::samples

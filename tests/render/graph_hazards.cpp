// SPDX-License-Identifier: MIT
#include "render/graph_hazards.h"

#include "base/format.h"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

namespace kiln::render::samples {

using rhi::Access;

namespace {

constexpr Access kReads = ~rhi::kWriteAccess;

// One mip and layer of one physical resource. Transients are other resources in every frame, in bytes they may share.
struct Place {
    uint64_t handle = 0;  // imported: the device's name; else frame and index
    bool is_transient = false;
    uint32_t mip_level = 0, layer_index = 0;
    auto operator<=>(const Place&) const = default;
};
struct Bytes {
    uint64_t begin = 0, end = 0;
};

struct Step {
    bool is_barrier = false;
    Place place;
    Access access = Access::Undefined;  // of a use
    Access before = Access::Undefined, after = Access::Undefined, alias = Access::Undefined;
    int batch = 0;  // uses of one batch run at once
    uint32_t pass = 0;
    bool reads_old = false;
    std::string what = {};
};

struct Timeline {
    std::vector<Step> steps;
    std::map<Place, Bytes> bytes;  // of transients
    std::map<Place, bool> is_image;
    std::map<Place, bool> is_depth;
    std::map<Place, Access> state;  // what imported places start in
    std::map<Place, bool> held;     // contents at the start
};

bool may_share(const Timeline& t, const Place& a, const Place& b) {
    if (a == b) return true;
    if (!a.is_transient || !b.is_transient) return false;
    const auto x = t.bytes.find(a), y = t.bytes.find(b);
    if (x == t.bytes.end() || y == t.bytes.end()) return false;
    if (a.handle == b.handle) return false;  // other mip or layer of the same
    return x->second.begin < y->second.end && y->second.begin < x->second.end;
}

Place place_of(const Plan& plan, size_t frame, uint32_t resource, uint32_t m, uint32_t l) {
    const GraphResource& r = plan.resources[resource];
    Place p{.mip_level = m, .layer_index = l};
    p.is_transient = r.origin == GraphResource::Origin::Transient;
    p.handle = uint64_t{frame} << 32 | resource;
    if (r.origin == GraphResource::Origin::Imported)
        p.handle = (r.is_image ? 1ull << 62 : 1ull << 63) + (r.is_image ? r.texture.bits() : r.buffer.bits());
    return p;
}

template <typename F>
void over(const Plan& plan, size_t frame, uint32_t resource, rhi::Subresources range, F&& f) {
    if (!plan.resources[resource].is_image) range = {0, 1, 0, 1};
    for (uint32_t m = 0; m < range.mip_count; ++m)
        for (uint32_t l = 0; l < range.layer_count; ++l)
            f(place_of(plan, frame, resource, range.base_mip + m, range.base_layer + l));
}

Timeline play(std::span<const Plan> frames) {
    Timeline t;
    int batch = 0;
    for (size_t frame = 0; frame < frames.size(); ++frame) {
        const Plan& plan = frames[frame];
        for (const Placement& p : plan.placements) {
            const GraphResource& r = plan.resources[p.resource];
            over(plan, frame, p.resource, {0, r.mips, 0, r.layers()}, [&](const Place& place) {
                t.bytes[place] = {p.offset, p.offset + p.size};
            });
        }
        for (uint32_t i = 0; i < plan.resources.size(); ++i) {
            const GraphResource& r = plan.resources[i];
            over(plan, frame, i, {0, r.mips, 0, r.layers()}, [&](const Place& place) {
                t.is_image[place] = r.is_image;
                t.is_depth[place] = r.is_image && rhi::is_depth(r.format);
                const size_t cell = place.mip_level + size_t{place.layer_index} * r.mips;
                const Access entry = r.entry.empty() ? Access::Undefined : r.entry[cell];
                const bool fresh = r.origin == GraphResource::Origin::Transient || r.history_current;
                t.state.emplace(place, entry);
                t.held.emplace(place, !fresh && (!r.is_image || entry != Access::Undefined));
            });
        }
        const auto barriers = [&](const std::vector<PlanBarrier>& list) {
            for (const PlanBarrier& b : list) {
                over(plan, frame, b.resource, b.range, [&](const Place& place) {
                    Step s{.is_barrier = true,
                           .place = place,
                           .before = b.before,
                           .after = b.after,
                           .alias = b.alias_before,
                           .batch = batch};
                    s.what = formatted("frame {}, barrier on '{}' mip {} layer {}", frame,
                                       plan.resources[b.resource].name, place.mip_level, place.layer_index);
                    t.steps.push_back(std::move(s));
                });
            }
        };
        for (const PlanLevel& level : plan.levels) {
            ++batch;
            barriers(level.barriers);
            for (const uint32_t p : level.passes) {
                for (const GraphAccess& a : plan.passes[p].accesses) {
                    over(plan, frame, a.resource, a.range, [&](const Place& place) {
                        Step s{.place = place,
                               .access = a.access,
                               .batch = batch,
                               .pass = uint32_t(frame << 16) + p,
                               .reads_old = a.reads_old};
                        s.what = formatted("frame {}, pass '{}' ({}) {} '{}' mip {} layer {}", frame,
                                           plan.passes[p].name, p, rhi::name(a.access), plan.resources[a.resource].name,
                                           place.mip_level, place.layer_index);
                        t.steps.push_back(std::move(s));
                    });
                }
            }
        }
        ++batch;
        barriers(plan.epilogue);
        for (uint32_t i = 0; i < plan.resources.size();
             ++i) {  // the world looks at what was to be left in a given access
            const GraphResource& r = plan.resources[i];
            if (r.leave == Access::Undefined || !plan.uses[i].used) continue;
            for (const PlanLevel& level : plan.levels)
                for (const uint32_t p : level.passes)
                    for (const GraphAccess& a : plan.passes[p].accesses)
                        if (a.resource == i)
                            over(plan, frame, i, a.range, [&](const Place& place) {
                                Step s{.place = place, .access = r.leave, .batch = batch, .pass = ~0u};
                                s.what =
                                    formatted("frame {}, whoever takes '{}' as {}", frame, r.name, rhi::name(r.leave));
                                t.steps.push_back(std::move(s));
                            });
        }
    }
    return t;
}

// Is `later` ordered after `earlier`? Follows what each barrier in between promises.
bool ordered(const Timeline& t, size_t earlier, size_t later) {
    const Step& u = t.steps[earlier];
    const Step& v = t.steps[later];
    std::map<Place, Access> after_u;  // accesses of that place which wait for u
    for (size_t i = earlier + 1; i < later; ++i) {
        const Step& b = t.steps[i];
        if (!b.is_barrier) continue;
        bool waits = (b.place == u.place && rhi::any(b.before & u.access));
        if (const auto it = after_u.find(b.place); it != after_u.end())
            waits = waits || rhi::any(b.before & it->second);
        if (rhi::any(b.alias)) {
            if (may_share(t, b.place, u.place)) waits = waits || rhi::any(b.alias & u.access);
            for (const auto& [place, accesses] : after_u)
                if (may_share(t, b.place, place)) waits = waits || rhi::any(b.alias & accesses);
        }
        if (waits) after_u[b.place] |= b.after;
    }
    const auto it = after_u.find(v.place);
    return it != after_u.end() && !rhi::any(v.access & ~it->second);
}

void check_order(const Timeline& t, std::vector<std::string>& faults) {
    for (size_t v = 0; v < t.steps.size(); ++v) {
        if (t.steps[v].is_barrier) continue;
        for (size_t u = 0; u < v; ++u) {
            const Step &a = t.steps[u], &b = t.steps[v];
            if (a.is_barrier || (a.pass == b.pass && a.batch == b.batch)) continue;
            if (!rhi::writes(a.access) && !rhi::writes(b.access)) {
                // Two reads only need order where memory changes hands.
                if (a.place == b.place || !may_share(t, a.place, b.place)) continue;
            }
            if (!may_share(t, a.place, b.place)) continue;
            if (!ordered(t, u, v)) faults.push_back("no order: " + a.what + "  |  " + b.what);
        }
    }
}

void check_states(const Timeline& t, std::vector<std::string>& faults) {
    std::map<Place, Access> state = t.state;
    std::map<Place, bool> held = t.held;
    for (const Step& s : t.steps) {
        if (s.is_barrier) {
            const bool image = t.is_image.at(s.place);
            if (image && rhi::any(s.before) && s.before != state[s.place])
                faults.push_back(
                    formatted("{}: from {}, but it is in {}", s.what, rhi::name(s.before), rhi::name(state[s.place])));
            if (!rhi::any(s.after)) faults.push_back(s.what + ": to nothing");
            const Access write = s.after & rhi::kWriteAccess;
            if (rhi::any(write) && (rhi::any(s.after & kReads) || (uint32_t(write) & (uint32_t(write) - 1))))
                faults.push_back(formatted("{}: to {} at once", s.what, rhi::name(s.after)));
            if (t.is_depth.at(s.place) && rhi::any(s.after & Access::CopyRead) && rhi::any(s.after & ~Access::CopyRead))
                faults.push_back(formatted("{}: depth to {} at once", s.what, rhi::name(s.after)));
            if (image && !rhi::any(s.before)) held[s.place] = false;
            state[s.place] = s.after;
            continue;
        }
        if (t.is_image.at(s.place) && rhi::any(s.access & ~state[s.place]))
            faults.push_back(formatted("{}, but it is in {}", s.what, rhi::name(state[s.place])));
        if (s.reads_old && !held[s.place]) faults.push_back(s.what + ", whose contents are gone");
        if (rhi::writes(s.access)) held[s.place] = true;
    }
}

// One bit a byte block and level would do; intervals compared two by two will, too.
void check_memory(const Plan& plan, std::vector<std::string>& faults) {
    uint64_t needed = 0;
    for (const Placement& p : plan.placements) {
        needed = std::max(needed, p.offset + p.size);
        if (p.offset % p.alignment)
            faults.push_back(formatted("'{}' at {} is not aligned", plan.resources[p.resource].name, p.offset));
        std::set<uint32_t> levels;
        for (uint32_t l = 0; l < plan.levels.size(); ++l)
            for (const uint32_t pass : plan.levels[l].passes)
                for (const GraphAccess& a : plan.passes[pass].accesses)
                    if (a.resource == p.resource) levels.insert(l);
        if (plan.resources[p.resource].output) levels.insert(uint32_t(plan.levels.size()));
        for (const uint32_t l : levels)
            if (l < p.first_level || l > p.last_level)
                faults.push_back(formatted("'{}' is used in level {} but has memory in {}-{}",
                                           plan.resources[p.resource].name, l, p.first_level, p.last_level));
        for (const Placement& q : plan.placements) {
            if (&q == &p) continue;
            for (uint32_t l = 0; l <= plan.levels.size(); ++l) {
                const bool both = l >= p.first_level && l <= p.last_level && l >= q.first_level && l <= q.last_level;
                if (!both || p.offset >= q.offset + q.size || q.offset >= p.offset + p.size) continue;
                faults.push_back(formatted("'{}' and '{}' are in the same bytes in level {}",
                                           plan.resources[p.resource].name, plan.resources[q.resource].name, l));
                break;
            }
        }
    }
    if (needed > plan.peak_bytes)
        faults.push_back(formatted("{} B placed, peak said to be {}", needed, plan.peak_bytes));
}

void check_left(const Timeline& t, std::span<const Plan> frames, std::vector<std::string>& faults) {
    std::map<Place, Access> state = t.state;
    for (const Step& s : t.steps) {
        if (s.is_barrier) state[s.place] = s.after;
        if (!s.is_barrier && !rhi::any(state[s.place])) state[s.place] = s.access;
        if (!s.is_barrier && !t.is_image.at(s.place) && !rhi::writes(state[s.place])) state[s.place] |= s.access;
    }
    const Plan& last = frames.back();
    for (uint32_t i = 0; i < last.resources.size(); ++i) {
        const GraphResource& r = last.resources[i];
        if (!last.uses[i].used) continue;
        over(last, frames.size() - 1, i, {0, r.mips, 0, r.layers()}, [&](const Place& place) {
            const Access said = last.uses[i].leave[place.mip_level + size_t{place.layer_index} * r.mips];
            if (r.is_image ? said != state[place] : rhi::any(state[place] & ~said))
                faults.push_back(formatted("'{}' is said to be left in {}, but is in {}", r.name, rhi::name(said),
                                           rhi::name(state[place])));
        });
    }
}

}  // namespace

std::vector<std::string> find_hazards(std::span<const Plan> frames) {
    std::vector<std::string> faults;
    if (frames.empty()) return faults;
    const Timeline t = play(frames);
    check_order(t, faults);
    check_states(t, faults);
    check_left(t, frames, faults);
    for (const Plan& plan : frames) check_memory(plan, faults);
    return faults;
}

std::vector<std::string> find_cull_faults(const Graph& graph, const Plan& plan) {
    std::vector<std::string> faults;
    const std::vector<GraphPass>& all = graph.passes();
    std::vector<bool> kept(all.size(), false);
    uint32_t next = 0;  // order of recording is the order of the plan
    for (const uint32_t p : plan.recorded) {
        if (p == ~0u) continue;
        if (p >= all.size() || p < next) {
            faults.push_back("passes of the plan are not in the order they were recorded in");
            return faults;
        }
        kept[p] = true;
        next = p + 1;
    }
    uint32_t at = 0;
    for (const PlanLevel& level : plan.levels)
        for (const uint32_t p : level.passes)
            if (p != at++) faults.push_back("levels do not hold the passes in order");

    // Follow what each pass writes forwards: is it seen before it is wiped out?
    const std::vector<GraphResource>& resources = graph.resources();
    for (size_t p = 0; p < all.size(); ++p) {
        bool seen = false;
        for (const GraphAccess& w : all[p].accesses) {
            if (!rhi::writes(w.access)) continue;
            for (uint32_t m = w.range.base_mip; m < w.range.base_mip + w.range.mip_count; ++m) {
                for (uint32_t l = w.range.base_layer; l < w.range.base_layer + w.range.layer_count; ++l) {
                    bool wiped = false;
                    for (size_t q = p + 1; q < all.size() && !wiped && !seen; ++q) {
                        for (const GraphAccess& a : all[q].accesses) {
                            const bool covers = a.resource == w.resource && m >= a.range.base_mip &&
                                                m < a.range.base_mip + a.range.mip_count && l >= a.range.base_layer &&
                                                l < a.range.base_layer + a.range.layer_count;
                            if (!covers) continue;
                            if (a.reads_old && kept[q]) seen = true;
                            if (a.overwrites && kept[q]) wiped = true;
                        }
                    }
                    const GraphResource& r = resources[w.resource];
                    const bool sink =
                        r.output || r.history_current || r.readback || r.origin == GraphResource::Origin::Imported;
                    seen = seen || (sink && !wiped);
                }
            }
        }
        if (seen && !kept[p]) faults.push_back("pass '" + all[p].name + "' is culled, but somebody sees what it wrote");
        if (!seen && kept[p]) faults.push_back("pass '" + all[p].name + "' is kept, but nobody sees what it wrote");
    }
    return faults;
}

}  // namespace kiln::render::samples

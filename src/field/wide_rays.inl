// SPDX-License-Identifier: MIT
// Rays, each in a lane of its own and at its own place. Included after wide_math.inl.

struct WideCubic {
    F b0, b1, b2, b3;
};
// Each of the eight values is trilinear()'s, bit for bit: what they share is made once.
static inline WideCubic cubic_of(const WideCorners& c, F3 p, F3 q) {
    struct Square {
        F v00, v10, v01, v11;  // by y and z
    };
    const auto along_x = [&](F x) {
        return Square{lerp(c.v00.a, c.v00.b, x), lerp(c.v10.a, c.v10.b, x), lerp(c.v01.a, c.v01.b, x), lerp(c.v11.a, c.v11.b, x)};
    };
    const Square xp = along_x(p.x), xq = along_x(q.x);
    const auto along_y = [](const Square& v, F y, F& low, F& high) {
        low = lerp(v.v00, v.v10, y);
        high = lerp(v.v01, v.v11, y);
    };
    F low_pp, high_pp, low_pq, high_pq, low_qp, high_qp, low_qq, high_qq;  // by the ends of x and y
    along_y(xp, p.y, low_pp, high_pp);
    along_y(xp, q.y, low_pq, high_pq);
    along_y(xq, p.y, low_qp, high_qp);
    along_y(xq, q.y, low_qq, high_qq);
    const F ppq = lerp(low_pp, high_pp, q.z), pqp = lerp(low_pq, high_pq, p.z), qpp = lerp(low_qp, high_qp, p.z);
    const F pqq = lerp(low_pq, high_pq, q.z), qpq = lerp(low_qp, high_qp, q.z), qqp = lerp(low_qq, high_qq, p.z);
    return {lerp(low_pp, high_pp, p.z), (qpp + pqp + ppq) * 0.33333334f, (pqq + qpq + qqp) * 0.33333334f,
            lerp(low_qq, high_qq, q.z)};
}
// How far eight values are from those of a plane: the largest mixed difference on a face. Each of the three kinds lifts what is interpolated
// from what four of the eight say together by a quarter of it or less.
static inline F bend_of(const WideCorners& c) {
    const auto mixed = [](F p, F q, F r, F s) { return abs((p - q) - (r - s)); };
    const F xy = max(mixed(c.v00.a, c.v00.b, c.v10.a, c.v10.b), mixed(c.v01.a, c.v01.b, c.v11.a, c.v11.b));
    const F xz = max(mixed(c.v00.a, c.v00.b, c.v01.a, c.v01.b), mixed(c.v10.a, c.v10.b, c.v11.a, c.v11.b));
    const F yz = max(mixed(c.v00.a, c.v10.a, c.v01.a, c.v11.a), mixed(c.v00.b, c.v10.b, c.v01.b, c.v11.b));
    return max(max(xy, xz), yz);
}
static inline F value_of(const WideCubic& c, F s) {
    const F r = 1.0f - s;
    return ((c.b0 * r + 3.0f * c.b1 * s) * r + 3.0f * c.b2 * s * s) * r + c.b3 * s * s * s;
}
static inline F slope_of(const WideCubic& c, F s) {
    const F r = 1.0f - s;
    return 3.0f * ((c.b1 - c.b0) * r * r + 2.0f * (c.b2 - c.b1) * r * s + (c.b3 - c.b2) * s * s);
}

// `enough`: a step this short is the last one.
static inline F bracketed(const WideCubic& c, M active, F lo, F hi, F value_lo, F value_hi, float enough) {
    F s = lo + (hi - lo) * (value_lo / (value_lo - value_hi));
    for (int i = 0; i < 24 && any(active); ++i) {
        const F value = value_of(c, s);
        const M above = lt(number(0), value);
        lo = select(both(active, above), s, lo);
        hi = select(without(active, above), s, hi);
        const F slope = slope_of(c, s);
        F next = select(lt(slope, number(0)), s - value / slope, lo);
        next = select(both(le(lo, next), le(next, hi)), next, 0.5f * (lo + hi));
        const F moved = abs(next - s);
        s = select(active, next, s);
        active = without(active, lt(moved, number(enough)));
    }
    return s;
}

static inline F first_root(const WideCubic& c, M active, float enough) {
    const F one = number(1), zero = number(0);
    const M start = le(c.b0, zero);
    F root = select(start, zero, number(kNoRoot));
    active = without(without(active, start), lt(zero, min(min(c.b1, c.b2), c.b3)));
    if (!any(active)) return root;
    const F d0 = c.b1 - c.b0;
    const F h = (c.b2 - c.b1) - d0;
    const F a = (c.b3 - c.b2) - (c.b2 - c.b1) - h;
    const F squared = h * h - a * d0;
    const M split = lt(zero, squared);
    const F size = sqrt(max(squared, zero));
    const F w = select(lt(h, zero), size - h, -size - h);
    F u = select(lt(abs(a), abs(w)), one, w / a);
    F v = select(lt(abs(w), abs(d0)), one, d0 / w);
    u = select(both(split, both(lt(zero, u), lt(u, one))), u, one);
    v = select(both(split, both(lt(zero, v), lt(v, one))), v, one);
    const F first = min(u, v), second = max(u, v);
    const F value_first = select(lt(first, one), value_of(c, first), c.b3);
    const F value_second = select(lt(second, one), value_of(c, second), c.b3);
    const M in_first = le(value_first, zero);
    const M in_second = both(lt(first, one), le(value_second, zero));
    const M in_third = both(both(lt(first, one), lt(second, one)), le(c.b3, zero));
    const M found = both(active, either(either(in_first, in_second), in_third));
    if (!any(found)) return root;
    const F lo = select(in_first, zero, select(in_second, first, second));
    const F hi = select(in_first, first, select(in_second, second, one));
    const F value_lo = select(in_first, c.b0, select(in_second, value_first, value_second));
    const F value_hi = select(in_first, value_first, select(in_second, value_second, c.b3));
    return select(found, bracketed(c, found, lo, hi, value_lo, value_hi, enough), root);
}

static inline F leading(F a) { return floats_of(bits_of(a) & int32_t(0xfffff000)); }
static inline F crossing(F plane, F high, F low, F inverse, M flat, float parallel) {
    return select(flat, number(parallel), ((plane - high) - low) * inverse);
}
static inline F texel_crossing(I texel, I whole, F part, F inverse, M flat, float parallel) {
    return select(flat, number(parallel), (to_float(texel - whole) - part) * inverse);
}

struct Counting {
    int32_t of[kLanes];
    constexpr Counting() : of() {
        for (int i = 0; i < kLanes; ++i) of[i] = i;
    }
};
constexpr Counting kCounting;

// Rays of one packet, texels counted from the grid's first.
struct Packet {
    I3 whole;
    F3 part, direction, inverse;
    M up_x, up_y, up_z;
    M flat_x, flat_y, flat_z;  // parallel to the planes of an axis
    I octant;                  // where its octant's bits are in the word of a free cell (ways.h)
};
static inline M select_lanes(M m, M a, M b) { return either(both(m, a), without(b, m)); }
static inline Packet select(M m, const Packet& a, const Packet& b) {
    return {select(m, a.whole, b.whole),         select(m, a.part, b.part),
            select(m, a.direction, b.direction), select(m, a.inverse, b.inverse),
            select_lanes(m, a.up_x, b.up_x),     select_lanes(m, a.up_y, b.up_y),
            select_lanes(m, a.up_z, b.up_z),     select_lanes(m, a.flat_x, b.flat_x),
            select_lanes(m, a.flat_y, b.flat_y), select_lanes(m, a.flat_z, b.flat_z),
            select(m, a.octant, b.octant)};
}

// The plane through which a ray leaves a voxel, of one axis; the brick's own faces are pushed out by kFaceOverlap.
static inline F exit_plane(M up, I voxel) {
    const F last = select(up, number(float(kBrickVoxels) + kFaceOverlap), number(-kFaceOverlap));
    const I plane = select(up, voxel + 1, voxel);
    return select(eq(plane, select(up, splat(kBrickVoxels), splat(0))), last, to_float(plane));
}
static inline F entry_plane(M up, I voxel) { return exit_plane(without(all(), up), voxel); }
static inline I stepped(M m, M up, I voxel) { return select(m, voxel + select(up, splat(1), splat(-1)), voxel); }

struct WideBrickRay {
    F3 high, low, lead, rest;
    F t_base;
};
static inline void rebase(I whole, F part, F direction, F t, F& high, F& low) {
    const F lead = leading(direction);
    const F a = to_float(whole), b = lead * t;
    const F sum = a + b;
    const F b_seen = sum - a;
    const F lost = (a - (sum - b_seen)) + (b - b_seen);
    high = sum;
    low = ((direction - lead) * t + lost) + part;
}
static inline WideBrickRay brick_ray_of(const Packet& ray, I3 texel) {
    const I3 away{ray.whole.x - texel.x, ray.whole.y - texel.y, ray.whole.z - texel.z};
    const F3 d = ray.direction;
    const F middle = (3.5f - ray.part.x - to_float(away.x)) * d.x + (3.5f - ray.part.y - to_float(away.y)) * d.y +
                     (3.5f - ray.part.z - to_float(away.z)) * d.z;
    WideBrickRay out;
    out.t_base = leading(middle);
    out.lead = {leading(d.x), leading(d.y), leading(d.z)};
    out.rest = {d.x - out.lead.x, d.y - out.lead.y, d.z - out.lead.z};
    rebase(away.x, ray.part.x, d.x, out.t_base, out.high.x, out.low.x);
    rebase(away.y, ray.part.y, d.y, out.t_base, out.high.y, out.low.y);
    rebase(away.z, ray.part.z, d.z, out.t_base, out.high.z, out.low.z);
    return out;
}
static inline F coordinate(F from, F high, F low, F lead, F rest, F s) {
    const F c = leading(s);
    const F large = (high - from) + lead * c;
    const F small = low + (rest * c + (lead + rest) * (s - c));
    return large + small;
}
static inline WideBrickRay select(M m, const WideBrickRay& a, const WideBrickRay& b) {
    return {select(m, a.high, b.high), select(m, a.low, b.low), select(m, a.lead, b.lead), select(m, a.rest, b.rest),
            select(m, a.t_base, b.t_base)};
}
static inline F3 point_in_voxel(const WideBrickRay& r, I3 voxel, F s) {
    const auto one = [&](I v, F high, F low, F lead, F rest) {
        return min(max(coordinate(to_float(v), high, low, lead, rest, s), number(-kFaceOverlap)), number(1.0f + kFaceOverlap));
    };
    return {one(voxel.x, r.high.x, r.low.x, r.lead.x, r.rest.x), one(voxel.y, r.high.y, r.low.y, r.lead.y, r.rest.y),
            one(voxel.z, r.high.z, r.low.z, r.lead.z, r.rest.z)};
}
static inline I cell_of(I whole, F part, F direction, F t) {
    return to_int(floor((to_float(whole) + (part + direction * t)) * kCellsPerVoxel));
}

// Rays under way, one a lane. What they have to do next differs: look at the next cell, enter a brick, walk its voxels, solve a voxel's cubic.
// All that wait for the same do it together, the most first; a lane that is done takes the next ray of the list.
constexpr int kPageWords = int(std::tuple_size_v<WidePage>);

template <bool Half>
struct Marching {
    const WideView& view;
    const WideRays& list;
    const int total;
    MarchHit* const hits;
    RayNote* const notes;
    int next = 0;

    // By lane:
    I number_in_list{};
    Packet packet{};
    F t_max{}, t{};  // t: where the ray has come to, by cells
    I3 cell{};
    I reach{};       // cells further on that are free too
    I box{};         // of the cell's brick, where one was met
    const std::byte* bricks[kLanes] = {};  // codes
    WideBrickRay ray{};
    F enter{}, leave{};  // from ray.t_base: into the voxel, out of the brick
    F past{};            // there no voxel with a solid corner comes any more
    I3 voxel{};
    M looking = none(), testing = none(), entering = none(), walking = none(), solving = none();
    M stepping = none();  // of those looking: not at the cell where they are, but at the next

    void run() {
        while (turn()) continue;
    }
    // Does what most lanes wait for, what is cheap before what is not; false when there is nothing left to do. The weights were found by
    // trying.
    bool turn() {
        constexpr int kSpare = 3 * kLanes / 8;  // lanes that wait for new rays
        const int look = count(looking), test = count(testing), in = count(entering), walk = count(walking), solve = count(solving);
        const int busy = look + test + in + walk + solve;
        if (next < total && kLanes - busy >= kSpare) {
            take();
        } else if (busy == 0) {
            return false;
        } else if (2 * solve >= max_of(max_of(2 * look, 2 * in), max_of(3 * walk, 2 * test))) {
            solve_voxels();
        } else if (2 * in >= 3 * max_of(max_of(look, walk), test)) {
            enter_bricks();
        } else if (test >= max_of(look, walk)) {
            test_boxes();
        } else if (2 * walk >= look) {
            walk_voxels();
        } else {
            do {
                look_at_cells();
            } while (count(looking) > kLanes / 2);
        }
        return true;
    }

    static int max_of(int a, int b) { return a < b ? b : a; }

    // Gives the next rays to free lanes.
    void take() {
        const M free = without(all(), either(either(either(looking, testing), entering), either(walking, solving)));
        uint32_t lanes = bits(free);
        int taken = __builtin_popcount(lanes);
        for (; taken > total - next; --taken) lanes &= lanes - 1;
        const M fresh = mask_of(lanes);
        const auto rays = [&](const auto* from, auto others) { return expand(fresh, others, from + next); };
        const auto component = [](F d) { return select(lt(abs(d), number(1e-12f)), number(0), d); };
        const auto inverse = [](F d) { return select(eq(d, number(0)), number(0), 1.0f / d); };
        Packet p;
        p.whole = {rays(list.whole[0], splat(0)) - view.grid.cell_x * kBrickVoxels,
                   rays(list.whole[1], splat(0)) - view.grid.cell_y * kBrickVoxels,
                   rays(list.whole[2], splat(0)) - view.grid.cell_z * kBrickVoxels};
        p.part = {rays(list.part[0], number(0)), rays(list.part[1], number(0)), rays(list.part[2], number(0))};
        p.direction = {component(rays(list.direction[0], number(0))), component(rays(list.direction[1], number(0))),
                       component(rays(list.direction[2], number(0)))};
        p.inverse = {inverse(p.direction.x), inverse(p.direction.y), inverse(p.direction.z)};
        p.flat_x = eq(p.inverse.x, number(0));
        p.flat_y = eq(p.inverse.y, number(0));
        p.flat_z = eq(p.inverse.z, number(0));
        p.up_x = lt(number(0), p.inverse.x);
        p.up_y = lt(number(0), p.inverse.y);
        p.up_z = lt(number(0), p.inverse.z);
        const auto bit = [](M up, int octant) { return select(up, splat(way_shift(octant)), splat(0)); };
        p.octant = bit(p.up_x, 1) + bit(p.up_y, 2) + bit(p.up_z, 4);
        packet = select(fresh, p, packet);
        number_in_list = select(fresh, expand(fresh, splat(0), kCounting.of) + next, number_in_list);
        t_max = rays(list.t_max, t_max);
        next += taken;

        // Into the grid.
        const GridParams& g = view.grid;
        F from = number(0), end = t_max;
        const auto clip = [&](M up, int cells, I whole_texel, F in_texel, F inverse_direction, M flat) {
            const I wide = splat(cells * kBrickVoxels);
            from = max(from, texel_crossing(select(up, splat(0), wide), whole_texel, in_texel, inverse_direction, flat, -kFarVoxels));
            end = min(end, texel_crossing(select(up, wide, splat(0)), whole_texel, in_texel, inverse_direction, flat, kFarVoxels));
        };
        clip(packet.up_x, g.size_x, packet.whole.x, packet.part.x, packet.inverse.x, packet.flat_x);
        clip(packet.up_y, g.size_y, packet.whole.y, packet.part.y, packet.inverse.y, packet.flat_y);
        clip(packet.up_z, g.size_z, packet.whole.z, packet.part.z, packet.inverse.z, packet.flat_z);
        M in = both(fresh, le(from, end));
        t = select(in, from, t);
        const auto enter_axis = [&](I& c, I whole_texel, F in_texel, F along, int size) {
            const I first = select(in, cell_of(whole_texel, in_texel, along, t), splat(0));
            const M outside = either(lt(first, splat(0)), lt(splat(size - 1), first));
            in = without(in, both(eq(along, number(0)), outside));
            c = select(in, min(max(first, splat(0)), splat(size - 1)), c);  // on the other axes rounding may have put it just outside
        };
        enter_axis(cell.x, packet.whole.x, packet.part.x, packet.direction.x, g.size_x);
        enter_axis(cell.y, packet.whole.y, packet.part.y, packet.direction.y, g.size_y);
        enter_axis(cell.z, packet.whole.z, packet.part.z, packet.direction.z, g.size_z);
        looking = either(looking, in);
        stepping = without(stepping, in);
    }

    void look_at_cells() {
        looking = without(looking, without(both(looking, stepping), step_cells(both(looking, stepping))));
        const I at = (cell.z * view.grid.size_y + cell.y) * view.grid.size_x + cell.x;
        const I way = gather_bytes(view.ways, select(looking, at, splat(0)) << 2);
        const M arrived = both(looking, lt(way, splat(0)));  // kWaySolid
        testing = either(testing, arrived);
        box = select(arrived, way, box);
        looking = without(looking, arrived);
        const M inside = both(looking, has(way, kWayInside));
        if (any(inside)) {
            write(inside, kMarchInside, t, {splat(0), splat(0), splat(0)}, {number(0), number(0), number(0)});
            looking = without(looking, inside);
        }
        reach = (way >> packet.octant) & kWayReach;  // that of lanes elsewhere is set when they come back
        stepping = looking;
    }

    // Leaves the cube of free cells that each lane's cell begins; answers the lanes that are in the grid still.
    M step_cells(M m) {
        const auto border = [&](M up, I c) { return select(up, c + reach + 1, c - reach); };
        const I border_x = border(packet.up_x, cell.x), border_y = border(packet.up_y, cell.y),
                border_z = border(packet.up_z, cell.z);
        const F out_x = texel_crossing(border_x * kBrickVoxels, packet.whole.x, packet.part.x, packet.inverse.x, packet.flat_x, kFarVoxels);
        const F out_y = texel_crossing(border_y * kBrickVoxels, packet.whole.y, packet.part.y, packet.inverse.y, packet.flat_y, kFarVoxels);
        const F out_z = texel_crossing(border_z * kBrickVoxels, packet.whole.z, packet.part.z, packet.inverse.z, packet.flat_z, kFarVoxels);
        const F out_any = min(min(out_x, out_y), out_z);
        t = select(m, max(t, out_any), t);
        const M by_x = eq(out_any, out_x), by_y = without(eq(out_any, out_y), by_x);
        const M by_z = without(without(all(), by_x), by_y);
        if (any(both(m, lt(splat(0), reach)))) {  // the other axes may have moved within the cube
            const auto drift = [&](I& c, M by, M up, M flat, I whole, F part, F direction) {
                const I low = select(up, c, c - reach), high = select(up, c + reach, c);
                c = select(without(without(m, by), flat), min(max(cell_of(whole, part, direction, t), low), high), c);
            };
            drift(cell.x, by_x, packet.up_x, packet.flat_x, packet.whole.x, packet.part.x, packet.direction.x);
            drift(cell.y, by_y, packet.up_y, packet.flat_y, packet.whole.y, packet.part.y, packet.direction.y);
            drift(cell.z, by_z, packet.up_z, packet.flat_z, packet.whole.z, packet.part.z, packet.direction.z);
        }
        const auto leap = [&](I& c, M by, M up, I to) { c = select(both(m, by), select(up, to, to - 1), c); };
        leap(cell.x, by_x, packet.up_x, border_x);
        leap(cell.y, by_y, packet.up_y, border_y);
        leap(cell.z, by_z, packet.up_z, border_z);
        const GridParams& g = view.grid;
        const M in_grid = both(ge0(min(min(cell.x, cell.y), cell.z)),
                               both(both(lt(cell.x, splat(g.size_x)), lt(cell.y, splat(g.size_y))), lt(cell.z, splat(g.size_z))));
        return without(both(m, in_grid), lt(t_max, t));
    }

    // Lanes whose brick holds no hit go on to the next cell.
    void go_on(M m) {
        reach = select(m, splat(0), reach);
        stepping = either(stepping, m);
        looking = either(looking, m);
    }

    // cell_word_index().
    I cell_word_index_of(I3 c) const {
        const I page = ((c.z >> 3) * view.pages_y + (c.y >> 3)) * view.pages_x + (c.x >> 3);
        return (page << 9) + ((c.z & 7) << 6) + ((c.y & 7) << 3) + (c.x & 7);
    }

    I box_corner(int shift) const { return (box >> shift) & 7; }

    // Rays that pass by the box of all voxels with a solid corner go on, the others enter the brick. Positions are rounded, so boxes are taken
    // to be larger than they are.
    void test_boxes() {
        const M m = testing;
        testing = none();
        F in = number(0), out = t_max;
        const F margin = t * 1e-6f + 0.015625f;
        const auto clip = [&](M up, M flat, I c, int low, int high, I whole, F part, F inverse) {
            const I first = c * kBrickVoxels - whole + box_corner(low), last = c * kBrickVoxels - whole + box_corner(high) + 1;
            const F more = abs(inverse) * margin;
            in = max(in, select(flat, number(-kFarVoxels), (to_float(select(up, first, last)) - part) * inverse - more));
            out = min(out, select(flat, number(kFarVoxels), (to_float(select(up, last, first)) - part) * inverse + more));
        };
        clip(packet.up_x, packet.flat_x, cell.x, 0, 9, packet.whole.x, packet.part.x, packet.inverse.x);
        clip(packet.up_y, packet.flat_y, cell.y, 3, 12, packet.whole.y, packet.part.y, packet.inverse.y);
        clip(packet.up_z, packet.flat_z, cell.z, 6, 15, packet.whole.z, packet.part.z, packet.inverse.z);
        const M meets = both(m, le(in, out));
        entering = either(entering, meets);
        go_on(without(m, meets));
    }

    // Each to its first voxel of the box that holds all voxels with a solid corner, as if it had walked there.
    void enter_bricks() {
        const M m = entering;
        entering = none();
        const Lanes index(cell_word_index_of(cell));
        each_lane(m, [&](int i) {
            const WideEntry entry = (*view.pages[index.of[i] / kPageWords])[size_t(index.of[i] % kPageWords)];
            bricks[i] = reinterpret_cast<const std::byte*>(uintptr_t(entry & kWideAddress));
            __builtin_prefetch(bricks[i] - kSolidRowsBeforeCodes);
        });
        ray = select(m, brick_ray_of(packet, {cell.x * kBrickVoxels, cell.y * kBrickVoxels, cell.z * kBrickVoxels}), ray);
        const F first = number(-kFaceOverlap), last = number(float(kBrickVoxels) + kFaceOverlap);
        F in = 0.0f - ray.t_base, out = t_max - ray.t_base;
        const auto clip = [&](M up, F high, F low, F inverse, M flat) {
            in = max(in, crossing(select(up, first, last), high, low, inverse, flat, -kFarVoxels));
            out = min(out, crossing(select(up, last, first), high, low, inverse, flat, kFarVoxels));
        };
        clip(packet.up_x, ray.high.x, ray.low.x, packet.inverse.x, packet.flat_x);
        clip(packet.up_y, ray.high.y, ray.low.y, packet.inverse.y, packet.flat_y);
        clip(packet.up_z, ray.high.z, ray.low.z, packet.inverse.z, packet.flat_z);

        const I3 low{box_corner(0), box_corner(3), box_corner(6)}, high{box_corner(9), box_corner(12), box_corner(15)};
        const auto to_box = [&](M up, I from, I to, F h, F l, F inverse, M flat) {
            return crossing(entry_plane(up, select(up, from, to)), h, l, inverse, flat, -kFarVoxels);
        };
        const auto from_box = [&](M up, I from, I to, F h, F l, F inverse, M flat) {
            return crossing(exit_plane(up, select(up, to, from)), h, l, inverse, flat, kFarVoxels);
        };
        const F to_x = to_box(packet.up_x, low.x, high.x, ray.high.x, ray.low.x, packet.inverse.x, packet.flat_x);
        const F to_y = to_box(packet.up_y, low.y, high.y, ray.high.y, ray.low.y, packet.inverse.y, packet.flat_y);
        const F to_z = to_box(packet.up_z, low.z, high.z, ray.high.z, ray.low.z, packet.inverse.z, packet.flat_z);
        const F from_x = from_box(packet.up_x, low.x, high.x, ray.high.x, ray.low.x, packet.inverse.x, packet.flat_x);
        const F from_y = from_box(packet.up_y, low.y, high.y, ray.high.y, ray.low.y, packet.inverse.y, packet.flat_y);
        const F from_z = from_box(packet.up_z, low.z, high.z, ray.high.z, ray.low.z, packet.inverse.z, packet.flat_z);
        const F to_any = max(max(to_x, to_y), to_z), from_any = min(min(from_x, from_y), from_z);
        const M skips = lt(in, to_any);
        // A walk ends where it comes to `out`, and one that has not begun may begin there.
        const M alive = without(without(m, lt(out, in)), both(skips, either(le(out, to_any), lt(from_any, to_any))));

        const auto voxel_of = [&](F h, F l, F lead, F rest, F s) {
            return to_int(min(max(coordinate(number(0), h, l, lead, rest, s), number(0)), number(6.5f)));
        };
        I3 at{voxel_of(ray.high.x, ray.low.x, ray.lead.x, ray.rest.x, in), voxel_of(ray.high.y, ray.low.y, ray.lead.y, ray.rest.y, in),
              voxel_of(ray.high.z, ray.low.z, ray.lead.z, ray.rest.z, in)};
        if (any(both(alive, skips))) {
            // Planes are crossed in the order of their crossings, those of x before those of y before those of z where they are equal: at
            // `to_any` all crossed before it are behind, and of those crossed right there all up to the last axis that enters the box.
            const M by_z = eq(to_any, to_z), by_y = either(by_z, eq(to_any, to_y));
            const auto skip = [&](I& v, M up, M equal_too, F h, F l, F lead, F rest, F inverse, M flat) {
                const I near = voxel_of(h, l, lead, rest, to_any);  // or next to it
                const auto crossed = [&](F plane, float parallel) {
                    const F s = crossing(plane, h, l, inverse, flat, parallel);
                    return either(lt(s, to_any), both(equal_too, eq(s, to_any)));
                };
                const M ahead = crossed(exit_plane(up, near), kFarVoxels);
                const M behind = without(all(), either(ahead, crossed(entry_plane(up, near), -kFarVoxels)));
                I there = stepped(ahead, up, near);
                there = stepped(behind, without(all(), up), there);
                there = min(max(there, splat(0)), splat(kBrickVoxels - 1));
                const I furthest = select(up, max(there, v), min(there, v));  // a walk never goes back
                v = select(skips, furthest, v);
            };
            skip(at.x, packet.up_x, all(), ray.high.x, ray.low.x, ray.lead.x, ray.rest.x, packet.inverse.x, packet.flat_x);
            skip(at.y, packet.up_y, by_y, ray.high.y, ray.low.y, ray.lead.y, ray.rest.y, packet.inverse.y, packet.flat_y);
            skip(at.z, packet.up_z, by_z, ray.high.z, ray.low.z, ray.lead.z, ray.rest.z, packet.inverse.z, packet.flat_z);
        }
        voxel = select(m, at, voxel);
        enter = select(m, select(skips, to_any, in), enter);
        leave = select(m, out, leave);
        past = select(m, from_any, past);
        Lanes texel(texel_of(at));
        each_lane(alive, [&](int i) {  // they will be read here or nearby
            const std::byte* const row = bricks[i] + texel[i] * (Half ? 2 : 1);
            __builtin_prefetch(row);
            __builtin_prefetch(row + 72 * (Half ? 2 : 1));
        });
        walking = either(walking, alive);
        go_on(without(m, alive));
    }

    F exits(F& out_x, F& out_y, F& out_z) const {
        out_x = crossing(exit_plane(packet.up_x, voxel.x), ray.high.x, ray.low.x, packet.inverse.x, packet.flat_x, kFarVoxels);
        out_y = crossing(exit_plane(packet.up_y, voxel.y), ray.high.y, ray.low.y, packet.inverse.y, packet.flat_y, kFarVoxels);
        out_z = crossing(exit_plane(packet.up_z, voxel.z), ray.high.z, ray.low.z, packet.inverse.z, packet.flat_z, kFarVoxels);
        return min(min(out_x, out_y), out_z);
    }
    // To the next voxel; answers the lanes that are in the brick still.
    M step_voxels(M m, F out_any, F out_x, F out_y) {
        enter = select(m, max(min(out_any, leave), enter), enter);
        const M by_x = eq(out_any, out_x), by_y = without(eq(out_any, out_y), by_x);
        const M by_z = without(without(all(), by_x), by_y);
        voxel.x = stepped(both(m, by_x), packet.up_x, voxel.x);
        voxel.y = stepped(both(m, by_y), packet.up_y, voxel.y);
        voxel.z = stepped(both(m, by_z), packet.up_z, voxel.z);
        const M outside = either(lt(min(min(voxel.x, voxel.y), voxel.z), splat(0)),
                                 lt(splat(kBrickVoxels - 1), max(max(voxel.x, voxel.y), voxel.z)));
        return without(m, either(le(leave, out_any), outside));
    }

    // Past a voxel without a solid corner, whose eight values are positive: it holds no root. Others wait to be solved.
    void walk_voxels() {
        F out_x, out_y, out_z;
        const F out_any = exits(out_x, out_y, out_z);
        const M here = without(walking, lt(past, out_any));
        const Lanes rows(voxel.z * 8 + voxel.y), columns(voxel.x & 7);
        uint32_t solid = 0;
        each_lane(here, [&](int i) {
            solid |= (uint32_t(bricks[i][rows.of[i] - kSolidRowsBeforeCodes]) >> columns.of[i] & 1) << i;
        });
        const M found = mask_of(solid);
        solving = either(solving, found);
        const M still = step_voxels(without(here, found), out_any, out_x, out_y);
        go_on(without(without(walking, found), still));
        walking = still;
    }

    // Reads for the lanes of `m`, one after another: about a third of all lanes, for which gathers take longer.
    template <typename Fn>
    static void each_lane(M m, Fn&& fn) {
        for (uint32_t left = bits(m); left != 0; left &= left - 1) fn(__builtin_ctz(left));
    }
    struct Lanes {
        alignas(64) int32_t of[kLanes];
        explicit Lanes(I v) { std::memcpy(of, &v, sizeof of); }
        int32_t& operator[](int i) { return of[i]; }
        I all() const { return load(of); }
    };

    WideCorners corners_of(M m) const {
        Lanes texel(texel_of(voxel));
        Lanes v00(splat(0)), v10(splat(0)), v01(splat(0)), v11(splat(0));
        each_lane(m, [&](int i) {
            constexpr int kBytes = Half ? 2 : 1;
            const std::byte* const first = bricks[i] + texel[i] * kBytes;
            const auto pair = [first](int32_t& to, int offset) { std::memcpy(&to, first + offset * kBytes, 2 * kBytes); };
            pair(v00[i], 0), pair(v10[i], 8), pair(v01[i], 64), pair(v11[i], 72);
        });
        return {values_of<Half>(v00.all()), values_of<Half>(v10.all()), values_of<Half>(v01.all()),
                values_of<Half>(v11.all())};
    }

    void solve_voxels() {
        const M m = solving;
        solving = none();
        F out_x, out_y, out_z;
        const F out_any = exits(out_x, out_y, out_z);
        const F exit = max(min(out_any, leave), enter);
        const WideCorners corners = corners_of(m);
        const WideCubic cubic = cubic_of(corners, point_in_voxel(ray, voxel, enter), point_in_voxel(ray, voxel, exit));
        // Newton's steps: after one of a thousandth, what is left is a rounding. Whoever asks for notes moves the hit anyway.
        const F root = first_root(cubic, m, notes != nullptr ? 1e-3f : 1e-6f);
        const M hit = both(m, le(root, number(1)));
        if (notes != nullptr) {
            const F least = min(min(cubic.b0, cubic.b1), min(cubic.b2, cubic.b3));
            // Along a surface, be it a little towards it; and where texels may have lost some.
            constexpr float kAlong = 0.1f, kRounding = 0.02f;  // voxels
            const F lost = min(bend_of(corners) * 0.75f + kRounding, number(kNearPassVoxels));
            const M near = both(without(m, hit), both(lt(least, lost), le(cubic.b2, cubic.b3 + kAlong)));
            if (any(near)) note_pass(near, least, ray.t_base + enter, ray.t_base + exit);
        }
        if (any(hit)) {
            const F s = enter + root * (exit - enter);
            const F3 p = point_in_voxel(ray, voxel, s);
            const auto unit = [](F v) { return min(max(v, number(0)), number(1)); };
            write(hit, kMarchHit, ray.t_base + s, voxel, {unit(p.x), unit(p.y), unit(p.z)});
            if (notes != nullptr) note_slope(hit, slope_of(cubic, root) / max(exit - enter, number(1e-6f)));
        }
        const M missed = without(m, hit);
        const M still = step_voxels(missed, out_any, out_x, out_y);
        walking = either(walking, still);
        go_on(without(missed, still));
    }

    void note_pass(M m, F least, F from, F to) const {
        struct {
            int32_t number[kLanes], cell[3][kLanes];
            float least[kLanes], from[kLanes], to[kLanes];
        } lanes;
        const auto store = [](auto& there, auto v) { std::memcpy(&there, &v, sizeof v); };
        store(lanes.number, number_in_list);
        store(lanes.cell[0], cell.x), store(lanes.cell[1], cell.y), store(lanes.cell[2], cell.z);
        store(lanes.least, least), store(lanes.from, from), store(lanes.to, to);
        const GridParams& g = view.grid;
        each_lane(m, [&](int i) {
            NearPass(&passes)[2] = notes[lanes.number[i]].passes;
            if (!(lanes.least[i] < passes[1].least)) return;
            const NearPass pass{lanes.least[i], lanes.from[i], lanes.to[i],
                                {lanes.cell[0][i] + g.cell_x, lanes.cell[1][i] + g.cell_y, lanes.cell[2][i] + g.cell_z}};
            const bool first = pass.least < passes[0].least;
            passes[1] = first ? passes[0] : pass;
            if (first) passes[0] = pass;
        });
    }

    void note_slope(M m, F slope) const {
        Lanes order(number_in_list), slopes(bits_of(slope));
        each_lane(m, [&](int i) { notes[order[i]].slope = std::bit_cast<float>(slopes[i]); });
    }

    void write(M m, int state, F at, I3 in_voxel, F3 p) const {
        struct {
            int32_t number[kLanes], cell[3][kLanes], voxel[3][kLanes];
            float t[kLanes], p[3][kLanes];
        } lanes;
        const auto store = [](auto& to, auto v) { std::memcpy(&to, &v, sizeof v); };
        store(lanes.number, number_in_list);
        store(lanes.cell[0], cell.x), store(lanes.cell[1], cell.y), store(lanes.cell[2], cell.z);
        store(lanes.voxel[0], in_voxel.x), store(lanes.voxel[1], in_voxel.y), store(lanes.voxel[2], in_voxel.z);
        store(lanes.t, at);
        store(lanes.p[0], p.x), store(lanes.p[1], p.y), store(lanes.p[2], p.z);
        const GridParams& g = view.grid;
        for (uint32_t left = bits(m); left != 0; left &= left - 1) {
            const int i = __builtin_ctz(left);
            MarchHit& hit = hits[lanes.number[i]];
            hit.state = state;
            hit.t = lanes.t[i];
            hit.slot = state == kMarchHit ? 0 : -1;
            hit.cell = {lanes.cell[0][i] + g.cell_x, lanes.cell[1][i] + g.cell_y, lanes.cell[2][i] + g.cell_z};
            hit.voxel = {lanes.voxel[0][i], lanes.voxel[1][i], lanes.voxel[2][i]};
            hit.p = {lanes.p[0][i], lanes.p[1][i], lanes.p[2][i]};
        }
    }
};

void march(const WideView& view, const WideRays& rays, int count, MarchHit* hits, RayNote* notes) {
    for (int i = 0; notes != nullptr && i < count; ++i)
        for (NearPass& pass : notes[i].passes) pass.least = kNearPassVoxels;
    MarchHit miss{};
    miss.state = kMarchMiss;
    miss.slot = -1;
    for (int i = 0; i < count; ++i) {
        std::memcpy(hits + i, &miss, sizeof miss);  // whole: member by member is four times as many stores
        hits[i].t = rays.t_max[i];
    }
    if (view.texel_bytes == 2) {
        Marching<true>{view, rays, count, hits, notes}.run();
    } else {
        Marching<false>{view, rays, count, hits, notes}.run();
    }
}

// SPDX-License-Identifier: MIT
// Distances at points, a packet of them at a time. Included after wide_math.inl.

// Lanes that do not count may ask for any texel of any brick.
template <bool Half>
static inline WideCorners corners_at(const Pointers& brick, I texel) {
    if constexpr (Half) {
        const Pointers at = moved(brick, texel * 2);
        return {values_of<Half>(gather_from<0>(at)), values_of<Half>(gather_from<16>(at)),
                values_of<Half>(gather_from<128>(at)), values_of<Half>(gather_from<144>(at))};
    } else {
        const auto pair = [&](I first) {
            const I at = min(first, splat(kBrickTexelCount - 4));  // four bytes that end in the brick
            return values_of<Half>(gather_from<0>(moved(brick, at)) >> ((first - at) * 8));
        };
        return {pair(texel), pair(texel + 8), pair(texel + 64), pair(texel + 72)};
    }
}

// Flags of an entry (wide.h), as they stand in its upper half.
constexpr int32_t kInsideFlag = int32_t(kWideInside >> 32);
static inline M is_occupied(I flags) { return lt(flags, splat(0)); }
static inline I jump_of(I flags) { return (flags >> (kWideJumpShift - 32)) & 7; }

// Where cells of the grid have their entries: which page, which of its words.
struct CellPlace {
    I page, word;
};
static inline CellPlace cell_place(const WideView& view, I3 cell) {
    return {((cell.z >> 3) * view.pages_y + (cell.y >> 3)) * view.pages_x + (cell.x >> 3),
            ((cell.z & 7) * 8 + (cell.y & 7)) * 8 + (cell.x & 7)};
}
static inline Pointers entries_of(const WideView& view, const CellPlace& at, I& flags) {
    return gather_entries(moved(gather_pages(view.pages, at.page), at.word * int32_t(sizeof(WideEntry))), flags);
}

// A packet of points in voxels: whole numbers (any for points far outside the grid), and the places in the voxels. A place of -0 where a
// float's floor would leave 0 changes no answer: no texel is -0, so no sum of weighed ones is.
struct Split {
    I3 whole;
    F3 part;

    Split(const WideView& view, F3 p) {
        const auto axis = [&](F v, I& down, F& rest) {
            const F q = v * view.inverse_voxel;
            down = floor_to_int(q);
            rest = q - to_float(down);
        };
        axis(p.x, whole.x, part.x);
        axis(p.y, whole.y, part.y);
        axis(p.z, whole.z, part.z);
    }
};

// One axis of a point: its cell in the grid and the voxel in the cell (whole numbers), the place in the voxel.
struct Place {
    F cell, voxel, part;
    M inside;
};
static inline Place place_of(I at, F part, float first_texel, float past_texel) {
    const F whole = to_float(at);
    const F texel = whole - first_texel;
    const F cell = floor((texel + 0.5f) * (1.0f / 7.0f));  // right for grids of fewer than 2^22 texels an axis
    const M inside = both(le(number(first_texel), whole), lt(whole, number(past_texel)));
    return {cell, texel - cell * 7.0f, part, inside};
}

// A packet of points.
struct Located {
    Place x, y, z;
    M inside;
    CellPlace cell;  // of the grid's first cell for points outside the grid

    Located(const WideView& view, const Split& p) {
        x = place_of(p.whole.x, p.part.x, view.low[0], view.high[0]);
        y = place_of(p.whole.y, p.part.y, view.low[1], view.high[1]);
        z = place_of(p.whole.z, p.part.z, view.low[2], view.high[2]);
        inside = both(both(x.inside, y.inside), z.inside);
        const auto held = [&](F c) { return select(inside, to_int(c), splat(0)); };  // before they are multiplied
        cell = cell_place(view, {held(x.cell), held(y.cell), held(z.cell)});
    }
    I texel() const { return to_int(z.voxel * 64.0f + (y.voxel * 8.0f + x.voxel)); }  // any number beyond the grid
    F3 part() const { return {x.part, y.part, z.part}; }
    // The answer where there is no brick, voxels.
    F empty(I flags) const {
        // Every cell nearer than the jump is empty too.
        const auto to_face = [](const Place& a) {
            const F at = a.voxel + a.part;
            return min(at, 7.0f - at);
        };
        const I jump = jump_of(flags);
        const F free = to_float(jump - 1) * 7.0f + min(min(to_face(x), to_face(y)), to_face(z));
        const F size = select(eq(jump, splat(0)), number(0), free);
        return select(inside, select(has(flags, kInsideFlag), -size, size), number(0));
    }
};

// Points whose texels are on their way from memory.
struct Waiting {
    Pointers brick;  // of some texels where there is no brick
    I texel;
    M occupied;
    F3 part;
    F empty;
    int at;  // in the list
};

static inline void wait_for(const WideView& view, const Located& p, Waiting& out) {
    I flags;
    out.brick = entries_of(view, p.cell, flags);
    out.occupied = both(p.inside, is_occupied(flags));
    out.texel = select(out.occupied, p.texel(), splat(0));
    out.part = p.part();
    out.empty = number(0);
    if (any(without(p.inside, out.occupied))) out.empty = p.empty(flags);
}

template <bool Half>
static inline F answer(const Waiting& at) {
    if (!any(at.occupied)) return at.empty;
    return select(at.occupied, trilinear(corners_at<Half>(at.brick, at.texel), at.part), at.empty);
}

// Of any numbers: what does not fit is cut off.
typedef uint32_t U __attribute__((vector_size(sizeof(I))));
static inline I texel_in_space(I3 v) { return (I)(((U)v.z * 8u + (U)v.y) * 8u + (U)v.x); }
static inline M in_cell(I v, int32_t first) { return below((I)((U)v - uint32_t(first)), 7); }

// The grid's texels by axis.
struct GridTexels {
    int32_t first[3];
    uint32_t count[3];

    explicit GridTexels(const WideView& view) {
        for (size_t axis = 0; axis < 3; ++axis) {
            first[axis] = int32_t(view.low[axis]);
            count[axis] = uint32_t(int32_t(view.high[axis]) - first[axis]);
        }
    }
};

#ifdef KILN_PAIRS_BY_ROWS
// Where halves of each lane's texel lie, `origin` being texel 0's.
struct TexelsOf {
    int32_t texel[kLanes];
    explicit TexelsOf(I of) { std::memcpy(texel, &of, sizeof texel); }
    const std::byte* of(uintptr_t origin, int lane) const {
        return reinterpret_cast<const std::byte*>(origin + uintptr_t(intptr_t(texel[lane]) * 2));
    }
};
#endif

// A packet whose neighbours lie in few cells, as points do that are asked in the order of space: a cell is looked up once for all its
// lanes, and their texels are read from one base.
template <bool Half>
struct Neighbours {
    static constexpr int kBytes = Half ? 2 : 1;
    struct Cell {
        M here;                  // lanes in it
        int32_t flags;           // of its entry
        const std::byte* first;  // code that the lane asked for reads
        uintptr_t origin;        // where the code of texel 0 in space would be, were all of space one brick
    };

    I3 whole;
    I texel;  // in space, counted as those of a brick
    int32_t lanes[3][kLanes];

    explicit Neighbours(const I3& at) : whole(at), texel(texel_in_space(at)) {
        std::memcpy(lanes[0], &at.x, sizeof lanes[0]);
        std::memcpy(lanes[1], &at.y, sizeof lanes[1]);
        std::memcpy(lanes[2], &at.z, sizeof lanes[2]);
    }
    // The cell of one lane. False outside the grid.
    bool find(const WideView& view, const GridTexels& grid, int lane, Cell& cell) const {
        const int32_t at[3] = {lanes[0][lane], lanes[1][lane], lanes[2][lane]};
        uint64_t place = 0;
        for (size_t axis = 0; axis < 3; ++axis) {
            const uint32_t from_first = uint32_t(at[axis]) - uint32_t(grid.first[axis]);
            if (from_first >= grid.count[axis]) return false;
            place += view.places[axis][from_first];
        }
        const int32_t row = int32_t(uint32_t(place));
        cell.here = both(both(in_cell(whole.x, at[0] - (row & 7)), in_cell(whole.y, at[1] - (row >> 3 & 7))),
                         in_cell(whole.z, at[2] - (row >> 6)));
        constexpr size_t kWords = std::tuple_size_v<WidePage>;
        const size_t index = size_t(place >> 32);
        const WideEntry entry = (*view.pages[index / kWords])[index % kWords];
        cell.flags = int32_t(entry >> 32);
        cell.first = reinterpret_cast<const std::byte*>(uintptr_t(entry & kWideAddress)) + row * kBytes;
        cell.origin = uintptr_t(cell.first) - uintptr_t(int64_t((at[2] * 8 + at[1]) * 8 + at[0]) * kBytes);
        return true;
    }
    // The first codes of a row's pair, of four by y and z. Of bytes, the last pair is the upper two of four that end in the brick.
    static const void* pairs(uintptr_t origin, int pair) {
        constexpr int kOffsets[4] = {0, 8 * kBytes, 64 * kBytes, Half ? 72 * kBytes : 70};
        return reinterpret_cast<const void*>(origin + uintptr_t(kOffsets[pair]));
    }
    static F blend(const I (&codes)[4], const F3& part) {
        return trilinear({values_of<Half>(codes[0]), values_of<Half>(codes[1]), values_of<Half>(codes[2]),
                          values_of<Half>(Half ? codes[3] : codes[3] >> 16)},
                         part);
    }
    // Of points in more cells than that of the first, `cell`. False where that is a lane a cell, or one is outside the grid.
    bool answer(const WideView& view, const GridTexels& grid, const Split& p, Cell cell, F& out) const {
        I codes[4]{}, flags{};
        M left = all();
#ifdef KILN_PAIRS_BY_ROWS
        const TexelsOf from(texel);
        const std::byte* at[kLanes];
#endif
        for (;;) {
            const M here = both(left, cell.here);
            left = without(left, here);
            if ((bits(here) & (bits(here) - 1)) == 0 && any(left)) return false;
#ifdef KILN_PAIRS_BY_ROWS
            if constexpr (Half) {
                for (uint32_t lanes_here = bits(here); lanes_here != 0; lanes_here &= lanes_here - 1) {
                    const int lane = __builtin_ctz(lanes_here);
                    at[lane] = from.of(cell.origin, lane);
                }
            } else
#endif
                for (int i = 0; i < 4; ++i)
                    codes[i] = gather_bytes<kBytes>(here, pairs(cell.origin, i), texel, codes[i]);
            flags = select(here, splat(cell.flags), flags);
            if (!any(left)) break;
            if (!find(view, grid, __builtin_ctz(bits(left)), cell)) return false;
        }
#ifdef KILN_PAIRS_BY_ROWS
        if constexpr (Half) pairs_by_rows(at, codes);
#endif
        out = blend(codes, p.part);
        const M occupied = is_occupied(flags);
        if (any(without(all(), occupied))) out = select(occupied, out, Located(view, p).empty(flags));
        return true;
    }
};

// Points in one brick, whose texels are on their way.
struct Near {
    I texel;
    F3 part;
    uintptr_t origin;
    int at;  // in the list
};
template <bool Half>
static inline F answer(const Near& p) {
    using Codes = Neighbours<Half>;
    I codes[4];
#ifdef KILN_PAIRS_BY_ROWS
    if constexpr (Half) {
        const TexelsOf from(p.texel);
        const std::byte* at[kLanes];
        for (int lane = 0; lane < kLanes; ++lane) at[lane] = from.of(p.origin, lane);
        pairs_by_rows(at, codes);
        return Codes::blend(codes, p.part);
    }
#endif
    for (int i = 0; i < 4; ++i) codes[i] = gather_bytes<Codes::kBytes>(Codes::pairs(p.origin, i), p.texel);
    return Codes::blend(codes, p.part);
}

template <bool Half>
static void all_distances(const WideView& view, const sdf::Points& points, float* out) {
    constexpr int kBlock = 128;      // points whose texels are fetched together
    constexpr int kAhead = 2 * kBlock;  // points that are fetched before they are asked for: processors do not look past a page's end
    Waiting waiting[kBlock / kLanes];
    Near near[kBlock / kLanes];
    const GridTexels grid(view);
    const float cell_size = 7 * view.grid.voxel_size;
    for (int at = 0; at < points.count; at += kBlock) {
        const int count = points.count - at < kBlock ? points.count - at : kBlock;
        const float* from[3] = {points.x + at, points.y + at, points.z + at};
        float padded[3][kBlock], answers[kBlock];
        if (count < kBlock) {
            for (int axis = 0; axis < 3; ++axis) {
                for (int i = 0; i < kBlock; ++i) padded[axis][i] = from[axis][i < count ? i : count - 1];
                from[axis] = padded[axis];
            }
        }
        float* const to = count < kBlock ? answers : out + at;
        const auto store = [&](int i, F d) {
            d = d * view.grid.voxel_size;
            std::memcpy(to + i, &d, sizeof d);
        };
        const auto fetch = [](const float* array, int i) {
            return reinterpret_cast<const void*>(uintptr_t(array) + size_t(i) * sizeof(float));
        };
        // Two points tell whether to look for neighbours: it would be in vain for points of chance.
        const bool in_order = std::abs(from[0][0] - from[0][1]) < cell_size;
        int n = 0, m = 0;
        for (int i = 0; i < kBlock; i += kLanes) {
            for (const float* const array : {from[0], from[1], from[2]}) __builtin_prefetch(fetch(array, i + kAhead));
            __builtin_prefetch(fetch(to, i + kAhead), 1);
            const Split p(view, {load(from[0] + i), load(from[1] + i), load(from[2] + i)});
            if (in_order) {
                const Neighbours<Half> all_here(p.whole);
                typename Neighbours<Half>::Cell cell;
                const bool found = all_here.find(view, grid, 0, cell);
                if (found && !any(without(all(), cell.here))) {
                    if (cell.flags < 0) {
                        near[m++] = {all_here.texel, p.part, cell.origin, i};
                        __builtin_prefetch(cell.first);
                        __builtin_prefetch(cell.first + 72 * (Half ? 2 : 1));
                    } else {
                        store(i, Located(view, p).empty(splat(cell.flags)));
                    }
                    continue;
                }
                if (F d; found && all_here.answer(view, grid, p, cell, d)) {
                    store(i, d);
                    continue;
                }
            }
            Waiting& w = waiting[n++];
            w.at = i;
            wait_for(view, Located(view, p), w);
            const Pointers texels = moved(w.brick, w.texel * (Half ? 2 : 1));
            const std::byte* rows[kLanes];
            std::memcpy(rows, &texels, sizeof rows);
            for (const std::byte* const row : rows) {
                __builtin_prefetch(row);
                __builtin_prefetch(row + 72 * (Half ? 2 : 1));
            }
        }
        for (int i = 0; i < m; ++i) store(near[i].at, answer<Half>(near[i]));
        for (int i = 0; i < n; ++i) store(waiting[i].at, answer<Half>(waiting[i]));
        if (count < kBlock) std::memcpy(out + at, answers, sizeof(float) * size_t(count));
    }
}

void distances(const WideView& view, const sdf::Points& points, float* out) {
    if (view.texel_bytes == 2) {
        all_distances<true>(view, points, out);
    } else {
        all_distances<false>(view, points, out);
    }
}

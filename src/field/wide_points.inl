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

// One axis of a point: its cell in the grid and the voxel in the cell (whole numbers), the place in the voxel.
struct Place {
    F cell, voxel, part;
    M inside;
};
static inline Place place_of(F p, F inverse_voxel, float first_texel, float past_texel) {
    const F q = p * inverse_voxel;
    const F down = floor(q);
    const F texel = down - first_texel;
    const F cell = floor((texel + 0.5f) * (1.0f / 7.0f));  // right for grids of fewer than 2^22 texels an axis
    const M inside = both(le(number(first_texel), down), lt(down, number(past_texel)));
    return {cell, texel - cell * 7.0f, q - down, inside};
}

// A packet of points.
struct Located {
    Place x, y, z;
    M inside;
    CellPlace cell;  // of the grid's first cell for points outside the grid

    Located(const WideView& view, F3 p) {
        const F inverse = number(view.inverse_voxel);
        x = place_of(p.x, inverse, view.low[0], view.high[0]);
        y = place_of(p.y, inverse, view.low[1], view.high[1]);
        z = place_of(p.z, inverse, view.low[2], view.high[2]);
        inside = both(both(x.inside, y.inside), z.inside);
        const auto held = [&](F c) { return select(inside, to_int(c), splat(0)); };  // before they are multiplied
        cell = cell_place(view, {held(x.cell), held(y.cell), held(z.cell)});
    }
    I row() const { return to_int(y.voxel * 8.0f + x.voxel); }
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

#ifdef KILN_WIDE_SLICES
// Neighbours that lie in one or two cells, as points do that are asked in the order of space: no texel is gathered, each slice of
// voxels is read once. False where they lie in more.
template <bool Half>
static inline bool answer_by_slices(const WideView& view, const Located& p, F& out) {
    const I index = p.cell.page * int32_t(std::tuple_size_v<WidePage>) + p.cell.word;
    const M first = eq(index, splat(index[0])), others = without(all(), first);
    if (any(without(all(), p.inside)) || any(without(others, eq(index, splat(index[kLanes - 1]))))) return false;
    const I slice = to_int(p.z.voxel);
    const Words texel = pair_of(p.row());
    Words v00{}, v10{}, v01{}, v11{};
    I flags = splat(0);
    const auto codes_of = [&](int one) {
        const WideEntry entry = (*view.pages[p.cell.page[one]])[size_t(p.cell.word[one])];
        flags = select(one == 0 ? all() : others, splat(int32_t(entry >> 32)), flags);
        return reinterpret_cast<const std::byte*>(uintptr_t(entry & kWideAddress));
    };
    constexpr int kSlice = Half ? 128 : 64;  // bytes
    const auto look = [&](const std::byte* codes, M lanes) {
        const SliceTable near = slice_table<Half>(codes), far = slice_table<Half>(codes + kSlice);
        v00 = looked_up(near, texel, 0, lanes, v00);
        v10 = looked_up(near, texel, 8, lanes, v10);
        v01 = looked_up(far, texel, 0, lanes, v01);
        v11 = looked_up(far, texel, 8, lanes, v11);
    };
    // Mostly all lie in the slices of the first and the last point, be they one or two: both are read, and no branch is to be foreseen.
    const int first_z = slice[0], last_z = slice[kLanes - 1];
    const std::byte* const near_codes = codes_of(0);
    const std::byte* const far_codes = codes_of(kLanes - 1);
    const M in_last = both(eq(index, splat(index[kLanes - 1])), eq(slice, splat(last_z)));
    look(near_codes + first_z * kSlice, all());
    look(far_codes + last_z * kSlice, in_last);
    M left = without(without(all(), both(first, eq(slice, splat(first_z)))), in_last);
    if (any(left)) {
        int32_t slices[kLanes];
        std::memcpy(slices, &slice, sizeof slices);
        do {
            const int one = __builtin_ctz(bits(left));
            const M cell = (bits(first) >> one & 1u) != 0 ? first : others;
            const M here = both(cell, eq(slice, splat(slices[one])));
            look(((bits(first) >> one & 1u) != 0 ? near_codes : far_codes) + slices[one] * kSlice, here);
            left = without(left, here);
        } while (any(left));
    }
    WideCorners corners;
    values_of<Half>(v00, corners.v00.a, corners.v00.b);
    values_of<Half>(v10, corners.v10.a, corners.v10.b);
    values_of<Half>(v01, corners.v01.a, corners.v01.b);
    values_of<Half>(v11, corners.v11.a, corners.v11.b);
    out = trilinear(corners, p.part());
    const M occupied = is_occupied(flags);
    if (any(without(all(), occupied))) out = select(occupied, out, p.empty(flags));
    return true;
}
#endif

template <bool Half>
static void all_distances(const WideView& view, const sdf::Points& points, float* out) {
    constexpr int kBlock = 128;  // points whose texels are fetched together
    Waiting waiting[kBlock / kLanes];
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
        int n = 0;
        for (int i = 0; i < kBlock; i += kLanes) {
            const Located p(view, {load(from[0] + i), load(from[1] + i), load(from[2] + i)});
#ifdef KILN_WIDE_SLICES
            if (F d; answer_by_slices<Half>(view, p, d)) {
                store(i, d);
                continue;
            }
#endif
            Waiting& w = waiting[n++];
            w.at = i;
            wait_for(view, p, w);
            const Pointers texels = moved(w.brick, w.texel * (Half ? 2 : 1));
            const std::byte* rows[kLanes];
            std::memcpy(rows, &texels, sizeof rows);
            for (const std::byte* const row : rows) {
                __builtin_prefetch(row);
                __builtin_prefetch(row + 72 * (Half ? 2 : 1));
            }
        }
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

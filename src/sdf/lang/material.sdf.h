// SPDX-License-Identifier: MIT
// Up to two materials at a point, and how operands' materials mix. Numbers are exact integers held in `real`.
// A blend sums equal materials, keeps the two heaviest (ties to the lower number) and gives them all the weight.

struct Mix {
    real id0;    // heaviest; 65535: none at all
    real id1;    // 65535 when share is 0
    real share;  // of id1, in [0, 1/2]
};

KILN_SDF Mix make_mix(real id0, real id1, real share) {
    Mix m;
    m.id0 = id0;
    m.id1 = id1;
    m.share = share;
    return m;
}
KILN_SDF Mix select_mix(mask m, Mix a, Mix b) {
    return make_mix(select(m, a.id0, b.id0), select(m, a.id1, b.id1), select(m, a.share, b.share));
}
KILN_SDF mask same(real a, real b) { return both(le(a, b), ge(a, b)); }
// Does weight wa of material a go before weight wb of material b?
KILN_SDF mask heavier(real wa, real a, real wb, real b) { return either(gt(wa, wb), both(same(wa, wb), lt(a, b))); }

// a and b mixed, t being b's share in [0, 1]. t = 0 gives a's bits, t = 1 gives b's. Where b has no material, a's shows; where only
// a has none, the nearer of the two decides.
KILN_SDF Mix blend_mix(Mix a, Mix b, real t_wanted) {
    real none = 65535.0f;
    real nearer = select(lt(t_wanted, real(0.5f)), real(0.0f), real(1.0f));
    real t = select(same(a.id0, none), nearer, t_wanted);
    t = select(same(b.id0, none), real(0.0f), t);
    real a0 = (1.0f - t) * (1.0f - a.share);
    real a1 = (1.0f - t) * a.share;
    real b0 = t * (1.0f - b.share);
    real b1 = t * b.share;
    mask b0_is_a0 = same(b.id0, a.id0);
    mask b0_is_a1 = same(b.id0, a.id1);
    mask b1_is_a0 = same(b.id1, a.id0);
    mask b1_is_a1 = same(b.id1, a.id1);
    a0 = a0 + select(b0_is_a0, b0, real(0.0f)) + select(b1_is_a0, b1, real(0.0f));
    a1 = a1 + select(b0_is_a1, b0, real(0.0f)) + select(b1_is_a1, b1, real(0.0f));
    b0 = select(either(b0_is_a0, b0_is_a1), real(0.0f), b0);
    b1 = select(either(b1_is_a0, b1_is_a1), real(0.0f), b1);

    mask a_in_order = heavier(a0, a.id0, a1, a.id1);
    real high_a = select(a_in_order, a0, a1);
    real high_a_id = select(a_in_order, a.id0, a.id1);
    real low_a = select(a_in_order, a1, a0);
    real low_a_id = select(a_in_order, a.id1, a.id0);
    mask b_in_order = heavier(b0, b.id0, b1, b.id1);
    real high_b = select(b_in_order, b0, b1);
    real high_b_id = select(b_in_order, b.id0, b.id1);
    real low_b = select(b_in_order, b1, b0);
    real low_b_id = select(b_in_order, b.id1, b.id0);

    mask a_first = heavier(high_a, high_a_id, high_b, high_b_id);
    real first = select(a_first, high_a, high_b);
    real first_id = select(a_first, high_a_id, high_b_id);
    real other_a = select(a_first, low_a, high_a);
    real other_a_id = select(a_first, low_a_id, high_a_id);
    real other_b = select(a_first, high_b, low_b);
    real other_b_id = select(a_first, high_b_id, low_b_id);
    mask a_second = heavier(other_a, other_a_id, other_b, other_b_id);
    real second = select(a_second, other_a, other_b);
    real second_id = select(a_second, other_a_id, other_b_id);

    mask alone = le(second, real(0.0f));
    real share = select(alone, real(0.0f), second / max(first + second, KILN_C(1e-30)));
    Mix blended = make_mix(first_id, select(alone, none, second_id), share);
    blended = select_mix(ge(t, real(1.0f)), b, blended);
    return select_mix(le(t, real(0.0f)), a, blended);
}

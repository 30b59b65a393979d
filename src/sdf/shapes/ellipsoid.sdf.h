// SPDX-License-Identifier: MIT
// Ellipsoid with its axes along x, y and z. Exact to rounding.
//
// The nearest point q of p >= 0 has p - q = t n(q), that is q_i = r_i² p_i / (t + r_i²) with Σ (r_i p_i / (t + r_i²))² = 1, t above
// -(smallest r)². The root of 1/|v(t)| = 1, v_i = r_i p_i / (t + r_i²), is sought with Halley's method: that function is concave and
// close to linear (Moré and Sorensen, "Computing a Trust Region Step", 1983). Newton's step from below never passes the root;
// Halley's is longer, at most four times, and where it has passed, the geometric mean with the last point below bounds the way back.
// A step that changed t by less than a sixteenth of itself has left an error of the cube of that, and is the last: two steps as a rule, nine
// at most, which are within 1e-6 of the largest radius for proportions up to 1 : 10000.
// The answer does not trust the root: for every direction w the plane that touches the ellipsoid there is no farther than the
// ellipsoid, so (w·p - |r w|) / |w| is a lower bound of the signed distance whatever t was, and off by the square of t's error.
// With w_i = p_i / (t + r_i²) it is t |w| + |v| (|v| - 1) / |w|, which does not cancel.

struct Ellipsoid {
    param3 radii;  // = (0.5, 0.35, 0.25) m, > 0: centre to surface along each axis
};

KILN_SDF real sd_ellipsoid(real3 p, Ellipsoid s) {
    // In units of the largest radius. tau = t + low² > 0, so that the denominators tau + (r_i² - low²) do not cancel.
    param unit = max(s.radii.x, max(s.radii.y, s.radii.z));
    param3 r = s.radii / unit;
    param low = min(r.x, min(r.y, r.z));
    param3 e = param3((r.x - low) * (r.x + low), (r.y - low) * (r.y + low), (r.z - low) * (r.z + low));
    // On the planes of symmetry the nearest point is not unique: step off them by less than rounding.
    param off = low * KILN_C(1e-9);
    real3 q = max(abs(p) / unit, real3(off, off, off));
    // Below the root: each axis alone, and all axes with the farthest pole.
    real3 rq = r * q;
    real tau = max(max(rq.x - e.x, length(rq) - max(e.x, max(e.y, e.z))), max(rq.y - e.y, rq.z - e.z));
    real below = tau;
    mask done = lt(tau, tau);
    for (int i = 0; i < 9; ++i) {
        real3 k = real3(1.0f / (e.x + tau), 1.0f / (e.y + tau), 1.0f / (e.z + tau));
        real3 v = rq * k;
        real3 vv = v * v;
        real3 m = k * tau;
        // |v|² and -1/2 and 1/6 of tau times its first and tau² times its second derivative.
        real total = vv.x + vv.y + vv.z;
        real inverse = 1.0f / dot(vv, m);
        real second = dot(vv, m * m);
        real excess = sqrt(total) - 1.0f;
        real newton = total * inverse;
        real halley = max(1.0f - 1.5f * excess * (newton * second * inverse - 1.0f), 0.25f);
        real change = excess * newton / halley;
        below = select(gt(excess, 0.0f), tau, below);
        tau = select(done, tau, max(tau * (1.0f + change), sqrt(below * tau)));
        done = either(done, lt(abs(change), 0.0625f));
        if (all_of(done)) break;
    }
    real3 w = q / real3(e.x + tau, e.y + tau, e.z + tau);
    real n = length(r * w);
    real size = length(w);
    return ((tau - low * low) * size + n * (n - 1.0f) / size) * unit;
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_ellipsoid(Ellipsoid s) { return symmetric(s.radii.x, s.radii.y, s.radii.z); }
#endif

// SPDX-License-Identifier: MIT
float ring(vec3 p, float r) { return length(vec2(length(p.xz) - r, p.y)) - 0.1; }
float shape(vec3 p) {
    float d = 1e9;
    for (int i = 0; i < 3; i++) {
        vec3 q = p * mat3(1.0, 0.0, 0.0, 0.0, 0.8, -0.6, 0.0, 0.6, 0.8);
        if (q.x > 0.0) { q.x -= 0.25 * float(i); } else { q = abs(q); }
        d = min(d, i == 1 ? ring(q, 0.5) : ring(q.zyx, 0.4));
    }
    return d;
}

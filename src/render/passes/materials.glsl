// SPDX-License-Identifier: MIT
// Materials by number, mixed into a surface. The including kernel declares first: FrameParams frame, MaterialEntry material_table[], and
// has surface.glsl.

MaterialRecord material_of(uint number) {
    return material_table[material_table[number < frame.material_count ? number : 0u].row_of_number].row;
}

void add_material(inout SurfaceSample s, uint number, float weight) {
    MaterialRecord m = material_of(number);
    s.albedo += weight * vec3(m.base_red, m.base_green, m.base_blue);
    s.emissive += weight * vec3(m.emissive_red, m.emissive_green, m.emissive_blue);
    s.roughness += weight * m.roughness;
    s.metallic += weight * m.metallic;
}

vec3 unit_or(vec3 v, vec3 other) {
    float size = length(v);
    return size > 1e-20 ? v / size : other;
}

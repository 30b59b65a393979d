#version 460
// SPDX-License-Identifier: MIT
// What points of meshes look like: normal and material, into the words that resolve leaves empty there.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/mesh.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 2, std430) readonly buffer Parts { MeshPart mesh_parts[]; };
layout(set = 0, binding = 3, std430) readonly buffer MeshCorners { uint mesh_corners[]; };
layout(set = 0, binding = 4, std430) readonly buffer Vertices { MeshVertex mesh_vertices[]; };
layout(set = 0, binding = 5, std430) readonly buffer Surfaces { MeshSurface mesh_surfaces[]; };
layout(set = 0, binding = 6) uniform utexture2D visibility;
layout(set = 0, binding = 7, rgba32ui) writeonly uniform uimage2D surface_words;
#define KILN_PAGES 8
#include "render/passes/mesh_textures.glsl"
#include "render/passes/mesh.glsl"
#include "render/passes/rays.glsl"
#include "render/passes/surface.glsl"

vec3 unit_or(vec3 v, vec3 other) {
    float size = length(v);
    return size > 1e-20 ? v / size : other;
}

uint corners[3];
vec3 weights, weights_x, weights_y;  // at the pixel's middle, and one pixel to its right and down

bool is_there(MeshTexture t) { return (t.where & kTextureIs) != 0u; }

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    uvec4 seen = texelFetch(visibility, pixel, 0);
    if ((seen.y >> 28u) != kSeenMesh) return;
    MeshPart part = mesh_parts[seen.z];
    uint triangle = seen.y & 0x0fffffffu;
    TexelRay ray = pixel_ray(pixel);
    vec3 from = ray_origin(ray);
    vec3 p[3];  // from where the ray starts
    for (uint i = 0u; i < 3u; ++i) {
        corners[i] = mesh_corner(part, triangle, i);
        p[i] = mesh_point(part, vertex_position(corners[i])) - from;
    }
    vec3 d = ray.direction;
    weights = mesh_weights_inside(p[0], p[1], p[2], d);
    // A ray from elsewhere turns from pixel to pixel about as the camera's do.
    ivec2 whole = pixel + ivec2(frame.tile_x, frame.tile_y);
    vec3 turned = (frame.flags & kFrameRays) != 0u ? d - camera_direction(whole) : vec3(0.0);
    weights_x = mesh_weights(p[0], p[1], p[2], camera_direction(whole + ivec2(1, 0)) + turned);
    weights_y = mesh_weights(p[0], p[1], p[2], camera_direction(whole + ivec2(0, 1)) + turned);

    MeshSurface look_of = mesh_surfaces[part.surface];
    vec4 color = weights.x * vertex_color(corners[0]) + weights.y * vertex_color(corners[1]) + weights.z * vertex_color(corners[2]);
    SurfaceSample s = SurfaceSample(color.rgb * vec3(look_of.base_red, look_of.base_green, look_of.base_blue), -d, look_of.roughness,
                                    look_of.metallic, 1.0, kSurfaceHit,
                                    vec3(look_of.emissive_red, look_of.emissive_green, look_of.emissive_blue));
    // One call serves all five textures: every inlined copy, with its dozen pages, costs compile time.
    MeshTexture textures[5] = MeshTexture[5](look_of.base, look_of.rough_metal, look_of.bumps, look_of.occlusion, look_of.glow);
    vec4 texels[5] = vec4[5](vec4(1.0), vec4(1.0), vec4(1.0), vec4(1.0), vec4(1.0));
    for (int i = 0; i < 5; ++i) {
        MeshTexture t = textures[i];
        if (!is_there(t)) continue;
        bool second = (t.where & kTextureSet1) != 0u;
        mat3x2 uv = mat3x2(vertex_uv(corners[0], second), vertex_uv(corners[1], second), vertex_uv(corners[2], second));
        texels[i] = mesh_texture(t, uv * weights, uv * (weights_x - weights), uv * (weights_y - weights));
    }
    s.albedo *= texels[0].rgb;
    s.roughness *= texels[1].g;
    s.metallic *= texels[1].b;
    s.ambient = 1.0 + look_of.occlusion_strength * (texels[3].r - 1.0);
    s.emissive *= texels[4].rgb;

    vec3 face = unit_or(cross(p[1] - p[0], p[2] - p[0]), -d);
    vec3 n_local = vec3(0.0);
    for (int i = 0; i < 3; ++i) n_local += weights[i] * unpack_unit(mesh_vertices[corners[i]].normal);
    vec3 n = unit_or(mesh_normal(part, n_local), face);
    if (is_there(look_of.bumps)) {
        vec3 t_local = vec3(0.0);
        for (int i = 0; i < 3; ++i) t_local += weights[i] * unpack_unit(mesh_vertices[corners[i]].tangent);
        float hand = (mesh_vertices[corners[0]].tangent & 1u) != 0u ? -1.0 : 1.0;
        // glTF: unit after interpolation, bitangent from both.
        n_local = unit_or(n_local, vec3(0.0, 1.0, 0.0));
        t_local = unit_or(t_local - n_local * dot(n_local, t_local), vec3(1.0, 0.0, 0.0));
        vec3 tangent = unit_or(mesh_vector(part, t_local), vec3(0.0));
        vec3 bitangent = unit_or(mesh_vector(part, cross(n_local, t_local) * hand), vec3(0.0));
        vec3 bump = texels[2].rgb * 2.0 - 1.0;
        bump.xy *= look_of.normal_scale;
        n = unit_or(tangent * bump.x + bitangent * bump.y + n * bump.z, n);
    }
    s.normal = dot(face, d) > 0.0 ? -n : n;  // seen from behind
    uvec4 words = pack_surface(s);
    // The share that it covers, for through_bend.comp.
    if ((part.flags & kMeshBlend) != 0u) words.x |= uint(clamp(color.a * look_of.alpha * texels[0].a, 0.0, 1.0) * 255.0 + 0.5) << 24u;
    imageStore(surface_words, pixel, words);
}

// SPDX-License-Identifier: MIT
// Where a point, metres from the eye, is in the tile's clip space: what a pixel's middle shows is on the ray that pixel_ray() gives it. The
// same bits in every stage that asks. The including kernel declares first: FrameParams frame.

vec4 mesh_clip(vec3 p) {
    precise float w = dot(p, frame.camera.forward.xyz);
    // In the picture, -w to w; then in the tile.
    precise float x = dot(p, frame.camera.right.xyz) / dot(frame.camera.right.xyz, frame.camera.right.xyz);
    precise float y = dot(p, frame.camera.up.xyz) / dot(frame.camera.up.xyz, frame.camera.up.xyz);
    vec2 wider = vec2(frame.width, frame.height) / vec2(frame.tile_width, frame.tile_height);
    vec2 moved = 2.0 * vec2(frame.tile_x, frame.tile_y) / vec2(frame.tile_width, frame.tile_height);
    precise vec4 clip = vec4((x + w) * wider.x - (moved.x + 1.0) * w, (y - w) * wider.y + (moved.y + 1.0) * w, kMeshNear, w);
    return clip;
}

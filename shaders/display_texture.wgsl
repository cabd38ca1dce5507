// A finished picture's codes as bytes of a texture that a window draws: RGBA with 8 bits each, opaque, red in the lowest
// byte. A row starts at a multiple of `stride` words, as the copy into a texture requires.

struct Params {
    size: vec2<u32>,
    stride: u32,
    unused: u32,
}

@group(0) @binding(0) var<storage, read> codes: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> bytes: array<u32>;
@group(0) @binding(3) var<uniform> params: Params;

@compute @workgroup_size(8, 8)
fn display_texture(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= params.size) {
        return;
    }
    let code = codes[id.y * params.size.x + id.x].rgb;
    // Rounded as in memory, `imaging::color::byte_from_unit`.
    let byte = vec3<u32>(clamp(code, vec3<f32>(0.0), vec3<f32>(1.0)) * 255.0 + 0.5);
    bytes[id.y * params.stride + id.x] = byte.r | byte.g << 8u | byte.b << 16u | 0xff000000u;
}

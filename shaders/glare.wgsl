// Pass `glare`: part of the light above white is scattered. Between `excess` and `lay` it is spread by
// `pyramid.wgsl`. The twin on the CPU is `compositor::glare`.

struct Params {
    size: vec2<u32>,
    // Linear light above this is scattered, and how much of it.
    white: f32,
    amount: f32,
}

@group(0) @binding(0) var<storage, read> first: array<vec4<f32>>;
@group(0) @binding(1) var<storage, read> second: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> result: array<vec4<f32>>;
@group(0) @binding(3) var<uniform> params: Params;

// 0 in place of what is no number: a blur would carry it everywhere.
fn finite(v: vec4<f32>) -> vec4<f32> {
    let exponent = bitcast<vec4<u32>>(v) & vec4<u32>(0x7f800000u);
    return select(v, vec4<f32>(0.0), exponent == vec4<u32>(0x7f800000u));
}

fn above_white(v: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(max(v.rgb - vec3<f32>(params.white), vec3<f32>(0.0)), 0.0);
}

@compute @workgroup_size(8, 8)
fn excess(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= params.size) {
        return;
    }
    let i = id.y * params.size.x + id.x;
    result[i] = above_white(finite(first[i]));
}

@compute @workgroup_size(8, 8)
fn lay(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= params.size) {
        return;
    }
    let i = id.y * params.size.x + id.x;
    // `first` is the picture, `second` what was scattered.
    result[i] = first[i] + params.amount * (second[i] - above_white(first[i]));
}

// Pass `glare`: part of the light above white is scattered. Between `excess` and `lay` it is spread by
// `pyramid.wgsl`. The twin on the CPU is `compositor::glare`.

struct Params {
    size: vec2<u32>,
    // Threshold of scattered linear light, and its share.
    white: f32,
    amount: f32,
}

fn above_white(v: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(max(v.rgb - vec3<f32>(params.white), vec3<f32>(0.0)), 0.0);
}

@compute @workgroup_size(8, 8)
fn excess(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let i = index(id);
    result[i] = above_white(finite(first[i]));
}

@compute @workgroup_size(8, 8)
fn lay(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let i = index(id);
    // `first` is the picture, `second` the scattered light.
    result[i] = first[i] + params.amount * (second[i] - above_white(first[i]));
}

// Pass `difference`: the magnitude of the difference of two pictures' codes. The twin on the CPU is
// `compositor::difference`.

struct Params {
    size: vec2<u32>,
    gain: f32,
    unused: f32,
}

@compute @workgroup_size(8, 8)
fn difference(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let i = index(id);
    let apart = params.gain * abs(first[i].rgb - second[i].rgb);
    result[i] = vec4<f32>(clamp(apart, vec3<f32>(0.0), vec3<f32>(1.0)), first[i].a);
}

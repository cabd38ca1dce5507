// Pass `dither`: moves codes by less than half a step of 8 bits in front of the background. The twin on the CPU is
// `compositor::reference::dither`.

struct Params {
    size: vec2<u32>,
    unused: vec2<u32>,
}

@compute @workgroup_size(8, 8)
fn dither(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let i = index(id);
    // The fourth value of `second` is the subject's matte.
    let noise = fract(52.982918 * fract(0.06711056 * f32(id.x) + 0.00583715 * f32(id.y))) - 0.5;
    let step = noise * (1.0 - second[i].a) / 255.0;
    result[i] = vec4<f32>(clamp(first[i].rgb + step, vec3<f32>(0.0), vec3<f32>(1.0)), first[i].a);
}

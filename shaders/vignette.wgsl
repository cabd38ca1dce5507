// Pass `vignette`: light falls off towards the corners. The twin on the CPU is `compositor::vignette`.

struct Params {
    size: vec2<u32>,
    // Squared tangent of the angle of incidence, at a distance of one pixel from the middle.
    spread: f32,
    unused: f32,
}

@compute @workgroup_size(8, 8)
fn vignette(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let from_middle = vec2<f32>(id.xy) + 0.5 - 0.5 * vec2<f32>(params.size);
    let cos2 = 1.0 / (1.0 + params.spread * dot(from_middle, from_middle));
    let pixel = first[index(id)];
    result[index(id)] = vec4<f32>(pixel.rgb * cos2 * cos2, pixel.a);
}

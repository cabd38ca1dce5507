// Pass `false_color`: zones of exposure in flat colours. The twin on the CPU, which holds the legend, is
// `compositor::false_color`.

struct Params {
    size: vec2<u32>,
    unused: vec2<u32>,
    // Red, green, blue and the upper luminance of a zone; a negative red is grey.
    zones: array<vec4<f32>, 8>,
    clipped: vec4<f32>,
}

@compute @workgroup_size(8, 8)
fn false_color(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let i = index(id);
    let y = dot(first[i].rgb, LUMINANCE);
    let grey = srgb_from_linear(vec3<f32>(y));
    var color = params.clipped.rgb;
    for (var zone = 8u; zone > 0u; zone--) {
        let at = params.zones[zone - 1u];
        if max(y, 0.0) < at.w {
            color = select(at.rgb, grey, at.r < 0.0);
        }
    }
    result[i] = vec4<f32>(color, first[i].a);
}

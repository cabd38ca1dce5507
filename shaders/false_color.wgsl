// Pass `false_color`: zones of exposure in flat colours. The twin on the CPU, which holds the legend, is
// `compositor::false_color`.

struct Params {
    size: vec2<u32>,
    unused: vec2<u32>,
    // Red, green, blue and the luminance that a zone ends below; a negative red is grey.
    zones: array<vec4<f32>, 8>,
    clipped: vec4<f32>,
}

@group(0) @binding(0) var<storage, read> first: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> result: array<vec4<f32>>;
@group(0) @binding(3) var<uniform> params: Params;

@compute @workgroup_size(8, 8)
fn false_color(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= params.size) {
        return;
    }
    let i = id.y * params.size.x + id.x;
    let y = dot(first[i].rgb, vec3<f32>(0.2126, 0.7152, 0.0722));
    let x = clamp(y, 0.0, 1.0);
    let grey = select(1.055 * pow(x, 1.0 / 2.4) - 0.055, 12.92 * x, x <= 0.0031308);
    var color = params.clipped.rgb;
    for (var zone = 8u; zone > 0u; zone--) {
        let at = params.zones[zone - 1u];
        if max(y, 0.0) < at.w {
            color = select(at.rgb, vec3<f32>(grey), at.r < 0.0);
        }
    }
    result[i] = vec4<f32>(color, first[i].a);
}

// Pass `channels`: one channel of the codes in grey, or the coverage. The twin on the CPU is
// `compositor::channels`.

struct Params {
    size: vec2<u32>,
    // 0 to 2 are red, green and blue, 3 is luminance, 4 coverage.
    channel: u32,
    unused: u32,
}

@group(0) @binding(0) var<storage, read> first: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> result: array<vec4<f32>>;
@group(0) @binding(3) var<uniform> params: Params;

fn linear_from_srgb(code: vec3<f32>) -> vec3<f32> {
    let x = clamp(code, vec3<f32>(0.0), vec3<f32>(1.0));
    return select(pow((x + 0.055) / 1.055, vec3<f32>(2.4)), x / 12.92, x <= vec3<f32>(0.04045));
}

@compute @workgroup_size(8, 8)
fn channels(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= params.size) {
        return;
    }
    let i = id.y * params.size.x + id.x;
    let pixel = first[i];
    var grey = 0.0;
    if params.channel == 3u {
        let y = dot(linear_from_srgb(pixel.rgb), vec3<f32>(0.2126, 0.7152, 0.0722));
        grey = select(1.055 * pow(y, 1.0 / 2.4) - 0.055, 12.92 * y, y <= 0.0031308);
    } else if params.channel == 4u {
        grey = pixel.a;
    } else {
        grey = pixel[params.channel];
    }
    result[i] = vec4<f32>(vec3<f32>(grey), pixel.a);
}

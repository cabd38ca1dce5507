// Pass `channels`: one channel of the codes in grey, or the coverage. The twin on the CPU is
// `compositor::channels`.

struct Params {
    size: vec2<u32>,
    // 0 to 2 are red, green and blue, 3 is luminance, 4 coverage.
    channel: u32,
    unused: u32,
}

@compute @workgroup_size(8, 8)
fn channels(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let i = index(id);
    let pixel = first[i];
    var grey = 0.0;
    if params.channel == 3u {
        let y = dot(linear_from_srgb(pixel.rgb), LUMINANCE);
        grey = srgb_from_linear(vec3<f32>(y)).x;
    } else if params.channel == 4u {
        grey = pixel.a;
    } else {
        grey = pixel[params.channel];
    }
    result[i] = vec4<f32>(vec3<f32>(grey), pixel.a);
}

// Pass `grain`: adds the plate's grain to codes. `survey` samples a picture for a measurement of its grain. The
// twins on the CPU are `compositor::grain` and `Grain::new`.

struct Params {
    // Size of the picture.
    size: vec2<u32>,
    frame: u32,
    // `survey`: the step between samples.
    step: u32,
    // Deviations in codes for eight classes of brightness: on the subject, and on the background.
    inside: array<vec4<f32>, 8>,
    outside: array<vec4<f32>, 8>,
}

fn hash(input: u32) -> u32 {
    let state = input * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

// Mean 0, deviation 1: the sum of the four bytes of a hash.
fn normal(bits: u32) -> f32 {
    let sum = (bits & 255u) + ((bits >> 8u) & 255u) + ((bits >> 16u) & 255u) + (bits >> 24u);
    return (f32(sum) - 510.0) / 147.8;
}

@compute @workgroup_size(8, 8)
fn grain(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let i = index(id);
    // The fourth value of `first` is the picture's coverage, that of `second` the subject's matte.
    let matte = second[i].a;
    let hashed = hash(hash(params.frame) ^ i);
    var pixel = first[i];
    for (var c = 0u; c < 3u; c++) {
        let place = clamp(pixel[c] * 8.0 - 0.5, 0.0, 7.0);
        let low = min(u32(place), 6u);
        let part = place - f32(low);
        let on_subject = mix(params.inside[low][c], params.inside[low + 1u][c], part);
        let behind_it = mix(params.outside[low][c], params.outside[low + 1u][c], part);
        let deviation = pixel.a * mix(behind_it, on_subject, matte);
        pixel[c] = clamp(pixel[c] + deviation * normal(hash(hashed ^ c)), 0.0, 1.0);
    }
    result[i] = pixel;
}

// For each place, a column of `result`, and each channel, a row: the smoothed code, the square of its
// gradient and the high-pass. Places are pixels with neighbours on all sides.
@compute @workgroup_size(8, 8)
fn survey(@builtin(global_invocation_id) id: vec3<u32>) {
    let inner = params.size - vec2<u32>(2u);
    let places = (inner.x * inner.y + params.step - 1u) / params.step;
    if id.x >= places || id.y >= 3u {
        return;
    }
    let place = id.x * params.step;
    let middle = (place / inner.x + 1u) * params.size.x + place % inner.x + 1u;
    var code = 0.0;
    var across = 0.0;
    var down = 0.0;
    var high = 0.0;
    for (var j = 0u; j < 3u; j++) {
        for (var i = 0u; i < 3u; i++) {
            let value = first[middle + j * params.size.x + i - params.size.x - 1u][id.y];
            let x = f32(i) - 1.0;
            let y = f32(j) - 1.0;
            let near = vec2<f32>(2.0 - abs(x), 2.0 - abs(y));
            code += near.x * near.y * value / 16.0;
            across += x * near.y * value;
            down += y * near.x * value;
            high += (3.0 * abs(x) - 2.0) * (3.0 * abs(y) - 2.0) * value / 6.0;
        }
    }
    result[id.y * places + id.x] = vec4<f32>(code, across * across + down * down, high, 0.0);
}

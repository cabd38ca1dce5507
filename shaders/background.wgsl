// Pass `background`: the environment behind the subject, smoothed with a cubic B-spline. The twin on the
// CPU is `compositor::draw_background`.

struct Params {
    size: vec2<u32>,
    panorama: vec2<u32>,
    // Width of a pixel at unit distance.
    pixel: f32,
    // Yaw in turns, [0, 1).
    turn: f32,
    // Samples along each axis of a pixel.
    samples: u32,
    // The subject stands in front: the picture is fully covered from here on.
    opaque: u32,
    // From the stage to the environment, before its pitch and roll.
    untilt: mat3x3<f32>,
    // Per channel.
    level: vec3<f32>,
}

const PI: f32 = 3.14159265;

// Weights of four texels for a point `f` in [0, 1) beyond the second one.
fn weights(f: f32) -> vec4<f32> {
    let g = 1.0 - f;
    let inner = vec2<f32>(4.0 - 3.0 * f * f * (2.0 - f), 4.0 - 3.0 * g * g * (2.0 - g));
    return vec4<f32>(g * g * g, inner.x, inner.y, f * f * f) / 6.0;
}

// Columns wrap; beyond a pole the panorama continues half a turn away.
fn spline(u: f32, v: f32) -> vec3<f32> {
    let size = vec2<i32>(params.panorama);
    let place = vec2<f32>(u, v) * vec2<f32>(size) - 0.5;
    let texel = floor(place);
    let across = weights(place.x - texel.x);
    let down = weights(place.y - texel.y);
    var sum = vec3<f32>(0.0);
    for (var j = 0; j < 4; j++) {
        var row = i32(texel.y) + j - 1;
        var half_turn = 0;
        if row < 0 {
            row = -1 - row;
            half_turn = size.x / 2;
        } else if row >= size.y {
            row = 2 * size.y - 1 - row;
            half_turn = size.x / 2;
        }
        row = clamp(row, 0, size.y - 1);
        for (var i = 0; i < 4; i++) {
            let column = i32(texel.x) + i - 1 + half_turn;
            let wrapped = ((column % size.x) + size.x) % size.x;
            sum += down[j] * across[i] * second[row * size.x + wrapped].rgb;
        }
    }
    return sum;
}

@compute @workgroup_size(8, 8)
fn background(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    // `first` is the subject with its matte as the fourth value, `second` the panorama.
    let i = index(id);
    let subject = first[i];
    var sum = vec3<f32>(0.0);
    if subject.a < 1.0 {
        for (var j = 0u; j < params.samples; j++) {
            for (var k = 0u; k < params.samples; k++) {
                let within = (vec2<f32>(f32(k), f32(j)) + 0.5) / f32(params.samples);
                let at = vec2<f32>(id.xy) + within - 0.5 * vec2<f32>(params.size);
                // The camera looks along −Z.
                let look = params.untilt * vec3<f32>(at.x * params.pixel, -at.y * params.pixel, -1.0);
                let u = 0.5 + atan2(look.x, -look.z) / (2.0 * PI);
                let v = atan2(length(look.xz), look.y) / PI;
                sum += spline(u - params.turn, v);
            }
        }
    }
    let share = params.level / f32(params.samples * params.samples);
    let alpha = select(subject.a, 1.0, params.opaque == 1u);
    result[i] = vec4<f32>(subject.rgb + (1.0 - subject.a) * share * sum, alpha);
}

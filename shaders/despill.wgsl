// Pass `despill`: removes green or blue beyond its natural maximum from the rim. `openness`, `rim`, `inside` and
// `guide` make its guide, blurred by `background_blur.wgsl` in between; `spill` measures the need for the pass.
// The twins on the CPU are the functions of these names in `compositor::despill`.

struct Params {
    size: vec2<u32>,
    // 1 is green, 2 is blue.
    channel: u32,
    amount: f32,
}

@compute @workgroup_size(8, 8)
fn despill(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let i = index(id);
    // `second` is the degree to which a pixel belongs to the rim, and the natural maxima of green and blue over
    // the mean of the other two.
    let guide = second[i];
    var pixel = first[i];
    let others = 0.5 * (pixel.r + select(pixel.g, pixel.b, params.channel == 1u));
    let surplus = max(pixel[params.channel] - guide[params.channel] * others, 0.0);
    pixel[params.channel] -= params.amount * guide.r * surplus;
    result[i] = pixel;
}

// `first` has the matte as its fourth value.
@compute @workgroup_size(8, 8)
fn openness(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let i = index(id);
    result[i] = vec4<f32>(vec3<f32>(0.0), 1.0 - first[i].a);
}

// `first` has the matte as its fourth value, `second` its blurred openness.
@compute @workgroup_size(8, 8)
fn rim(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let i = index(id);
    let alpha = first[i].a;
    let rim = select(0.0, min(6.0 * second[i].a, 1.0), alpha > 0.0);
    result[i] = vec4<f32>(rim, 0.0, 0.0, alpha);
}

// `first` is the subject, `second` the rim.
@compute @workgroup_size(8, 8)
fn inside(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let i = index(id);
    let pixel = first[i];
    // Without the rim: its colour is in doubt.
    let weight = select(pixel.a, 0.0, second[i].r > 0.0);
    result[i] = vec4<f32>(weight * pixel.rgb, weight);
}

fn natural(green: f32, others: f32, weight: f32) -> f32 {
    // Too few samples: less than a hundredth of the disc, or no light at all.
    return select(1.0, 1.05 * green / others, weight > 0.01 && others > 0.0);
}

// `first` is the blurred inside; `second` the rim.
@compute @workgroup_size(8, 8)
fn guide(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let i = index(id);
    let inner = first[i];
    let green = natural(inner.g, 0.5 * (inner.r + inner.b), inner.a);
    let blue = natural(inner.b, 0.5 * (inner.r + inner.g), inner.a);
    result[i] = vec4<f32>(second[i].r, green, blue, second[i].a);
}

// `first` is the subject, `second` the guide. Results: the luminance of green and blue spill, and the
// rim's own luminance.
@compute @workgroup_size(8, 8)
fn spill(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let i = index(id);
    let pixel = first[i].rgb;
    let guide = second[i];
    var found = vec3<f32>(0.0);
    if guide.r > 0.0 && is_finite(pixel) {
        let green = max(pixel.g - guide.g * 0.5 * (pixel.r + pixel.b), 0.0);
        let blue = max(pixel.b - guide.b * 0.5 * (pixel.r + pixel.g), 0.0);
        found = guide.r * vec3<f32>(green * LUMINANCE.g, blue * LUMINANCE.b, dot(pixel, LUMINANCE));
    }
    result[i] = vec4<f32>(found, 0.0);
}

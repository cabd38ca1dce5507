// Pass `plate`: light that was summed at the working size is brought to the plate's size. The twin on the CPU is
// `compositor::Plate::relit`, which says what is computed.

struct Params {
    // Of the result.
    size: vec2<u32>,
    // Columns and rows of the working size.
    nodes: u32,
    // Pixels of the working size to one of the plate.
    step: f32,
    // The square's upper left corner in the plate's pixels.
    start: vec2<f32>,
    unused: vec2<f32>,
}

// How the light changes a pixel: the relit subject by its look, which `second` holds with the pixel whose ratio this one
// takes.
@compute @workgroup_size(8, 8)
fn ratio(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let source = u32(second[index(id)].a);
    let subject = first[source];
    var changed = vec3<f32>(0.0);
    if subject.a > 0.0 {
        changed = subject.rgb / subject.a / second[source].rgb;
    }
    result[index(id)] = vec4<f32>(changed, 1.0);
}

// The subject with light added to it.
@compute @workgroup_size(8, 8)
fn add(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let subject = first[index(id)];
    result[index(id)] = vec4<f32>(subject.rgb + second[index(id)].rgb, subject.a);
}

// Catmull and Rom's cubic between the second and the third of four pixels.
fn shares(t: f32) -> vec4<f32> {
    return vec4<f32>(
        t * (-0.5 + t * (1.0 - 0.5 * t)),
        1.0 + t * t * (1.5 * t - 2.5),
        t * (0.5 + t * (2.0 - 1.5 * t)),
        t * t * (0.5 * t - 0.5),
    );
}

// The ratio between the centres of the pixels, times the plate.
@compute @workgroup_size(8, 8)
fn enlarge(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let last = i32(params.nodes) - 1;
    let at = clamp((vec2<f32>(id.xy) + 0.5 - params.start) * params.step - 0.5, vec2<f32>(0.0), vec2<f32>(f32(last)));
    let low = vec2<i32>(at);
    let across = shares(at.x - f32(low.x));
    let down = shares(at.y - f32(low.y));
    var sum = vec3<f32>(0.0);
    for (var j = 0; j < 4; j++) {
        let row = clamp(low.y + j - 1, 0, last) * (last + 1);
        var line = vec3<f32>(0.0);
        for (var i = 0; i < 4; i++) {
            line += across[i] * first[row + clamp(low.x + i - 1, 0, last)].rgb;
        }
        sum += down[j] * line;
    }
    let plate = second[index(id)];
    result[index(id)] = vec4<f32>(plate.rgb * sum, plate.a);
}

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

// What `second` holds for a pixel of the working size: nine shares of its neighbours, then its look with the pixel whose
// ratio it takes.
const TEXELS: u32 = 10u;

fn source_of(i: u32) -> u32 {
    return u32(second[TEXELS * i + 9u].a);
}

// How the light changes a pixel: the relit subject by its look.
@compute @workgroup_size(8, 8)
fn ratio(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let source = source_of(index(id));
    let subject = first[source];
    let look = second[TEXELS * source + 9u].rgb;
    var changed = vec3<f32>(0.0);
    if subject.a > 0.0 {
        changed = subject.rgb / subject.a / look;
    }
    result[index(id)] = vec4<f32>(changed, 1.0);
}

// One step of back-projection: what interpolation takes from the mean is given back.
@compute @workgroup_size(8, 8)
fn mend(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let source = source_of(index(id));
    let at = vec2<i32>(i32(source % params.nodes), i32(source / params.nodes));
    let last = i32(params.nodes) - 1;
    var sum = vec3<f32>(0.0);
    for (var place = 0u; place < 9u; place++) {
        let offset = vec2<i32>(i32(place % 3u) - 1, i32(place / 3u) - 1);
        let near = clamp(at + offset, vec2<i32>(0), vec2<i32>(last));
        sum += second[TEXELS * source + place].rgb * first[u32(near.y) * params.nodes + u32(near.x)].rgb;
    }
    result[index(id)] = vec4<f32>(max(2.0 * first[source].rgb - sum, vec3<f32>(0.0)), 1.0);
}

// The ratio between the centres of four pixels, times the plate.
@compute @workgroup_size(8, 8)
fn enlarge(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let last = f32(params.nodes - 1u);
    let at = clamp((vec2<f32>(id.xy) + 0.5 - params.start) * params.step - 0.5, vec2<f32>(0.0), vec2<f32>(last));
    let low = vec2<u32>(at);
    let high = min(low + 1u, vec2<u32>(params.nodes - 1u));
    let share = at - vec2<f32>(low);
    let upper = mix(first[low.y * params.nodes + low.x].rgb, first[low.y * params.nodes + high.x].rgb, share.x);
    let lower = mix(first[high.y * params.nodes + low.x].rgb, first[high.y * params.nodes + high.x].rgb, share.x);
    let plate = second[index(id)];
    result[index(id)] = vec4<f32>(plate.rgb * mix(upper, lower, share.y), plate.a);
}

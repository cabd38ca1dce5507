// Reductions of pictures to little data, which is then read. The use of each number is documented with its
// twin on the CPU: `compositor::despill`, `light_wrap`, `glare`, `smoothing`.

struct Params {
    // `shrink`, `pick`: columns and rows of `result`; `total`, `largest`: of `first`.
    size: vec2<u32>,
    // `shrink`: columns and rows of `first`. `pick`: the step between pixels, and nothing.
    values: vec2<u32>,
}

// Workgroups of `total` and `largest`; each leaves one value.
const GROUPS: u32 = 64u;

var<workgroup> parts: array<vec4<f32>, 64>;

@compute @workgroup_size(64)
fn total(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    var sum = vec4<f32>(0.0);
    for (var i = 64u * group.x + local; i < params.size.x * params.size.y; i += 64u * GROUPS) {
        sum += finite(first[i]);
    }
    parts[local] = sum;
    workgroupBarrier();
    if local == 0u {
        for (var k = 1u; k < 64u; k++) {
            sum += parts[k];
        }
        result[group.x] = sum;
    }
}

@compute @workgroup_size(64)
fn largest(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    var most = vec4<f32>(0.0);
    for (var i = 64u * group.x + local; i < params.size.x * params.size.y; i += 64u * GROUPS) {
        most = max(most, finite(first[i]));
    }
    parts[local] = most;
    workgroupBarrier();
    if local == 0u {
        for (var k = 1u; k < 64u; k++) {
            most = max(most, parts[k]);
        }
        result[group.x] = most;
    }
}

// First and last source pixel under a smaller one along one axis, and the shares of these two: all
// pixels between them count fully.
fn span(place: u32, size: u32, source: u32) -> vec4<f32> {
    let ratio = f32(source) / f32(size);
    let start = f32(place) * ratio;
    let end = min(start + ratio, f32(source));
    let low = floor(start + 1e-4);
    let high = max(ceil(end - 1e-4) - 1.0, low);
    return vec4<f32>(low, high, min(low + 1.0, end) - max(low, start), end - high);
}

fn share(at: f32, span: vec4<f32>) -> f32 {
    if at == span.x {
        return span.z;
    }
    return select(1.0, span.w, at == span.y);
}

// Mean over the area of each pixel.
@compute @workgroup_size(8, 8)
fn shrink(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let across = span(id.x, params.size.x, params.values.x);
    let down = span(id.y, params.size.y, params.values.y);
    var sum = vec4<f32>(0.0);
    var total = 0.0;
    for (var y = down.x; y <= down.y; y += 1.0) {
        for (var x = across.x; x <= across.y; x += 1.0) {
            let weight = share(x, across) * share(y, down);
            sum += weight * first[u32(y) * params.values.x + u32(x)];
            total += weight;
        }
    }
    result[index(id)] = sum / total;
}

// One pixel per step.
@compute @workgroup_size(8, 8)
fn pick(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let i = index(id);
    result[i] = first[i * params.values.x];
}

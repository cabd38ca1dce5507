// Pass `background_blur`: the mean over a disc. Wide discs are drawn on a halved picture
// (`pyramid.wgsl`). The twin on the CPU is `compositor::background_blur`.

struct Params {
    size: vec2<u32>,
    // Pixels; the disc's rim is one pixel wide.
    radius: f32,
    unused: f32,
}

// Index of the pixel at `i` in a row of `n` that is mirrored on both sides.
fn mirrored(i: i32, n: i32) -> i32 {
    let at = ((i % (2 * n)) + 2 * n) % (2 * n);
    return min(at, 2 * n - 1 - at);
}

@compute @workgroup_size(8, 8)
fn disc(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let i = index(id);
    let size = vec2<i32>(params.size);
    let reach = i32(ceil(params.radius + 0.5));
    var sum = vec4<f32>(0.0);
    var total = 0.0;
    for (var dy = -reach; dy <= reach; dy++) {
        let row = mirrored(i32(id.y) + dy, size.y) * size.x;
        for (var dx = -reach; dx <= reach; dx++) {
            let distance = sqrt(f32(dx * dx + dy * dy));
            let weight = clamp(params.radius + 0.5 - distance, 0.0, 1.0);
            if weight > 0.0 {
                sum += weight * finite(first[row + mirrored(i32(id.x) + dx, size.x)]);
                total += weight;
            }
        }
    }
    result[i] = sum / total;
}

// Halving and doubling, the base of wide blurs. The twin on the CPU is `compositor::pyramid`.

struct Params {
    // Columns and rows of `result`, and of `first`.
    size: vec2<u32>,
    from_size: vec2<u32>,
    // Factor on the last column and row of the coarse picture if the fine one has an odd number.
    odd_end: f32,
    // `double`: factor on `second`, to which the doubled picture is added.
    keep: f32,
    unused: vec2<f32>,
}

// Fine pixel `tap` (0 to 3) of a coarse one along one axis of `n` fine pixels, and its share.
fn place(coarse: u32, tap: u32, n: u32) -> u32 {
    let at = 2u * coarse + tap;
    return min(max(at, 1u) - 1u, n - 1u);
}

fn share(coarse: u32, tap: u32, n: u32) -> f32 {
    let outer = tap == 0u || tap == 3u;
    if 2u * coarse + 1u == n {
        // An odd row ends on half a pair.
        return select(select(0.0, 0.75, tap == 1u), 0.25, tap == 0u);
    }
    return select(0.375, 0.125, outer);
}

fn end_weight(coarse: vec2<u32>, fine_size: vec2<u32>) -> f32 {
    let odd = 2u * coarse + vec2<u32>(1u) == fine_size;
    return select(1.0, params.odd_end, odd.x) * select(1.0, params.odd_end, odd.y);
}

@compute @workgroup_size(8, 8)
fn halve(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let n = params.from_size;
    var sum = vec4<f32>(0.0);
    for (var j = 0u; j < 4u; j++) {
        let row = place(id.y, j, n.y) * n.x;
        for (var i = 0u; i < 4u; i++) {
            let weight = share(id.y, j, n.y) * share(id.x, i, n.x);
            sum += weight * finite(first[row + place(id.x, i, n.x)]);
        }
    }
    result[index(id)] = sum * end_weight(id.xy, n);
}

fn coarse(x: u32, y: u32) -> vec4<f32> {
    let weight = end_weight(vec2<u32>(x, y), params.size);
    return weight * first[y * params.from_size.x + x];
}

// The coarse pixel that a fine one takes a quarter of.
fn neighbour(fine: u32, n: u32) -> u32 {
    let half = fine / 2u;
    return select(max(half, 1u) - 1u, min(half + 1u, n - 1u), fine % 2u == 1u);
}

@compute @workgroup_size(8, 8)
fn double(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let near = id.xy / 2u;
    let far = vec2<u32>(neighbour(id.x, params.from_size.x), neighbour(id.y, params.from_size.y));
    let left = 0.75 * coarse(near.x, near.y) + 0.25 * coarse(near.x, far.y);
    let right = 0.75 * coarse(far.x, near.y) + 0.25 * coarse(far.x, far.y);
    var sum = 0.75 * left + 0.25 * right;
    let i = index(id);
    if params.keep != 0.0 {
        sum += params.keep * second[i];
    }
    result[i] = sum;
}

// Turns the sum of lamps into the subject: NaN and infinite pixels are repaired, the matte's edge takes
// the colour of the solid subject next to it, and the subject is cut out. The fourth value of `second` is the subject's
// matte. The twin on the CPU is `compositor::reference::extend_edges`.

struct Params {
    size: vec2<u32>,
    // `extend`: number of rings of partly covered pixels around the solid ones.
    rings: u32,
    // `mend`: coverage from which a pixel is solid.
    solid: f32,
}

// `extend`: the ring of each pixel (0 is solid, the largest number is out of reach), then the end of each ring
// in the list that follows: the pixels, ring by ring.
@group(0) @binding(0) var<storage, read> rings: array<u32>;
// Number of repaired pixels.
@group(0) @binding(4) var<storage, read_write> tally: array<atomic<u32>>;

// Search distance for finite pixels around a NaN or infinite one.
const FARTHEST: i32 = 8;

// The mean of the nearest solid pixels that are finite; black if there are none.
fn around(at: vec2<i32>) -> vec3<f32> {
    let size = vec2<i32>(params.size);
    for (var reach = 1; reach <= FARTHEST; reach++) {
        var sum = vec3<f32>(0.0);
        var count = 0.0;
        let low = max(at - reach, vec2<i32>(0));
        let high = min(at + reach, size - 1);
        for (var y = low.y; y <= high.y; y++) {
            for (var x = low.x; x <= high.x; x++) {
                let i = y * size.x + x;
                if second[i].a >= params.solid && is_finite(first[i].rgb) {
                    sum += first[i].rgb;
                    count += 1.0;
                }
            }
        }
        if count > 0.0 {
            return sum / count;
        }
    }
    return vec3<f32>(0.0);
}

@compute @workgroup_size(8, 8)
fn mend(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let i = index(id);
    var color = first[i].rgb;
    if !is_finite(color) {
        color = vec3<f32>(0.0);
        if second[i].a > 0.0 {
            atomicAdd(&tally[0], 1u);
            color = around(vec2<i32>(id.xy));
        }
    }
    result[i] = vec4<f32>(color, 1.0);
}

// One workgroup does all rings, since each reads the ones before it. `result` is the output of `mend`.
@compute @workgroup_size(256)
fn extend(@builtin(local_invocation_index) local: u32) {
    let size = vec2<i32>(params.size);
    let pixels = params.size.x * params.size.y;
    var start = 0u;
    for (var ring = 1u; ring <= params.rings; ring++) {
        let end = rings[pixels + ring - 1u];
        for (var k = start + local; k < end; k += 256u) {
            let i = rings[pixels + params.rings + k];
            let at = vec2<i32>(i32(i % params.size.x), i32(i / params.size.x));
            let low = max(at - 1, vec2<i32>(0));
            let high = min(at + 1, size - 1);
            var sum = vec3<f32>(0.0);
            var count = 0.0;
            for (var y = low.y; y <= high.y; y++) {
                for (var x = low.x; x <= high.x; x++) {
                    let near = y * size.x + x;
                    if rings[near] < ring {
                        sum += result[near].rgb;
                        count += 1.0;
                    }
                }
            }
            result[i] = vec4<f32>(sum / count, 1.0);
        }
        start = end;
        storageBarrier();
    }
}

@compute @workgroup_size(8, 8)
fn cut(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let i = index(id);
    let alpha = second[i].a;
    result[i] = vec4<f32>(alpha * first[i].rgb, alpha);
}

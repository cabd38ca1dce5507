// Pass `despill`: takes green or blue beyond what is natural out of the rim. The twin on the CPU is
// `compositor::despill`.

struct Params {
    size: vec2<u32>,
    // 1 is green, 2 is blue.
    channel: u32,
    amount: f32,
    // The channel over the mean of the other two that is natural for the subject.
    natural: f32,
    unused_a: f32,
    unused_b: vec2<f32>,
}

@group(0) @binding(0) var<storage, read> first: array<vec4<f32>>;
@group(0) @binding(1) var<storage, read> second: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> result: array<vec4<f32>>;
@group(0) @binding(3) var<uniform> params: Params;

@compute @workgroup_size(8, 8)
fn despill(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= params.size) {
        return;
    }
    let i = id.y * params.size.x + id.x;
    // The red of `second` is how much a pixel belongs to the rim.
    let rim = second[i].r;
    var pixel = first[i];
    if params.channel == 1u {
        let limit = params.natural * 0.5 * (pixel.r + pixel.b);
        pixel.g -= params.amount * rim * max(pixel.g - limit, 0.0);
    } else {
        let limit = params.natural * 0.5 * (pixel.r + pixel.g);
        pixel.b -= params.amount * rim * max(pixel.b - limit, 0.0);
    }
    result[i] = pixel;
}

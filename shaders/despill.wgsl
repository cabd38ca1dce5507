// Pass `despill`: takes green or blue beyond what is natural out of the rim. The twin on the CPU is
// `compositor::despill`.

struct Params {
    size: vec2<u32>,
    // 1 is green, 2 is blue.
    channel: u32,
    amount: f32,
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
    // `second` is how much a pixel belongs to the rim, and the green and blue over the mean of the other
    // two that are natural there.
    let guide = second[i];
    var pixel = first[i];
    let others = 0.5 * (pixel.r + select(pixel.g, pixel.b, params.channel == 1u));
    let surplus = max(pixel[params.channel] - guide[params.channel] * others, 0.0);
    pixel[params.channel] -= params.amount * guide.r * surplus;
    result[i] = pixel;
}

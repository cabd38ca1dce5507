// Pass `difference`: the magnitude of the difference of two pictures' codes. The twin on the CPU is
// `compositor::difference`.

struct Params {
    size: vec2<u32>,
    gain: f32,
    unused: f32,
}

@group(0) @binding(0) var<storage, read> first: array<vec4<f32>>;
@group(0) @binding(1) var<storage, read> second: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> result: array<vec4<f32>>;
@group(0) @binding(3) var<uniform> params: Params;

@compute @workgroup_size(8, 8)
fn difference(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= params.size) {
        return;
    }
    let i = id.y * params.size.x + id.x;
    let apart = params.gain * abs(first[i].rgb - second[i].rgb);
    result[i] = vec4<f32>(clamp(apart, vec3<f32>(0.0), vec3<f32>(1.0)), first[i].a);
}

// Pass `exposure`: everything is made brighter or darker. The twin on the CPU is
// `compositor::reference::scale`.

struct Params {
    size: vec2<u32>,
    factor: f32,
    unused: f32,
}

@group(0) @binding(0) var<storage, read> first: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> result: array<vec4<f32>>;
@group(0) @binding(3) var<uniform> params: Params;

@compute @workgroup_size(8, 8)
fn exposure(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= params.size) {
        return;
    }
    let i = id.y * params.size.x + id.x;
    result[i] = vec4<f32>(params.factor * first[i].rgb, first[i].a);
}

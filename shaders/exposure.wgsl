// Pass `exposure`: brightens or darkens the whole picture. The twin on the CPU is
// `compositor::reference::scale`.

struct Params {
    size: vec2<u32>,
    factor: f32,
    unused: f32,
}

@compute @workgroup_size(8, 8)
fn exposure(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let i = index(id);
    result[i] = vec4<f32>(params.factor * first[i].rgb, first[i].a);
}

// Pass `light_wrap`: the background's light reaches around the subject's rim. Between `open` and `wrap`
// the light is blurred by `background_blur.wgsl`. `over` lays the subject over its background. The
// twins on the CPU are `compositor::light_wrap` and `compositor::composition`.

struct Params {
    size: vec2<u32>,
    amount: f32,
    unused: f32,
}

@compute @workgroup_size(8, 8)
fn open(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let i = index(id);
    // `first` is the subject with its matte as the fourth value, `second` the background.
    let open = 1.0 - first[i].a;
    result[i] = vec4<f32>(open * finite(second[i]).rgb, open);
}

@compute @workgroup_size(8, 8)
fn wrap(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let i = index(id);
    let subject = first[i];
    let past = second[i];
    let more = max(subject.a * past.rgb - past.a * subject.rgb, vec3<f32>(0.0));
    result[i] = vec4<f32>(subject.rgb + params.amount * more, subject.a);
}

@compute @workgroup_size(8, 8)
fn over(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let i = index(id);
    let subject = first[i];
    // A subject in front of a background covers the whole picture.
    result[i] = vec4<f32>(subject.rgb + (1.0 - subject.a) * second[i].rgb, 1.0);
}

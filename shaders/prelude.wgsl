// Declarations shared by all shaders from picture to picture, appended to each when it is loaded
// (`compositor::passes::Shader`). Each shader declares its own `Params`, which begin with `size: vec2<u32>`, the columns
// and rows used by `outside` and `index`.

// Pictures of RGB and coverage, row by row. A shader with only one input does not use `second`.
@group(0) @binding(0) var<storage, read> first: array<vec4<f32>>;
@group(0) @binding(1) var<storage, read> second: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> result: array<vec4<f32>>;
@group(0) @binding(3) var<uniform> params: Params;

// True for threads without a pixel: workgroups extend beyond the picture's edge.
fn outside(id: vec3<u32>) -> bool {
    return any(id.xy >= params.size);
}

// Index of a thread's pixel.
fn index(id: vec3<u32>) -> u32 {
    return id.y * params.size.x + id.x;
}

// Luminance of linear Rec. 709 light.
const LUMINANCE: vec3<f32> = vec3<f32>(0.2126, 0.7152, 0.0722);

// True if neither NaN nor infinite.
fn is_finite(v: vec3<f32>) -> bool {
    let exponent = bitcast<vec3<u32>>(v) & vec3<u32>(0x7f800000u);
    return all(exponent != vec3<u32>(0x7f800000u));
}

// 0 in place of NaN and infinite values: a blur would spread them everywhere.
fn finite(v: vec4<f32>) -> vec4<f32> {
    let exponent = bitcast<vec4<u32>>(v) & vec4<u32>(0x7f800000u);
    return select(v, vec4<f32>(0.0), exponent == vec4<u32>(0x7f800000u));
}

fn srgb_from_linear(linear: vec3<f32>) -> vec3<f32> {
    let x = clamp(linear, vec3<f32>(0.0), vec3<f32>(1.0));
    let power = 1.055 * pow(x, vec3<f32>(1.0 / 2.4)) - 0.055;
    return select(power, 12.92 * x, x <= vec3<f32>(0.0031308));
}

fn linear_from_srgb(code: vec3<f32>) -> vec3<f32> {
    let x = clamp(code, vec3<f32>(0.0), vec3<f32>(1.0));
    return select(pow((x + 0.055) / 1.055, vec3<f32>(2.4)), x / 12.92, x <= vec3<f32>(0.04045));
}

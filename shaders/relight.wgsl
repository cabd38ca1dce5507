// Pass `relight`: every pixel of a reflectance field is summed over the lamps that carry energy.
// Each texel of those lamps is read once, in runs of neighbouring pixels; no other lamp is read.
// The twin on the CPU is `compositor::reference::relight`.

struct Share {
    weight: vec3<f32>,
    lamp: u32,
}

struct Shape {
    // Pixels of one plane.
    pixels: u32,
    // Entries of `shares`; its buffer may be longer.
    lamps: u32,
}

// field[(lamp · 3 + channel) · pixels + pixel]
@group(0) @binding(0) var<storage, read> field: array<f32>;
@group(0) @binding(1) var<storage, read> shares: array<Share>;
// RGB in linear light; the fourth value is 1.
@group(0) @binding(2) var<storage, read_write> relit: array<vec4<f32>>;
@group(0) @binding(3) var<uniform> shape: Shape;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.x;
    if pixel >= shape.pixels {
        return;
    }
    var sum = vec3<f32>(0.0);
    for (var i = 0u; i < shape.lamps; i++) {
        let share = shares[i];
        let red = share.lamp * 3u * shape.pixels + pixel;
        let value = vec3<f32>(field[red], field[red + shape.pixels], field[red + 2u * shape.pixels]);
        sum += share.weight * value;
    }
    relit[pixel] = vec4<f32>(sum, 1.0);
}

// Pass `relight`: every pixel of a reflectance field is summed over the lamps that carry energy.
// Each texel of those lamps is read once, in runs of neighbouring pixels; no other lamp is read.
// `main` reads a field in f32, `main_half` one in f16, two neighbouring pixels at a time.
// The twins on the CPU are `compositor::reference::relight` and `relight_half`.

struct Share {
    weight: vec3<f32>,
    lamp: u32,
}

struct Shape {
    // Pixels of one plane.
    pixels: u32,
    // Entries of `shares`; its buffer may be longer.
    lamps: u32,
    // `main_half` alone: lamps of the whole field, and what a stored value is times.
    all_lamps: u32,
    scale: f32,
}

// field[(lamp · 3 + channel) · pixels + pixel]
@group(0) @binding(0) var<storage, read> field: array<f32>;
// Tiles of 64 pixels: halves[((tile · 3 + channel) · all_lamps + lamp) · 32 + pair], two halves each.
@group(0) @binding(0) var<storage, read> halves: array<u32>;
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

@compute @workgroup_size(64)
fn main_half(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = 2u * id.x;
    if pixel >= shape.pixels {
        return;
    }
    let channel = 32u * shape.all_lamps;
    let tile = (id.x / 32u) * 3u * channel + id.x % 32u;
    var left = vec3<f32>(0.0);
    var right = vec3<f32>(0.0);
    for (var i = 0u; i < shape.lamps; i++) {
        let share = shares[i];
        let red = tile + 32u * share.lamp;
        let r = unpack2x16float(halves[red]);
        let g = unpack2x16float(halves[red + channel]);
        let b = unpack2x16float(halves[red + 2u * channel]);
        left += share.weight * vec3<f32>(r.x, g.x, b.x);
        right += share.weight * vec3<f32>(r.y, g.y, b.y);
    }
    relit[pixel] = vec4<f32>(shape.scale * left, 1.0);
    if pixel + 1u < shape.pixels {
        relit[pixel + 1u] = vec4<f32>(shape.scale * right, 1.0);
    }
}

// Pass `relight`: sums every pixel of a reflectance field over the lit lamps. Each texel of these lamps
// is read once, in runs of neighbouring pixels; the other lamps are not read.
// `main` reads a field in f32, `main_half` one in f16, two neighbouring pixels at a time, `main_components` one
// of principal components, each plane once for all channels. `largest` and `halve`, run in sequence, convert
// a field from f32 to f16.
// The twins on the CPU are `compositor::reference::relight` and its variants, and `HalfField::from`.

struct Share {
    weight: vec3<f32>,
    lamp: u32,
}

struct Shape {
    // Pixels of one plane.
    pixels: u32,
    // Entries of `shares`; its buffer may be longer.
    lamps: u32,
    // Lamps of the whole field.
    all_lamps: u32,
    padding: u32,
}

// Storage of a field in f16.
struct Stored {
    // Bits of the largest finite magnitude, which sort like the magnitudes.
    largest: u32,
    // Factor on stored values.
    scale: f32,
}

struct Search {
    largest: atomic<u32>,
    scale: f32,
}

// field[(lamp · 3 + channel) · pixels + pixel]
@group(0) @binding(0) var<storage, read> field: array<f32>;
// Tiles of 64 pixels: halves[((tile · 3 + channel) · all_lamps + lamp) · 32 + pair], two halves each.
@group(0) @binding(0) var<storage, read> halves: array<u32>;
@group(0) @binding(1) var<storage, read> shares: array<Share>;
// RGB in linear light; the fourth value is 1.
@group(0) @binding(2) var<storage, read_write> relit: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> stored_halves: array<u32>;
@group(0) @binding(3) var<uniform> shape: Shape;
@group(0) @binding(4) var<storage, read> stored: Stored;
@group(0) @binding(4) var<storage, read_write> search: Search;

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
    relit[pixel] = vec4<f32>(stored.scale * left, 1.0);
    if pixel + 1u < shape.pixels {
        relit[pixel + 1u] = vec4<f32>(stored.scale * right, 1.0);
    }
}

// `shares` are the components' here, one for every plane with weight: field[plane · pixels + pixel].
@compute @workgroup_size(64)
fn main_components(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.x;
    if pixel >= shape.pixels {
        return;
    }
    var sum = vec3<f32>(0.0);
    for (var i = 0u; i < shape.lamps; i++) {
        let share = shares[i];
        sum += share.weight * field[share.lamp * shape.pixels + pixel];
    }
    relit[pixel] = vec4<f32>(sum, 1.0);
}

// Smallest bits of an f32 that is infinite or NaN.
const INFINITE: u32 = 0x7f800000u;

var<workgroup> largest_here: atomic<u32>;

@compute @workgroup_size(64)
fn largest(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let count = shape.pixels * 3u * shape.all_lamps;
    var own = 0u;
    for (var i = id.x; i < count; i += 64u * groups.x) {
        let magnitude = bitcast<u32>(field[i]) & 0x7fffffffu;
        own = max(own, select(0u, magnitude, magnitude < INFINITE));
    }
    atomicMax(&largest_here, own);
    workgroupBarrier();
    if local == 0u {
        atomicMax(&search.largest, atomicLoad(&largest_here));
    }
}

fn power_of_two(exponent: i32) -> f32 {
    return bitcast<f32>(u32(127 + exponent) << 23u);
}

// Bits of two halves. A value too large for f32 is too large for f16.
fn halves_of(values: vec2<f32>, factor: f32) -> u32 {
    let bits = bitcast<vec2<u32>>(values);
    let magnitude = bits & vec2<u32>(0x7fffffffu);
    let finite = magnitude < vec2<u32>(INFINITE);
    let packed = pack2x16float(select(vec2<f32>(0.0), values, finite) * factor);
    let is_nan = select(vec2<u32>(0u), vec2<u32>(0x200u), magnitude > vec2<u32>(INFINITE));
    let other = ((bits >> vec2<u32>(16u)) & vec2<u32>(0x8000u)) | vec2<u32>(0x7c00u) | is_nan;
    let low = select(other.x, packed & 0xffffu, finite.x);
    let high = select(other.y, packed >> 16u, finite.y);
    return low | (high << 16u);
}

// Two neighbouring pixels under every lamp; zeros fill the last tile.
@compute @workgroup_size(64)
fn halve(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = 2u * id.x;
    if pixel >= 64u * ((shape.pixels + 63u) / 64u) {
        return;
    }
    let bits = atomicLoad(&search.largest);
    // The largest value is scaled to [2^14, 2^15), as far as f32 holds both the factor and its inverse.
    let exponent = select(min(14 - (i32(bits >> 23u) - 127), 126), 0, bits == 0u);
    if id.x == 0u {
        search.scale = power_of_two(-exponent);
    }
    let factor = power_of_two(exponent);
    let tile = (id.x / 32u) * 3u * 32u * shape.all_lamps + id.x % 32u;
    for (var plane = 0u; plane < 3u * shape.all_lamps; plane++) {
        let first = plane * shape.pixels + pixel;
        var values = vec2<f32>(0.0);
        if pixel < shape.pixels {
            values.x = field[first];
        }
        if pixel + 1u < shape.pixels {
            values.y = field[first + 1u];
        }
        let lamp = plane / 3u;
        let channel = plane % 3u;
        stored_halves[tile + (channel * shape.all_lamps + lamp) * 32u] = halves_of(values, factor);
    }
}

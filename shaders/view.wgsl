// Pass `view`: linear light becomes codes of an sRGB display. The twin on the CPU, which names the
// sources of all numbers, is `compositor::view`.

struct Params {
    size: vec2<u32>,
    // 0 is sRGB, 1 filmic, 2 ACES, 3 the table in `second`.
    curve: u32,
    // For viewing only: light is multiplied by `factor` and raised to `power`.
    factor: f32,
    power: f32,
    unused0: u32,
    unused1: u32,
    unused2: u32,
}

// A matrix is written by its columns here, by its rows in the twin.
fn filmic(light: vec3<f32>) -> vec3<f32> {
    let inset = mat3x3<f32>(
        0.84247906, 0.042328242, 0.042375655,
        0.0784336, 0.87846864, 0.0784336,
        0.079223745, 0.07916613, 0.87914297,
    );
    let outset = mat3x3<f32>(
        1.196879, -0.05289685, -0.052971635,
        -0.09802088, 1.1519031, -0.09804345,
        -0.09902974, -0.09896118, 1.1510737,
    );
    let darkest = vec3<f32>(-12.47393);
    let brightest = vec3<f32>(4.026069);
    let stops = clamp(log2(max(inset * light, vec3<f32>(1e-10))), darkest, brightest);
    let x = (stops - darkest) / (brightest - darkest);
    let x2 = x * x;
    let x4 = x2 * x2;
    let codes = 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2
        + 0.1191 * x - 0.00232;
    return clamp(outset * codes, vec3<f32>(0.0), vec3<f32>(1.0));
}

fn aces(light: vec3<f32>) -> vec3<f32> {
    let input = mat3x3<f32>(
        0.59719, 0.07600, 0.02840,
        0.35458, 0.90834, 0.13383,
        0.04823, 0.01566, 0.83777,
    );
    let output = mat3x3<f32>(
        1.60475, -0.10208, -0.00327,
        -0.53108, 1.10813, -0.07276,
        -0.07367, -0.00605, 1.07602,
    );
    let v = input * (light / 0.6);
    let above = v * (v + 0.0245786) - 0.000090537;
    let below = v * (0.983729 * v + 0.432951) + 0.238081;
    return srgb_from_linear(output * (above / below));
}

// `imaging::DisplayTable::at`: 65 entries along each axis, red fastest.
fn looked_up(light: vec3<f32>) -> vec3<f32> {
    let place = clamp(64.0 / 6.0 * log2(1.0 + 7.0 * sqrt(light)), vec3<f32>(0.0), vec3<f32>(64.0));
    let below = min(vec3<u32>(place), vec3<u32>(63u));
    let steps = vec3<u32>(1u, 65u, 4225u);
    var at = below.r + 65u * below.g + 4225u * below.b;
    var codes = second[at].rgb;
    // From the lower corner to the upper one, along the axis with the largest distance first.
    var way = place - vec3<f32>(below);
    for (var i = 0u; i < 3u; i++) {
        var axis = 0u;
        if way.g > way.r {
            axis = 1u;
        }
        if way.b > max(way.r, way.g) {
            axis = 2u;
        }
        let next = at + steps[axis];
        codes += way[axis] * (second[next].rgb - second[at].rgb);
        at = next;
        way[axis] = -1.0;
    }
    return clamp(codes, vec3<f32>(0.0), vec3<f32>(1.0));
}

@compute @workgroup_size(8, 8)
fn view(@builtin(global_invocation_id) id: vec3<u32>) {
    if outside(id) {
        return;
    }
    let i = index(id);
    var light = clamp(params.factor * first[i].rgb, vec3<f32>(0.0), vec3<f32>(65504.0));
    if params.power != 1.0 {
        light = min(pow(light, vec3<f32>(params.power)), vec3<f32>(65504.0));
    }
    var codes = srgb_from_linear(light);
    if params.curve == 1u {
        codes = filmic(light);
    } else if params.curve == 2u {
        codes = aces(light);
    } else if params.curve == 3u {
        codes = looked_up(light);
    }
    result[i] = vec4<f32>(codes, first[i].a);
}

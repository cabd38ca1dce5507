use crate::exr_file::{Channels, read};
use crate::{FOLDER, HARD_NAME, handed_over, picture};
use afterlight::calibration::Calibration;
use afterlight::imaging::Image;
use afterlight::light::latlong::{texel_direction, texel_solid_angle};
use afterlight::light::weights::rotation;
use afterlight::light::{Environment, Rig};
use afterlight::project::Project;
use glam::Vec3;
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::f32::consts::FRAC_1_PI;
use std::path::Path;
use std::process::Command;
use test_support::{blender, repository};

const LOOK: &str = "--environment nave --yaw 20 --yaw-keys 0:0,3:90 --exposure 0.5 --layers --hand-over blender";

/// Runs Blender without a window on the shot's script; returns its output if it failed.
fn run(folder: &Path, more: &[&str]) -> Result<(), String> {
    let script = folder.join(HARD_NAME.replace(".%04d.exr", ".blender.py"));
    let output = Command::new("blender")
        .args(["-b", "--factory-startup", "--python-exit-code", "1", "-P"])
        .arg(script)
        .args(more)
        .output()
        .unwrap();
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said).into_owned();
    if output.status.success() { Ok(()) } else { Err(said) }
}

/// Largest difference between Blender's rebuilt frame and the file's picture, as multiples of its values.
fn residual(folder: &Path, frame: usize) -> f32 {
    let name = HARD_NAME.replace(".%04d.exr", "");
    let made = read(&folder.join(format!("{name}.blender/{name}.{frame:04}.exr")));
    let wanted = picture(folder, frame);
    assert!(wanted.brightest() > 0.1);
    made.residual(&wanted)
}

#[test]
fn blender_rebuilds_the_picture_from_its_layers() {
    if !blender() {
        return;
    }
    let (_, folder) = handed_over("blender shot", HARD_NAME, LOOK);
    run(&folder, &["-a"]).unwrap();
    for frame in 0..4 {
        let largest = residual(&folder, frame);
        println!("frame {frame}: within {largest:.2e} of each value");
        assert!(largest <= 1e-3, "{largest}");
    }
    // A missing file is reported, and nothing is rendered.
    std::fs::remove_file(folder.join(HARD_NAME.replace("%04d", "0000"))).unwrap();
    let said = run(&folder, &[]).unwrap_err();
    assert!(said.contains("is missing; keep the script beside"), "{said}");
}

#[test]
fn blender_finds_layers_that_are_files() {
    if !blender() {
        return;
    }
    let options = format!("{LOOK} --frames 2-3 --no-background --layer-files files");
    let (_, folder) = handed_over("blender files", HARD_NAME, &options);
    run(&folder, &["-a"]).unwrap();
    for frame in 2..4 {
        let largest = residual(&folder, frame);
        assert!(largest <= 1e-3, "{largest}");
    }
}

/// Mean difference of two greens over the mean of the second, where `counts`.
fn error(made: &Channels, wanted: impl Fn(usize, usize) -> Option<f32>) -> f32 {
    let green = made.get("rgba.green");
    let (mut apart, mut whole) = (0.0, 0.0);
    for (i, made_value) in green.iter().enumerate() {
        if let Some(wanted) = wanted(i % made.width, i / made.width) {
            apart += (made_value - wanted).abs();
            whole += wanted;
        }
    }
    apart / whole
}

/// Position of one of 32 pixels relative to the middle, −1 to 1, to the right and up.
fn place(x: usize, y: usize) -> (f32, f32) {
    ((x as f32 + 0.5) / 16.0 - 1.0, 1.0 - (y as f32 + 0.5) / 16.0)
}

/// Normal of the ball at a pixel well inside its outline.
fn normal(x: usize, y: usize) -> Option<Vec3> {
    let (across, up) = place(x, y);
    let rest = 1.0 - across * across - up * up;
    (rest > 0.1).then(|| Vec3::new(across, up, rest.sqrt()))
}

#[test]
fn world_and_lamps_light_as_ours_do() {
    if !blender() {
        return;
    }
    let options = LOOK.replace("nave", "side-light") + " --pitch 25 --intensity 0.5";
    let (_, folder) = handed_over("blender light", HARD_NAME, &options);
    let look = repository("tests/handover/look.py");
    let at = folder.to_str().unwrap();
    run(&folder, &["-P", look.to_str().unwrap(), "--", "3", at]).unwrap();

    let panorama = read(&folder.join(HARD_NAME.replace(".%04d.exr", ".environment.exr")));
    let [r, g, b] = ["rgba.red", "rgba.green", "rgba.blue"].map(|name| panorama.get(name));
    let radiance = Image {
        width: panorama.width,
        height: panorama.height,
        pixels: (0..r.len()).map(|i| [r[i], g[i], b[i]]).collect(),
    };
    let sky = Environment::from_radiance("sky", radiance);
    let level = afterlight::compositor::Levels::of_environment(&sky) * 2f32.powf(0.5 + 0.5);
    // Yaw 20°, and the key of 90° at frame 3.
    let back = rotation(110.0, 25.0, 0.0).inverse();

    // The camera's view within 90°, as the mean of 16 points per pixel.
    let seen = |x: usize, y: usize| {
        let (across, up) = place(x, y);
        let points = (0..16).map(|i| {
            let part = |n: usize| ((n as f32 + 0.5) / 4.0 - 0.5) / 16.0;
            let d = Vec3::new(across + part(i % 4), up + part(i / 4), -1.0);
            level * sky.radiance(back * d)[1]
        });
        Some(points.sum::<f32>() / 16.0)
    };
    let sky_error = error(&read(&folder.join("sky.exr")), seen);

    // A matte ball of albedo 0.5 under the whole sky.
    let small = sky.reduced(128);
    let lit = |normal: Vec3| -> f32 {
        let mut sum = 0.0;
        for y in 0..64 {
            for x in 0..128 {
                let d = back.inverse() * texel_direction(x, y, 128, 64);
                let facing = normal.dot(d).max(0.0) * texel_solid_angle(y, 128, 64) as f32;
                sum += facing * small.radiance.at(x, y)[1];
            }
        }
        0.5 * FRAC_1_PI * level * sum
    };
    let under_sky = |x, y| normal(x, y).map(lit);
    let world_error = error(&read(&folder.join("world.exr")), under_sky);

    // The same under the rig's lamps, with the shot's weights.
    let project = Project::open(&FOLDER.path().join("film")).unwrap();
    let rig: Rig = Calibration::load(&project).unwrap().rig;
    let lighting = afterlight::light::Lighting { pitch_deg: 25.0, intensity_stops: 0.5, ..Default::default() };
    let weighting = lighting.weighting;
    let weights = afterlight::light::EnvironmentWeights::new(&sky, &rig, weighting).weights(&lighting, 110.0, 1.0);
    let under_lamps = |x, y| {
        normal(x, y).map(|normal| {
            let lamps = rig.lamps.iter().zip(&weights.per_lamp);
            let light = lamps.map(|(lamp, weight)| {
                let irradiance = lamp.energy[1] * weight[1] * level / 2f32.sqrt();
                irradiance * normal.dot(lamp.direction).max(0.0)
            });
            0.5 * FRAC_1_PI * light.sum::<f32>()
        })
    };
    let lamps_error = error(&read(&folder.join("lamps.exr")), under_lamps);
    println!("sky {sky_error:.4}, ball under it {world_error:.4}, under lamps {lamps_error:.4}");
    // The ball has Cycles' noise; some lamps are discs of a third of the sky, here points.
    assert!(sky_error < 0.005 && world_error < 0.03 && lamps_error < 0.05);
    // Turned the other way, or mirrored, the picture differs.
    let wrong = rotation(-110.0, 25.0, 0.0).inverse();
    let wrong = error(&read(&folder.join("sky.exr")), |x, y| {
        let (across, up) = place(x, y);
        Some(level * sky.radiance(wrong * Vec3::new(across, up, -1.0))[1])
    });
    let turned_lamps = error(&read(&folder.join("lamps.exr")), |x, y| under_lamps(31 - x, y));
    let turned_world = error(&read(&folder.join("world.exr")), |x, y| under_sky(31 - x, y));
    let wrong = [wrong, turned_lamps, turned_world];
    // Three times the tolerance.
    assert!(wrong.iter().all(|error| *error > 0.15), "{wrong:?}");
}

#[test]
fn placed_lights_follow_their_keys() {
    if !blender() {
        return;
    }
    let keys = [
        ("exposure", 0.0, 1.5),
        ("lights.1.yaw", -90.0, 90.0),
        ("lights.1.pitch", 0.0, 60.0),
        ("lights.1.radius", 10.0, 40.0),
        ("lights.1.intensity", 3.0, 6.0),
        ("lights.1.blue", 0.25, 1.0),
    ]
    .map(|(name, from, to)| {
        let keys = json!([{ "frame": 0, "value": from }, { "frame": 3, "value": to }]);
        let lane = json!({ "interpolation": "linear", "keys": keys });
        (name.to_owned(), lane)
    });
    let keys = Value::Object(keys.into_iter().collect());
    std::fs::write(FOLDER.path().join("placed.json"), keys.to_string()).unwrap();
    let look = "--environment nave --layers --hand-over blender --keys placed.json \
                --light 0,0,5,1,1,0.5,0 --light 40,30,15,2";
    let (_, folder) = handed_over("blender placed", HARD_NAME, look);
    let suns = repository("tests/handover/suns.py");
    let at = folder.to_str().unwrap();
    run(&folder, &["-P", suns.to_str().unwrap(), "--", at]).unwrap();

    let text = std::fs::read_to_string(folder.join("suns.json")).unwrap();
    let frames: Vec<BTreeMap<String, Sun>> = serde_json::from_str(&text).unwrap();
    assert_eq!(frames.len(), 4);
    // 32-bit numbers, here and in Blender, through sines and Euler angles.
    let near = |a: [f32; 3], b: [f32; 3]| Vec3::from(a).distance(b.into()) < 1e-4;
    // In Blender's axes: right, towards the back of the stage, up.
    let towards = |azimuth: f32, elevation: f32| {
        let (azimuth, elevation) = (azimuth.to_radians(), elevation.to_radians());
        let level = elevation.cos();
        [level * azimuth.sin(), level * azimuth.cos(), elevation.sin()]
    };
    for (index, suns) in frames.iter().enumerate() {
        let k = index as f32;
        let exposure = (0.5 * k).exp2();
        let given = |light: [f32; 3]| light.map(|channel| channel * exposure);
        for (name, direction, size_deg, light) in [
            (
                "Light 1",
                towards(60.0 * k - 90.0, 20.0 * k),
                20.0 * (k + 1.0),
                [3.0 + k, 0.5 * (3.0 + k), 0.25 * (k + 1.0) * (3.0 + k)],
            ),
            ("Light 2", towards(40.0, 30.0), 15.0, [2.0; 3]),
        ] {
            let sun = &suns[name];
            assert!(near(sun.direction, direction), "frame {index}: {sun:?}");
            let stands = direction.map(|part| 3.0 * part);
            assert!(near(sun.stands, stands), "frame {index}: {sun:?}");
            let angle = f32::to_radians(size_deg);
            assert!((sun.angle - angle).abs() < 1e-4, "frame {index}: {sun:?}");
            assert!(near(sun.light, given(light)), "frame {index}: {sun:?}");
        }
    }
}

/// A light as written by `suns.py`.
#[derive(Debug, Deserialize)]
struct Sun {
    stands: [f32; 3],
    direction: [f32; 3],
    angle: f32,
    light: [f32; 3],
}

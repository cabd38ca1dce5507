//! Light layers give the picture back at any light, size and background.

use crate::program::succeed;
use serde_json::Value;
use std::path::Path;

/// Largest difference from the picture, as a share of its brightest value.
const LARGEST: f64 = 2e-3;

/// Options of each export, from few lamps to many settings at once.
const LOOKS: &[&str] = &[
    "--environment nave",
    "--environment courtyard --no-background",
    "--environment three-point --at box",
    "--environment low-sun --at square",
    "--environment side-light --size 24",
    "--environment clear-sky --size 200",
    "--environment nave --smoothing 0.6 --despill 0.5",
    "--environment nave --smoothing 0.6 --at square --no-background",
    "--environment overcast --light 50,30,2,3",
    "--environment nave --light -120,10,40,2,1,0.4,0.1 --light 20,-40,5,0.5 --size 90",
    "--environment nave --yaw 137 --pitch 20 --temperature 3200 --tint 40 --intensity 6",
    "--environment nave --intensity -6 --exposure 2 --weights cells",
    "--environment courtyard --weights smooth --field compressed",
    "--environment courtyard --field f16 --exr-samples float",
];

/// The difference that an export reports, as a share of the picture's brightest value.
fn residual(folder: &Path, look: &str) -> f64 {
    let mut arguments: Vec<&str> =
        "relight film --frames 1-1 --device cpu --json --layers --to shot.%04d.exr".split(' ').collect();
    arguments.extend(look.split(' '));
    let figures: Value = succeed(folder, &arguments);
    let figure = |name: &str| figures["layers"][name].as_f64().unwrap();
    assert!(figure("brightest") > 0.0, "{look}");
    figure("residual") / figure("brightest")
}

#[test]
fn layers_give_the_picture_back_under_any_light_at_any_size() {
    for (lamps, plate) in [("6", "96x160"), ("40", "32x32")] {
        let folder = tempfile::tempdir().unwrap();
        let shoot = format!("stage shoot --size 32 --frames 2 --lamps {lamps} --plate {plate} --json");
        for command in [&*shoot, "import film --shoot shoot --size 32 --json", "calibrate film --json"] {
            succeed(folder.path(), &command.split(' ').collect::<Vec<_>>());
        }
        for look in LOOKS {
            let residual = residual(folder.path(), look);
            assert!(residual <= LARGEST, "{lamps} lamps, {look}: {residual:.2e}");
        }
    }
}

//! The program as a user or a script runs it: a complete small shoot, exit codes, JSON.

mod program;

use afterlight::imaging::{self, file::read_encoded};
use program::{afterlight, fail, succeed};
use serde_json::Value;
use std::path::Path;
use std::process::Command;
use test_support::Need;
use test_support::accident::contents;

fn has_keys(figures: &Value, keys: &[&str]) {
    for key in keys {
        assert!(figures.get(key).is_some(), "no {key} in {figures}");
    }
}

#[test]
fn a_small_shoot_goes_all_the_way() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeed(at, &["stage", "shoot", "--size", "32", "--frames", "8", "--lamps", "12", "--json"]);
    succeed(at, &["import", "film", "--shoot", "shoot", "--size", "32", "--json"]);

    let calibration = succeed(at, &["calibrate", "film", "--json"]);
    has_keys(&calibration, &["gamma1", "gamma2", "exposure", "interview_weights", "uncovered_energy", "lamps"]);
    let given = succeed(at, &["calibrate", "film", "--gamma", "srgb", "--json"]);
    assert_eq!(given["curve"], "srgb");
    for exponent in ["gamma1", "gamma2"] {
        let exponent = given[exponent].as_f64().unwrap();
        assert!((1.8..2.6).contains(&exponent), "{exponent}");
    }
    succeed(at, &["calibrate", "film", "--json"]);
    let lamps = calibration["lamps"].as_array().unwrap();
    assert_eq!(lamps.len(), 12);
    has_keys(&lamps[0], &["name", "direction", "energy", "confidence"]);
    assert_eq!(calibration["interview_weights"][0].as_array().unwrap().len(), 3);

    // Before any training the carried-over exemplars are used, and a message says so.
    let untrained = ["relight", "film", "--environment", "nave", "--frames", "0", "--to", "untrained.png"];
    let said = afterlight(at, &untrained);
    assert_eq!(said.status.code(), Some(0));
    let said = String::from_utf8_lossy(&said.stderr).into_owned();
    assert!(said.contains("No network is trained yet"), "{said}");
    assert!(at.join("untrained.png").exists());
    let untrained = ["evaluate", "film", "--truth", "shoot", "--device", "cpu", "--json"];
    let untrained = succeed(at, &untrained);
    assert_eq!(untrained["method"], "prediction");
    assert_eq!(untrained["training_steps"], Value::Null);
    let reviewed = succeed(at, &["review", "film", "--device", "cpu", "--json"]);
    has_keys(&reviewed, &["seen"]);
    assert_eq!((&reviewed["seen"], &reviewed["unseen"]["cases"]), (&Value::Null, &Value::from(6)));
    let refused = fail(at, &["evaluate", "film", "--truth", "shoot", "--with", "network"]);
    assert!(refused.contains("afterlight train"), "{refused}");

    let train = ["train", "film", "--epochs", "1", "--exclude-truth", "shoot", "--device", "cpu", "--json"];
    let trained = succeed(at, &train);
    has_keys(&trained, &["steps", "seconds", "features", "device", "parameters", "loss_rec", "loss_render"]);
    assert_eq!(trained["steps"], 6);

    let scores = succeed(at, &["evaluate", "film", "--truth", "shoot", "--sheet", "sheet.png", "--json"]);
    has_keys(&scores, &["relit_psnr_db", "olat_psnr_db", "frames"]);
    assert!(scores["relit_psnr_db"].as_object().unwrap().values().all(Value::is_number));
    assert!(at.join("sheet.png").exists());

    let page = at.join("review.html");
    let of_poses = ["review", "film", "--device", "cpu", "--json"];
    let reviewed = succeed(at, &of_poses);
    assert_eq!(reviewed["unseen"], Value::Null, "every pose was trained on");
    assert_eq!(reviewed["seen"]["cases"], 6);
    let with_truth = ["review", "film", "--truth", "shoot", "--report", "review.html", "--device", "cpu", "--json"];
    let reviewed = succeed(at, &with_truth);
    has_keys(&reviewed["unseen"], &["cases", "psnr_db", "ssim", "flip"]);
    has_keys(&reviewed["worst"][0], &["case", "lamp", "flip"]);
    // The same OLATs by the same measure: the pooled value lies between the frames' figures.
    let by_frame = scores["olat_psnr_by_frame_db"].as_object().unwrap();
    let by_frame: Vec<f64> = by_frame.values().filter_map(Value::as_f64).collect();
    assert_eq!(reviewed["unseen"]["cases"], by_frame.len());
    let pooled = reviewed["unseen"]["psnr_db"].as_f64().unwrap();
    let errors = by_frame.iter().map(|db| 10f64.powf(-db / 10.0));
    let mean = -10.0 * (errors.sum::<f64>() / by_frame.len() as f64).log10();
    assert!((pooled - mean).abs() < 1e-6, "{pooled} dB, {mean} dB by evaluate");
    let text = std::fs::read_to_string(&page).unwrap();
    assert_eq!(text.matches("<figure>").count(), 12);
    assert!(text.ends_with("</html>\n") && text.matches("data:image/png").count() == 3 * 12 + 12);

    // Nothing has changed, so the page is written again from the saved figures.
    std::fs::remove_file(&page).unwrap();
    let kept = std::fs::metadata(at.join("film/measured.json")).unwrap();
    let from_kept = succeed(at, &with_truth);
    for (set, figure) in ["seen", "unseen"].iter().zip(["psnr_db", "flip"]) {
        let [a, b] = [&from_kept, &reviewed].map(|r| r[set][figure].as_f64().unwrap());
        assert!((a - b).abs() < 1e-9, "{set} {figure}: {a}, {b}");
    }
    let again = std::fs::metadata(at.join("film/measured.json")).unwrap();
    assert!(page.exists() && kept.modified().unwrap() == again.modified().unwrap());

    let to_stills = ["relight", "film", "--environment", "nave", "--frames", "2-3", "--to", "out.%04d.exr", "--json"];
    let relit = succeed(at, &to_stills);
    has_keys(&relit, &["frames", "ms_per_frame", "passes", "output"]);
    has_keys(&relit["passes"][0], &["name", "ran", "reason", "ms"]);
    assert!(at.join("out.0002.exr").exists() && at.join("out.0003.exr").exists());

    fields_are_kept_as_asked(at);
    keys_of_a_file_are_followed(at);
    kernels_are_timed_once(at);
    fronts_are_yaws_and_are_remembered(at);
    let with_layers = [
        "relight",
        "film",
        "--environment",
        "nave",
        "--frames",
        "2-3",
        "--exposure",
        "1",
        "--layers",
        "--size",
        "24",
        "--keep",
        "--to",
        "out.%04d.exr",
        "--json",
    ];
    let relit = succeed(at, &with_layers);
    assert_eq!(relit["output"], "out_2.%04d.exr", "existing files are kept");
    has_keys(&relit["layers"], &["layers", "residual", "brightest"]);
    assert_eq!(relit["layers"]["layers"], 12);
    let figure = |name: &str| relit["layers"][name].as_f64().unwrap();
    assert!(figure("residual") <= figure("brightest") / 2048.0);
    assert!(at.join("out_2.0003.exr").exists());
    let checked = succeed(at, &["check", "out_2.0003.exr", "--strict", "--json"]);
    assert_eq!((&checked["layers"], &checked["level"]), (&Value::from(12), &Value::from("green")));
    layers_are_of_lights(at);
    shots_are_checked(at);
    configurations_decide_colors(at);
    exports_go_on(at);
    stills_stand_behind(at);
    let refused = fail(at, &["relight", "film", "--environment", "nave", "--layers", "--to", "x.mp4"]);
    assert!(refused.contains("%04d.exr"), "{refused}");

    if test_support::ffmpeg() {
        let to_clip = ["relight", "film", "--environment", "nave", "--turntable", "--to", "clip.mp4", "--json"];
        assert_eq!(succeed(at, &to_clip)["frames"], 8);
        assert!(at.join("clip.mp4").metadata().unwrap().len() > 500);
    }

    // More training on all frames shows the network the truth's frames. Training also works without a GPU driver.
    let mut command = Command::new(env!("CARGO_BIN_EXE_afterlight"));
    command.args(["train", "film", "--epochs", "2", "--device", "cpu"]);
    for drivers in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES", "__EGL_VENDOR_LIBRARY_FILENAMES"] {
        command.env(drivers, "/dev/null");
    }
    let output = command.current_dir(at).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let refused = fail(at, &["evaluate", "film", "--truth", "shoot"]);
    assert!(refused.contains("--exclude-frames"), "{refused}");
}

/// A light layer for the environment and one for a placed light.
fn layers_are_of_lights(at: &Path) {
    let by_light = "relight film --environment nave --frames 2-2 --layers --layers-by light --light -90,20,30,3 --light 60,0,10,2 \
                    --layer-weights --size 24 --to lights.%04d.exr --json";
    let by_light: Vec<&str> = by_light.split_whitespace().collect();
    let relit = succeed(at, &by_light);
    let figure = |name: &str| relit["layers"][name].as_f64().unwrap();
    assert!(figure("layers") == 3.0 && figure("residual") <= figure("brightest") / 2048.0);
    let text = std::fs::read_to_string(at.join("lights.0002.json")).unwrap();
    let listed: Value = serde_json::from_str(&text).unwrap();
    let name = |layer: usize| listed["layers"][layer]["layer"].as_str().unwrap();
    let names = ["light_00_environment", "light_01_Light_1", "light_02_Light_2"];
    assert_eq!([name(0), name(1), name(2)], names);
    succeed(at, &[&by_light[..], &["--solo", "olat_01"]].concat());
    let checked = succeed(at, &["check", "lights.0002.exr", "--strict", "--json"]);
    assert_eq!(checked["level"], "green");
    let refused = fail(at, &[&by_light[..], &["--hand-over", "nuke"]].concat());
    assert!(refused.contains("--layers-by lamp"), "{refused}");
}

/// Stills behind the subject, one for each frame; kept frames know them by their content.
fn stills_stand_behind(at: &Path) {
    let street = at.join("street");
    std::fs::create_dir(&street).unwrap();
    let still = |number: usize, code: u8| {
        let file = street.join(format!("street.{number:02}.png"));
        image::RgbImage::from_pixel(9, 4, image::Rgb([code; 3])).save(file).unwrap();
    };
    (0..4).for_each(|number| still(number, 30 + 40 * number as u8));
    let relight = |folder: &str| {
        let background = format!("{folder}/street.%02d.png,0.2,0,1.5,1");
        let asked = ["relight", "film", "--environment", "nave", "--frames", "1-2", "--resume"];
        let to = ["--background", &background, "--to", "street.%02d.png", "--json"];
        succeed(at, &[&asked[..], &to].concat())["kept"].as_u64().unwrap()
    };
    assert_eq!(relight("street"), 0);
    let srgb = imaging::color::srgb_from_linear;
    for (frame, code) in [(1, 70.0), (2, 110.0)] {
        let picture = read_encoded(&at.join(format!("street.{frame:02}.png"))).unwrap();
        let [corner, ..] = picture.0.pixels[0];
        let wanted = srgb(2.0 * imaging::color::linear_from_srgb(code / 255.0));
        assert!((corner - wanted).abs() < 1.5 / 255.0, "{frame}: {corner}, not {wanted}");
    }
    std::fs::rename(at.join("street"), at.join("moved")).unwrap();
    assert_eq!(relight("moved"), 2, "the same stills elsewhere");
    std::fs::copy(at.join("moved/street.03.png"), at.join("moved/street.02.png")).unwrap();
    assert_eq!(relight("moved"), 1, "another still behind frame 2");
    let asked = "relight film --environment nave --frames 1-1 --background none.exr --to a.png";
    let refused = fail(at, &asked.split(' ').collect::<Vec<_>>());
    assert!(refused.contains("none.exr"), "{refused}");
}

/// Checks the two frames of a shot with their light layers, as delivered.
fn shots_are_checked(at: &Path) {
    let folder = at.join("delivered");
    std::fs::create_dir(&folder).unwrap();
    for frame in ["out_2.0002.exr", "out_2.0003.exr"] {
        std::fs::copy(at.join(frame), folder.join(frame)).unwrap();
    }
    let shot = ["check", "delivered/out_2.####.exr", "--frames", "2-3"];
    let report = succeed(at, &[&shot[..], &["--mhl", "--strict", "--json"]].concat());
    has_keys(&report, &["sentence", "faults", "remarks", "time_code", "made_of", "files"]);
    assert_eq!(report["passed"], true);
    assert_eq!(report["layers"]["layers"], 12);
    has_keys(&report["made_of"], &["version", "project", "checkpoint", "environment", "settings"]);
    let list = report["hash_list"].as_str().unwrap();
    assert_eq!(succeed(at, &["check", list, "--json"])["same"], 2);
    let said = afterlight(at, &shot).stdout;
    let said = String::from_utf8_lossy(&said).into_owned();
    assert!(said.contains("2 frames 2-3") && said.lines().count() == 1, "{said}");
    let refused = fail(at, &["check", "delivered/out_2.%04d.exr", "--frames", "2-9"]);
    assert!(refused.contains("4-9"), "{refused}");
    // A frame by another network or under other light does not belong to the shot.
    let frame = folder.join("out_2.0003.exr");
    let whole = std::fs::read(&frame).unwrap();
    let other = "relight film --environment nave --frames 3-3 --exposure 1.5 --layers --size 24 --to delivered/out_2.%04d.exr --json";
    succeed(at, &other.split(' ').collect::<Vec<_>>());
    let refused = fail(at, &shot);
    assert!(refused.contains("(settings)"), "{refused}");
    assert!(fail(at, &["check", list]).contains("a different picture"));
    std::fs::write(&frame, whole).unwrap();
    succeed(at, &["check", "delivered/ascmhl", "--json"]);
    for (arguments, wanted) in [
        (&["check", "film", "--frames", "1-2"][..], "is not a shot"),
        (&["check", list, "--environment", "nave"], "an environment does not apply"),
        (&["check", list, "--mhl"], "is a hash list"),
        (&["check", "none.####.exr"], "none.####.exr"),
        (&["check", "film/project.toml", "out_2.0002.exr"], "different folders"),
    ] {
        let refused = fail(at, arguments);
        assert!(refused.contains(wanted), "{arguments:?}: {refused}");
    }
}

/// Colours set by an OpenColorIO configuration, named or remembered by the project.
fn configurations_decide_colors(at: &Path) {
    let chosen = succeed(at, &["ocio", "film", "--use", "ocio://default", "--json"]);
    has_keys(&chosen, &["displays", "looks", "roles", "spaces", "working"]);
    let kept = std::fs::read_to_string(at.join("film/project.toml")).unwrap();
    assert!(kept.contains("color_config = \"ocio://default\""), "{kept}");
    let relight = |to: &str, more: &[&str]| {
        let asked = ["relight", "film", "--environment", "nave", "--frames", "2-2", "--json"];
        let asked = [&asked[..], &["--to", to], more].concat();
        succeed(at, &asked);
        std::fs::read(at.join(to)).unwrap()
    };
    let plain = relight("plain.png", &[]);
    relight("shown.png", &["--ocio-display", "sRGB - Display"]);
    // The files also record how they were made.
    let [before, after] = ["plain.png", "shown.png"].map(|name| read_encoded(&at.join(name)).unwrap());
    assert!(before != after);
    relight("aces.exr", &["--ocio-space", "scene_linear", "--layers"]);
    assert_eq!(succeed(at, &["check", "aces.exr", "--json"])["level"], "green");
    let header = std::fs::read(at.join("aces.exr")).unwrap();
    assert!(header.windows(13).any(|part| part == b"lin_ap1_scene"));
    let refused = |more: &[&str]| {
        let asked = ["relight", "film", "--environment", "nave", "--frames", "2-2"];
        fail(at, &[&asked[..], more].concat())
    };
    let unknown = refused(&["--to", "a.png", "--ocio-view", "Sepia"]);
    assert!(unknown.contains("Sepia") && unknown.contains("ACES 2.0"), "{unknown}");
    let linear = refused(&["--to", "a.exr", "--ocio-view", "Raw"]);
    assert!(linear.contains("linear light"), "{linear}");
    let grain = refused(&["--to", "a.png", "--ocio-view", "Raw", "--grain", "0.5"]);
    assert!(grain.contains("grain"), "{grain}");
    assert!(fail(at, &["ocio", "film", "--use", "gone.ocio"]).contains("gone.ocio"));
    assert_eq!(succeed(at, &["ocio", "film", "--use", "none", "--json"])["config"], Value::Null);
    // An environment variable that names one changes nothing by itself.
    let mut command = Command::new(env!("CARGO_BIN_EXE_afterlight"));
    command.args(["relight", "film", "--environment", "nave", "--frames", "2-2", "--to", "again.png"]);
    let done = command.env("OCIO", "ocio://default").current_dir(at).output().unwrap();
    assert!(done.status.success());
    assert_eq!(std::fs::read(at.join("again.png")).unwrap(), plain);
    let listed = afterlight(at, &["ocio", "--ocio", "ocio://default"]).stdout;
    assert!(String::from_utf8_lossy(&listed).contains("scene_linear = ACEScg"));
}

/// Relights one frame; returns the output on stderr.
fn relit(at: &Path, arguments: &[&str]) -> String {
    let frame = "relight film --environment nave --frames 1-1 --to one.%04d.png --profile";
    let all: Vec<&str> = frame.split(' ').chain(arguments.iter().copied()).collect();
    let output = afterlight(at, &all);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    said
}

/// A stopped export continues: frames with the same inputs are kept, everything else is made again.
fn exports_go_on(at: &Path) {
    for (to, ending) in [("go.%02d.png", "png"), ("go.%02d.tif", "tif"), ("go.%02d.exr", "exr")] {
        let relight = |yaw: &str| {
            let asked = [
                "relight",
                "film",
                "--environment",
                "nave",
                "--frames",
                "1-4",
                "--resume",
                "--device",
                "cpu",
                "--yaw",
                yaw,
                "--to",
                to,
                "--json",
            ];
            let relit = succeed(at, &asked);
            has_keys(&relit["stages"], &["read_ms", "make_ms", "write_ms", "frame_ms"]);
            relit["kept"].as_u64().unwrap()
        };
        let file = |frame: usize| at.join(format!("go.{frame:02}.{ending}"));
        let read = || (1..=4).map(|frame| std::fs::read(file(frame)).unwrap()).collect::<Vec<_>>();
        assert_eq!(relight("10"), 0);
        let whole = read();
        // A kill leaves some of the frames; half a file may be left by hand.
        std::fs::remove_file(file(3)).unwrap();
        std::fs::write(file(1), &whole[0][..20]).unwrap();
        assert_eq!(relight("10"), 2);
        assert!(read() == whole, "{ending}: the frames are equal to those of an uninterrupted export");
        assert_eq!(relight("10"), 4);
        assert_eq!(relight("11"), 0, "another look");
        assert!(read() != whole);
    }
    let refused = fail(at, &["relight", "film", "--environment", "nave", "--resume", "--to", "x.mp4"]);
    assert!(refused.contains("cannot resume"), "{refused}");
    test_support::shown!(Accidents, "An export of stills is stopped or killed, and run again with --resume",
        bound: "the files of an uninterrupted export", measured: "equal bytes");
}

/// Keys in a file have the effect of their values at the frame.
fn keys_of_a_file_are_followed(at: &Path) {
    let keys = r#"{"exposure": {"interpolation": "linear", "keys": [{"frame": 0, "value": 0}, {"frame": 2, "value": 3}]},
        "pitch": {"keys": [{"frame": 0, "value": 20}]},
        "lights.1.yaw": {"keys": [{"frame": 0, "value": -90, "interpolation": "hold"}, {"frame": 2, "value": 90}]}}"#;
    std::fs::write(at.join("moving.json"), keys).unwrap();
    let picture = |options: &str| {
        let cpu = format!("--device cpu {options}");
        let arguments: Vec<&str> = cpu.split(' ').collect();
        relit(at, &arguments);
        // The file also records how it was made.
        read_encoded(&at.join("one.0001.png")).unwrap()
    };
    let light = |azimuth: i32| format!("--light {azimuth},20,30,3");
    let moving = picture(&format!("--keys moving.json {}", light(40)));
    assert!(moving == picture(&format!("--exposure 1.5 --pitch 20 {}", light(-90))));
    assert!(moving != picture(&format!("--exposure 1.5 --pitch 20 {}", light(40))));
    let refused = |file: &str| {
        let relight = ["relight", "film", "--environment", "nave"];
        let one = ["--frames", "1", "--to", "x.png"];
        let with = [&relight[..], &one, &["--keys", file]].concat();
        fail(at, &with)
    };
    assert!(refused("moving.json").contains("lights.1.yaw"));
    assert!(refused("nowhere.json").contains("nowhere.json"));
    std::fs::write(at.join("wrong.json"), r#"{"tilt": {"keys": []}}"#).unwrap();
    let said = refused("wrong.json");
    assert!(said.contains("wrong.json") && said.contains("tilt"), "{said}");
}

fn fields_are_kept_as_asked(at: &Path) {
    for (field, sentence) in [
        ("f32", "stored in f32"),
        ("f16", "stored in f16"),
        ("compressed", "of 36 components, with an error of up to 0."),
    ] {
        let said = relit(at, &["--device", "cpu", "--field", field]);
        assert!(said.contains(sentence), "{field}: {said}");
    }
}

/// Burn's kernel timings on a GPU are kept in the cache folder: a second run times nothing.
fn kernels_are_timed_once(at: &Path) {
    let log = at.join("kernels.log");
    // Earlier runs may have used a GPU.
    let _ = std::fs::remove_dir_all(at.join("cache"));
    let _ = std::fs::remove_file(&log);
    for first in [true, false] {
        let said = relit(at, &["--device", "gpu"]);
        if !test_support::require(Need::Gpu, said.contains("GPU (wgpu)"), &said) {
            return;
        }
        let timed = std::fs::read_to_string(&log).unwrap();
        // A build without the store times kernels in every process.
        assert_eq!(timed.contains("Fastest result"), first || !cfg!(feature = "keep-autotune"));
        std::fs::remove_file(&log).unwrap();
    }
}

/// The front of a file is a yaw of its content, given once or remembered by the project.
fn fronts_are_yaws_and_are_remembered(at: &Path) {
    let yard = image::Rgb32FImage::from_fn(64, 32, |x, y| image::Rgb([if x < 20 && y < 16 { 9.0 } else { 0.3 }; 3]));
    yard.save(at.join("yard.exr")).unwrap();
    let picture = |environment: &str, options: &[&str]| {
        let mut arguments = vec!["relight", "film", "--environment", environment];
        arguments.extend(["--frames", "2-2", "--to", "front.png", "--json"]);
        arguments.extend(options);
        succeed(at, &arguments);
        read_encoded(&at.join("front.png")).unwrap()
    };
    let plain = picture("yard.exr", &[]);
    let turned = picture("yard.exr", &["--yaw", "90"]);
    assert_ne!(plain, turned);
    assert_eq!(picture("yard.exr", &["--front", "blender"]), turned);
    assert_eq!(picture("yard.exr", &["--front", "90", "--yaw", "-90"]), plain);

    let add = ["environments", "film", "--add", "yard.exr", "--front", "blender", "--json"];
    let listed = succeed(at, &add);
    let entry = listed["environments"].as_array().unwrap().last().unwrap();
    assert_eq!((&entry["name"], &entry["front"]), (&"yard".into(), &90.0.into()));
    assert_eq!((&entry["added"], &entry["missing"]), (&true.into(), &false.into()));
    assert_eq!(picture("yard", &[]), turned);
    assert_eq!(picture("yard.exr", &[]), turned, "also by its file name");
    assert_eq!(picture("yard", &["--front", "afterlight"]), plain);
    succeed(at, &["environments", "film", "--remove", "yard", "--json"]);
    assert_eq!(picture("yard.exr", &[]), plain);
    let refused = fail(at, &["environments", "film", "--remove", "courtyard"]);
    assert!(refused.contains("shoot's"), "{refused}");
}

/// Directions come from the list, and `--lamps` thins them out.
#[test]
fn a_list_of_lamps_takes_the_place_of_balls_and_can_be_thinned_out() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let stage = ["stage", "shoot", "--size", "32", "--frames", "2", "--lamps", "12", "--json"];
    succeed(at, &stage);
    let shoot = at.join("shoot");
    let manifest = std::fs::read_to_string(shoot.join("manifest.json")).unwrap();
    let manifest: serde_json::Value = serde_json::from_str(&manifest).unwrap();
    let directions = manifest["bank_directions"].as_array().unwrap().iter().enumerate();
    let lines = directions.map(|(lamp, d)| format!("olat_{lamp:02}.png {} {} {}\n", d[0], d[1], d[2]));
    std::fs::write(shoot.join("dome.lp"), lines.collect::<String>()).unwrap();
    std::fs::remove_dir_all(shoot.join("probes")).unwrap();
    std::fs::remove_file(shoot.join("manifest.json")).unwrap();
    let import = ["import", "film", "--shoot", "shoot", "--size", "32", "--lamps", "6", "--json"];
    let imported = succeed(at, &import);
    assert_eq!(imported["lamps"], 6, "{imported}");
    let calibrated = succeed(at, &["calibrate", "film", "--gamma", "2.2", "--json"]);
    assert_eq!(calibrated["lamps"].as_array().map(Vec::len), Some(6), "{calibrated}");
    assert_eq!(calibrated["by_list"], true, "{calibrated}");
}

#[test]
fn the_background_is_the_plate_a_colour_a_checker_or_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let stage = ["stage", "shoot", "--size", "32", "--frames", "1", "--lamps", "4", "--json"];
    succeed(at, &stage);
    succeed(at, &["import", "film", "--shoot", "shoot", "--size", "32", "--json"]);
    succeed(at, &["calibrate", "film", "--gamma", "2.2", "--json"]);
    let corner = |background: &[&str]| {
        let relight = ["relight", "film", "--environment", "nave", "--to", "relit.png", "--json"];
        succeed(at, &[&relight[..], background].concat());
        image::open(at.join("relit.png")).unwrap().to_rgb8().get_pixel(0, 0).0
    };
    let near = |a: [u8; 3], b: [u8; 3]| a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 1);
    let color = corner(&["--background", "#306090"]);
    assert!(near(color, [0x30, 0x60, 0x90]), "{color:?}");
    // Light of 0.1 in sRGB codes.
    let checker = corner(&["--background", "checker"]);
    assert!(near(checker, [89; 3]), "{checker:?}");
    // The screen, which the camera's curve of 2.2 and the display's give back nearly as filmed.
    let [r, g, b] = corner(&["--background", "plate"]);
    assert!(g > r.saturating_add(40) && g > b.saturating_add(40), "{:?}", [r, g, b]);
    assert_eq!(corner(&["--background", "none"]), [0; 3]);
    assert_eq!(corner(&["--no-background"]), [0; 3]);
}

#[test]
fn a_shoot_with_a_hole_is_refused_by_the_files_name() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeed(at, &["stage", "shoot", "--size", "16", "--frames", "1", "--lamps", "4", "--json"]);

    let ball = at.join("shoot/probes/olat_02.png");
    let bytes = std::fs::read(&ball).unwrap();
    std::fs::remove_file(&ball).unwrap();
    let refused = fail(at, &["import", "film", "--shoot", "shoot", "--size", "16"]);
    assert!(refused.contains("probes/olat_02.png"), "{refused}");
    std::fs::write(&ball, bytes).unwrap();

    // The other poses have the lamp.
    let olat = at.join("shoot/exemplars/pose01/olat_02.png");
    let bytes = std::fs::read(&olat).unwrap();
    std::fs::remove_file(&olat).unwrap();
    succeed(at, &["import", "lacking", "--shoot", "shoot", "--size", "16", "--json"]);
    let found = succeed(at, &["lamps", "lacking", "--exchange", "olat_00,olat_01", "--json"]);
    assert_eq!(found["missing"]["pose01"][0], "olat_02");
    assert_eq!(found["exchanged"]["pose00"]["olat_00"], "olat_01");
    let refused = fail(at, &["lamps", "lacking", "--leave-out", "olat_09"]);
    assert!(refused.contains("no lamp olat_09"), "{refused}");

    std::fs::write(&olat, b"no picture").unwrap();
    let refused = fail(at, &["import", "film", "--shoot", "shoot", "--size", "16"]);
    assert!(refused.contains("pose01/olat_02.png"), "{refused}");

    let import = ["import", "kept", "--shoot", "shoot", "--size", "16", "--json"];
    succeed(at, &[&import[..], &["--leave-out", "olat_02", "--pose", "pose01"]].concat());

    image::RgbImage::new(8, 16).save(&olat).unwrap();
    let refused = fail(at, &["import", "film", "--shoot", "shoot", "--size", "16"]);
    assert!(refused.contains("pose01/olat_02.png") && refused.contains("8 × 16"), "{refused}");

    std::fs::write(&olat, bytes).unwrap();
    succeed(at, &["import", "film", "--shoot", "shoot", "--size", "16", "--json"]);
    let project = std::fs::read_to_string(at.join("film/project.toml")).unwrap();
    assert!(project.contains("folder = \"../shoot\""), "{project}");
    let refused = fail(at, &["import", "film", "--shoot", "shoot", "--size", "16"]);
    assert!(refused.contains("project.toml"), "{refused}");
}

#[test]
fn a_project_is_checked_and_a_strict_check_stops_a_pipeline() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    test_shoot::TestShoot::default().import(at, "film");
    let unknown = succeed(at, &["check", "film", "--environment", "nave", "--json"]);
    assert_eq!(unknown["level"], "unknown");
    let checks = unknown["checks"].as_array().unwrap();
    has_keys(&checks[0], &["subject", "environment", "level", "sentence", "remedy"]);
    assert_eq!(checks.last().unwrap()["environment"], "nave");
    let strict = ["check", "film", "--strict", "--json"];
    assert!(fail(at, &strict).contains("not green"));
    let printed = afterlight(at, &strict).stdout;
    let figures: Value = serde_json::from_slice(&printed).expect("figures before the failure");
    assert_eq!(figures["level"], "unknown");

    succeed(at, &["calibrate", "film", "--json"]);
    let known = succeed(at, &["check", "film", "--json"]);
    assert_ne!(known["level"], "unknown");
    let text = afterlight(at, &["check", "film"]).stdout;
    let text = String::from_utf8(text).unwrap();
    // The last line points to the hard cases.
    assert_eq!(text.lines().count(), known["checks"].as_array().unwrap().len() + 1);
    assert!(text.trim_end().lines().last().unwrap().contains("docs/stability.md"));
    assert!(text.contains("Camera response"), "{text}");
    assert!(fail(at, &["check", "film", "--environment", "none.hdr"]).contains("none.hdr"));
    assert!(fail(at, &["check", "nowhere"]).contains("nowhere"));
}

#[test]
fn wrong_usage_exits_with_2_and_help_has_examples() {
    let folder = tempfile::tempdir().unwrap();
    for wrong in [&["train"][..], &["stage", "x", "--size", "many"], &["relight", "film", "--yaw"], &["--nonsense"]] {
        assert_eq!(afterlight(folder.path(), wrong).status.code(), Some(2), "{wrong:?}");
    }
    let relight = ["relight", "film", "--environment", "nave", "--to", "x.png"];
    let probe = ["probe", "ball.png", "--to", "x.exr"];
    let cases: [(&[&str], &str, &str); 22] = [
        (&relight, "--exposure nan", "from -10 to 10"),
        (&relight, "--intensity inf", "from -10 to 10"),
        (&relight, "--yaw nan", "from -100000 to 100000"),
        (&relight, "--pitch inf", "from -100000 to 100000"),
        (&relight, "--temperature -5", "from 1667 to 25000"),
        (&relight, "--tint 1e9", "from -150 to 150"),
        (&relight, "--vignette -0.1", "from 0 to 0.9"),
        (&relight, "--grain nan", "from 0 to 4"),
        (&relight, "--size -16", "from 16 to 8192"),
        (&relight, "--light 0,0,nan,1", "AZIMUTH"),
        (&relight, "--yaw-keys 0:nan", "limited to 1000000000"),
        (&relight, "--front inf", "degrees of yaw"),
        (&probe, "--fov nan", "from 0.1 to 179"),
        (&probe, "--height -1", "from 1 to 4096"),
        (&probe, "--reflectivity 1,nan,1", "from 0.01 to 1"),
        (&probe, "--stops inf", "from -40 to 40"),
        (&["stage", "x"], "--ambient nan", "from 0 to 0.9"),
        (&["import", "x", "--shoot", "y"], "--size 100", "from 16 to 1024"),
        (&["train", "x"], "--set shift=-1", "from 0 to 0.5"),
        (&["train", "x"], "--set learning-rate=nan", "from 0 to 1"),
        (&["train", "x"], "--set rendering-every=0", "from 1 to"),
        (&["train", "x"], "--minutes nan", "above 0"),
    ];
    for (command, option, range) in cases {
        let arguments: Vec<&str> = (command.iter().copied()).chain(option.split(' ')).collect();
        let output = afterlight(folder.path(), &arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{option}: {said}");
        assert!(said.contains(range), "{option}: {said}");
    }
    let written = std::fs::read_dir(folder.path()).unwrap();
    let written: Vec<_> = written.flatten().map(|entry| entry.file_name()).collect();
    assert!(written.is_empty(), "{written:?}");
    test_support::shown!(
        Surroundings,
        "An option is NaN, infinite, negative or out of range",
        bound: "exit code 2",
        measured: format!("{} options", cases.len()),
    );
    for command in [
        "stage",
        "import",
        "environments",
        "calibrate",
        "check",
        "train",
        "relight",
        "evaluate",
        "review",
        "blind",
        "confidence",
        "tradeoff",
        "device",
        "ocio",
        "studio",
        "demo",
        "pack",
    ] {
        let help = afterlight(folder.path(), &[command, "--help"]);
        assert_eq!(help.status.code(), Some(0));
        assert!(String::from_utf8_lossy(&help.stdout).contains("Example: afterlight"), "{command}");
    }
    let missing = fail(folder.path(), &["calibrate", "nowhere"]);
    assert!(missing.contains("nowhere") && missing.contains("afterlight import"), "{missing}");
}

/// A script may close the pipe, and a disk may be full.
#[cfg(target_os = "linux")]
#[test]
fn output_that_nobody_takes_is_no_crash() {
    use std::io::{BufRead, BufReader};
    use std::process::Stdio;
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    test_shoot::TestShoot::default().import(at, "film");
    let check = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_afterlight"));
        command.args(["check", "film", "--json"]).current_dir(at);
        command.stderr(Stdio::piped());
        command
    };
    let full = || std::fs::File::options().write(true).open("/dev/full").unwrap();
    let output = check().stdout(full()).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("stdout") && said.contains("work itself is done"), "{said}");
    // Without stderr no message is possible, but the exit code still reports the failure.
    let output = check().stdout(full()).stderr(full()).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let output = check().stderr(full()).output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    // The reader closes before the first line is written.
    let mut gone = check().stdout(Stdio::piped()).spawn().unwrap();
    drop(gone.stdout.take());
    let said: Vec<String> = BufReader::new(gone.stderr.take().unwrap()).lines().map_while(Result::ok).collect();
    assert_eq!(gone.wait().unwrap().code(), Some(0), "{said:?}");
    test_support::shown!(
        Surroundings,
        "Output goes to a full disk, or to a program that has ended",
        done: "a full disk is reported with exit code 1; a closed pipe is not an error",
    );
}

/// Rewrites a picture.
fn repaint(path: &Path, change: impl Fn(image::RgbImage) -> image::RgbImage) {
    let picture = image::open(path).unwrap().into_rgb8();
    change(picture).save(path).unwrap();
}

#[test]
fn bad_pictures_are_named_and_leave_the_project_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let stage = ["stage", "shoot", "--size", "64", "--frames", "2", "--lamps", "12", "--json"];
    succeed(at, &stage);
    succeed(at, &["import", "film", "--shoot", "shoot", "--size", "32", "--json"]);
    succeed(at, &["calibrate", "film", "--json"]);
    let (project, mut shoot) = (contents(&at.join("film")), contents(&at.join("shoot")));
    shoot.retain(|path, _| path.is_file());
    let balls: Vec<_> = shoot.keys().filter(|path| path.parent().unwrap().ends_with("probes")).collect();
    let all_balls = |level: u8| {
        for path in &balls {
            repaint(path, |picture| {
                image::RgbImage::from_pixel(picture.width(), picture.height(), image::Rgb([level; 3]))
            });
        }
    };
    let olat = at.join("shoot/exemplars/pose01/olat_03.png");
    let ball = at.join("shoot/probes/olat_03.png");
    let smaller = |path: &Path| repaint(path, |picture| image::imageops::thumbnail(&picture, 16, 16));
    type Fault<'a> = &'a dyn Fn();
    let cases: [(&str, Fault, &[&str], [&str; 2]); 11] = [
        ("black balls", &|| all_balls(0), &[], ["interview.png", "expose them"]),
        ("black balls, looked for", &|| all_balls(0), &["--find-ball"], ["interview.png", "more light"]),
        ("clipped balls", &|| all_balls(255), &[], ["interview.png", "clipped everywhere"]),
        ("clipped balls, looked for", &|| all_balls(255), &["--find-ball"], ["interview.png", "denser filter"]),
        (
            "no ball",
            &|| {
                for path in &balls {
                    repaint(path, |picture| image::imageops::fast_blur(&picture, 20.0));
                }
            },
            &["--find-ball"],
            ["interview.png", "set the circle by hand"],
        ),
        ("five pixels", &|| (), &["--circle", "32,32,5"], ["interview.png", "closer"]),
        ("a ball's size", &|| smaller(&ball), &[], ["probes/olat_03.png", "uncropped"]),
        ("an OLAT's size", &|| smaller(&olat), &[], ["pose01/olat_03.png", "matte"]),
        ("no OLAT", &|| std::fs::remove_file(&olat).unwrap(), &[], ["pose01/olat_03.png", "Check"]),
        ("no ball's photograph", &|| std::fs::remove_file(&ball).unwrap(), &[], ["probes/olat_03.png", "Check"]),
        (
            "a black subject",
            &|| {
                for path in shoot.keys().filter(|path| path.to_string_lossy().contains("exemplars")) {
                    repaint(path, |picture| image::RgbImage::new(picture.width(), picture.height()));
                }
            },
            &[],
            ["exemplars", "exposure"],
        ),
    ];
    for (what, fault, options, words) in cases {
        fault();
        let mut arguments = vec!["calibrate", "film"];
        arguments.extend(options);
        let sentence = fail(at, &arguments);
        println!("{what}: {sentence}");
        assert!(words.iter().all(|word| sentence.contains(word)), "{what}: {sentence}");
        assert_eq!(contents(&at.join("film")), project, "{what}");
        for (path, bytes) in &shoot {
            std::fs::write(path, bytes).unwrap();
        }
    }
    // A NaN in a linear photograph is repaired and counted.
    let mut light = image::Rgb32FImage::from_fn(64, 64, |x, y| {
        let r = (x as f32 - 31.5).hypot(y as f32 - 31.5);
        image::Rgb([if r < 24.0 { 0.4 + 0.01 * x as f32 } else { 0.02 }; 3])
    });
    light.put_pixel(30, 30, image::Rgb([f32::NAN, 1.0, 1.0]));
    light.save(at.join("ball.exr")).unwrap();
    let probe = ["probe", "ball.exr", "--circle", "32,32,24", "--to", "light.exr", "--json"];
    assert_eq!(succeed(at, &probe)["repaired_pixels"][0], 1);
}

/// As many lamps as the paper's stage, each in its own bank.
#[test]
fn nine_hundred_and_thirty_one_lamps_go_all_the_way() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let stage = ["stage", "shoot", "--size", "32", "--frames", "1", "--lamps", "931", "--json"];
    succeed(at, &stage);
    let import = ["import", "film", "--shoot", "shoot", "--size", "16", "--json"];
    assert_eq!(succeed(at, &import)["lamps"], 931);
    // Fitting the response as well takes minutes with this many lamps.
    let truth = std::fs::read_to_string(at.join("shoot/truth.json")).unwrap();
    let truth: Value = serde_json::from_str(&truth).unwrap();
    let gamma = format!("{},{}", truth["g1"], truth["g2"]);
    let calibrated = succeed(at, &["calibrate", "film", "--gamma", &gamma, "--json"]);
    assert_eq!(calibrated["lamps"].as_array().unwrap().len(), 931);
    let train = ["train", "film", "--epochs", "1", "--device", "cpu", "--json"];
    let trained = succeed(at, &train);
    assert_eq!(trained["skipped_steps"], 0);
    assert!(trained["loss_rec"].is_number(), "it is finite");
    test_support::shown!(
        Network,
        "931 lamps",
        bound: "an epoch without a skipped step, a finite loss",
        measured: "none skipped, finite",
    );
    for device in ["cpu", "gpu"] {
        let relight = [
            "relight",
            "film",
            "--environment",
            "nave",
            "--layers",
            "--to",
            "lit.%04d.exr",
            "--device",
            device,
            "--json",
        ];
        let relit = succeed(at, &relight);
        assert_eq!(relit["layers"]["layers"], 931);
        let figure = |name: &str| relit["layers"][name].as_f64().unwrap();
        assert!(figure("residual") <= figure("brightest") / 2048.0);
    }
    let refused = ["stage", "larger", "--size", "16", "--frames", "1", "--lamps", "932"];
    let refused = afterlight(at, &refused);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("from 4 to 931"));
}

/// The work of `make` without a display, with a shorter training.
#[test]
fn the_demo_leaves_a_project_a_clip_a_sheet_and_a_report() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let made = succeed(at, &["demo", "--minutes", "0.05", "--device", "cpu", "--json"]);
    assert!(made["training"]["steps"].as_u64().unwrap() > 0);
    assert_eq!(made["training"]["skipped_steps"], 0);
    // The carried-over exemplars beat the baseline under every environment, and the prediction stays above it.
    let decibels = |method: &str| made[method]["relit_psnr_db"].as_object().unwrap().clone();
    let [prediction, transfer, ratio] = ["prediction", "transfer", "ratio"].map(decibels);
    assert_eq!(prediction.len(), 2);
    for (environment, prediction) in &prediction {
        let [prediction, transfer, ratio] =
            [prediction, &transfer[environment], &ratio[environment]].map(|db| db.as_f64().unwrap());
        for found in [prediction, transfer] {
            assert!(found > ratio + 1.0, "{environment}: {found} dB, ratio {ratio} dB");
        }
    }
    assert_eq!(made["relight"]["frames"], 24);
    let probe = Command::new("ffprobe")
        .args(["-v", "error", "-count_frames", "-show_entries"])
        .args(["stream=width,height,nb_read_frames", "-of", "csv=p=0"])
        .arg(at.join("demo/relit.mp4"))
        .output()
        .unwrap();
    let probed = String::from_utf8_lossy(&probe.stdout);
    assert_eq!(probed.trim(), "540,960,24");
    let sheet = image::open(at.join("demo/olats.png")).unwrap().into_rgb8();
    let codes = sheet.as_raw();
    assert!(codes.iter().any(|&code| code > 100) && codes.iter().any(|&code| code < 20));
    let report = std::fs::read_to_string(at.join("demo/report.md")).unwrap();
    for environment in prediction.keys() {
        assert!(report.contains(&format!("| {environment} |")), "{report}");
    }
    assert!(report.contains("![") && !report.contains("NaN"), "{report}");

    // A second run keeps everything, so that the window opens at once.
    let made = || {
        let mut made = contents(&at.join("demo"));
        // Writing to an existing project takes its lock.
        made.remove(&at.join("demo/project/.lock"));
        made
    };
    let before = made();
    let prepared = succeed(at, &["demo", "--prepare", "--json"]);
    assert_eq!((&prepared["lamps"], &prepared["frames"]), (&41.into(), &24.into()));
    let changed: Vec<_> =
        made().into_iter().filter(|(path, bytes)| before.get(path) != Some(bytes)).map(|(path, _)| path).collect();
    assert!(changed.is_empty(), "{changed:?}");
}

#[test]
fn a_project_that_another_writes_to_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let stage = ["stage", "shoot", "--size", "16", "--frames", "1", "--lamps", "4", "--json"];
    succeed(at, &stage);
    let import = ["import", "film", "--shoot", "shoot", "--size", "16", "--name", "Anna", "--json"];
    assert_eq!(succeed(at, &import)["name"], "Anna");
    let lock = afterlight::project::Lock::take(&at.join("film"), "a test").unwrap();
    let before = contents(&at.join("film"));
    for arguments in
        [&["calibrate", "film"][..], &["train", "film"], &["frame", "film", "--interview", "0,0,8"], &import]
    {
        let refused = fail(at, arguments);
        let holder = format!("a test, process {}", std::process::id());
        assert!(refused.contains(&holder), "{arguments:?}: {refused}");
    }
    assert_eq!(contents(&at.join("film")), before);
    drop(lock);

    let framed = ["frame", "film", "--interview", "-2,3,12", "--padding", "edge", "--json"];
    let figures = succeed(at, &framed);
    assert_eq!(figures["interview"], figures["exemplars"], "they have the same size");
    assert_eq!(figures["interview"]["x"], -2);
    let project = std::fs::read_to_string(at.join("film/project.toml")).unwrap();
    assert!(project.contains("side = 12") && project.contains("padding = \"edge\""), "{project}");
    let refused = fail(at, &["frame", "film", "--interview", "16,0,8"]);
    assert!(refused.contains("16 × 16"), "{refused}");
}

#[test]
fn swapped_olats_are_named_by_the_layout() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let stage = ["stage", "shoot", "--size", "64", "--frames", "2", "--lamps", "12", "--json"];
    succeed(at, &stage);
    let probes = at.join("shoot/probes");
    let mut folders = vec![probes];
    for entry in std::fs::read_dir(at.join("shoot/exemplars")).unwrap().flatten() {
        folders.push(entry.path());
    }
    for folder in folders {
        let [a, b, between] = ["olat_03.png", "olat_07.png", "x"].map(|name| folder.join(name));
        std::fs::rename(&a, &between).unwrap();
        std::fs::rename(&b, &a).unwrap();
        std::fs::rename(&between, &b).unwrap();
    }
    succeed(at, &["import", "film", "--shoot", "shoot", "--size", "32", "--json"]);
    let found = succeed(at, &["calibrate", "film", "--json"]);
    let findings = found["rig_findings"].to_string();
    assert!(findings.contains("olat_03") && findings.contains("olat_07"), "{findings}");
}

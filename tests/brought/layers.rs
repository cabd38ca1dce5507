//! A shoot whose interview has several layers: the chosen one is read from import on.

use afterlight::export::relight::RelightSettings;
use afterlight::footage::scan::scan;
use afterlight::footage::{ImportSettings, LampSettings, import, read_light, report_mended};
use afterlight::imaging::{Image, Response, file};
use afterlight::progress::Progress;
use afterlight::project::Project;
use afterlight::worker::Job;
use test_shoot::{TestShoot, write_layers};

#[test]
fn a_layer_chosen_at_import_is_read_ever_after() {
    let folder = tempfile::tempdir().unwrap();
    let stage = TestShoot::default();
    let shoot = stage.write(folder.path());
    let mut lights = Vec::new();
    for entry in std::fs::read_dir(shoot.join("interview")).unwrap() {
        let png = entry.unwrap().path();
        let mut light = file::read_linear(&png).unwrap();
        light.pixels[0] = [f32::NAN; 3];
        write_layers(&png.with_extension("exr"), &light);
        std::fs::remove_file(&png).unwrap();
        lights.push((png.with_extension("exr"), light));
    }
    lights.sort_by(|a, b| a.0.cmp(&b.0));
    let silent = Progress::silent();
    let make = |name: &str, layer: Option<&str>| {
        let layer = layer.map(str::to_owned);
        let settings = ImportSettings { size: stage.working_size, seed: 5, layer };
        import(&folder.path().join(name), &shoot, &settings, &silent)
    };
    let refused = make("none", None).unwrap_err().to_string();
    for word in ["\"albedo\", \"comp\"", "--layer", "frame_000.exr"] {
        assert!(refused.contains(word), "{word}: {refused}");
    }
    let refused = make("wrong", Some("sky")).unwrap_err().to_string();
    assert!(refused.contains("none called \"sky\": \"albedo\", \"comp\""), "{refused}");

    let scanned = |layer: Option<&str>| scan(&shoot, layer);
    assert_eq!(scanned(None).layers, ["albedo", "comp"]);
    assert!(!scanned(None).is_complete() && scanned(Some("comp")).is_complete());
    assert_eq!(scanned(Some("comp")).picture, Some(lights[0].1.size()));

    // Two projects of one shoot, each with its layer.
    for (name, layer) in [("comp", "comp"), ("albedo", "Albedo")] {
        make(name, Some(layer)).unwrap();
    }
    let opened = ["comp", "albedo"].map(|name| Project::open(&folder.path().join(name)).unwrap());
    for (project, factor) in opened.iter().zip([1.0, 0.5]) {
        let light = read_light(&project.frame_picture(0), &Response::Srgb).unwrap();
        let pairs = light.pixels.iter().zip(&lights[0].1.pixels).skip(1);
        let same = pairs.flat_map(|(found, right)| found.iter().zip(right));
        assert!(same.into_iter().all(|(found, right)| *found == factor * right));
        assert!(light.pixels[0].iter().all(|v| v.is_finite()));
    }
    let ((), said) = Progress::heard(|progress| (0..2).for_each(|_| report_mended(progress)));
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(said.contains("frame_%03d.exr and another picture: 2 pixels"), "{said}");
    assert!(said.contains("NaN or infinite: filled from their neighbours"), "{said}");

    let job = Job::Import {
        project: folder.path().join("job"),
        shoot: shoot.clone(),
        settings: ImportSettings { size: 32, seed: 5, layer: Some("comp".to_owned()) },
        corrections: LampSettings::default(),
        lamps: None,
        name: None,
    };
    let outcome = job.run(&silent).unwrap();
    let figures = serde_json::to_value(&outcome).unwrap();
    assert_eq!(figures["pictures"][0]["kind"], "Interview");
    assert_eq!(figures["pictures"][0]["count"], stage.frames);
    let line = "Interview: 3 EXR, 32 bits, layer \"comp\", scene-linear";
    assert!(outcome.sentence().lines().any(|said| said == line), "{}", outcome.sentence());
}

#[test]
fn a_panorama_s_layer_is_chosen_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let stage = TestShoot::default();
    let project = stage.import(folder.path(), "film");
    let sky = folder.path().join("sky.exr");
    write_layers(&sky, &Image::filled(8, 4, [2.0, 1.0, 0.5]));
    #[derive(clap::Parser)]
    struct Words {
        #[command(flatten)]
        settings: RelightSettings,
    }
    let find = |more: &[&str]| {
        let words = ["relight", "--to", "a.png", "--environment", sky.to_str().unwrap()];
        let words = words.iter().chain(more);
        let settings = <Words as clap::Parser>::parse_from(words).settings;
        settings.find_environment(&project, &Progress::silent())
    };
    let refused = find(&[]).unwrap_err().to_string();
    assert!(refused.contains("\"albedo\", \"comp\"") && refused.contains("--environment-layer"));
    for (layer, factor) in [("comp", 1.0), ("albedo", 0.5)] {
        let (found, _) = find(&["--environment-layer", layer]).unwrap();
        assert_eq!(found.radiance.pixels[0], [2.0, 1.0, 0.5].map(|v| factor * v), "{layer}");
    }
}

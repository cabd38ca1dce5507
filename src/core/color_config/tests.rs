use super::*;
use imaging::color::{linear_from_srgb, unit};
use imaging::color_space::{ColorSpace, transformed};
use imaging::{DisplayTable, Image, Raster, file::read_encoded};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// OpenColorIO's own configurations for ACES 2.0 and ACES 1.3.
const BUILT_IN: [&str; 3] = [
    "ocio://cg-config-v4.0.0_aces-v2.0_ocio-v2.5",
    "ocio://studio-config-v4.0.0_aces-v2.0_ocio-v2.5",
    "ocio://cg-config-v1.0.0_aces-v1.3_ocio-v2.1",
];

/// A studio's configuration with its own tables beside it, a look, and a display with two views.
fn own(folder: &Path, spaces: &str) -> PathBuf {
    let luts = folder.join("luts");
    std::fs::create_dir_all(&luts).unwrap();
    let mut cube = "LUT_3D_SIZE 9\n".to_owned();
    for i in 0..729 {
        let [r, g, b] = [i % 9, i / 9 % 9, i / 81].map(|v| v as f32 / 8.0);
        writeln!(cube, "{} {} {}", r.powf(0.8), 0.9 * g + 0.1 * r * b, b * b * (3.0 - 2.0 * b)).unwrap();
    }
    std::fs::write(luts.join("film.cube"), cube).unwrap();
    let mut curve = "Version 1\nFrom 0.0 1.0\nLength 64\nComponents 1\n{\n".to_owned();
    (0..64).for_each(|i| writeln!(curve, "{}", (i as f32 / 63.0).powf(1.0 / 2.4)).unwrap());
    std::fs::write(luts.join("print.spi1d"), curve + "}\n").unwrap();
    let config = folder.join("config.ocio");
    std::fs::write(&config, OWN.replace("SPACES", spaces)).unwrap();
    config
}

const OWN: &str = "ocio_profile_version: 2.1
search_path: luts
description: A studio's own
roles:
  default: log
  scene_linear: light
  aces_interchange: aces
displays:
  Monitor:
    - !<View> {name: Film, colorspace: film}
    - !<View> {name: Print, colorspace: print, looks: warm}
looks:
  - !<Look>
    name: warm
    process_space: log
    transform: !<CDLTransform> {slope: [1.1, 1, 0.9], offset: [0.01, 0, -0.01], power: [1, 1.05, 1], sat: 0.9}
  - !<Look>
    name: cool
    process_space: light
    transform: !<CDLTransform> {slope: [0.9, 1, 1.2], style: noclamp}
colorspaces:
  - !<ColorSpace>
    name: aces
    encoding: scene-linear
SPACES
  - !<ColorSpace>
    name: log
    encoding: log
    from_scene_reference: !<LogAffineTransform> {base: 10, log_side_slope: 0.25, log_side_offset: 0.6, lin_side_slope: 1, lin_side_offset: 0.005}
  - !<ColorSpace>
    name: film
    from_scene_reference: !<GroupTransform>
      children:
        - !<ColorSpaceTransform> {src: aces, dst: log}
        - !<FileTransform> {src: film.cube, interpolation: tetrahedral}
  - !<ColorSpace>
    name: print
    from_scene_reference: !<GroupTransform>
      children:
        - !<RangeTransform> {min_in_value: 0, min_out_value: 0, max_in_value: 1, max_out_value: 1}
        - !<FileTransform> {src: print.spi1d}
  - !<ColorSpace>
    name: numbers
    isdata: true
";
/// Its working space is ACEScg, and linear Rec. 709 is not in it.
const ACES_CG: &str = "  - !<ColorSpace>
    name: light
    encoding: scene-linear
    to_scene_reference: !<MatrixTransform> {matrix: [0.695452241357, 0.140678696470, 0.163869062172, 0, 0.0447945634, 0.859671118456, 0.095534318210, 0, -0.005525882558, 0.004025210306, 1.001500672252, 0, 0, 0, 0, 1]}";
/// Its working space is ours.
const REC_709: &str = "  - !<ColorSpace>
    name: light
    aliases: [lin_rec709_scene]
    encoding: scene-linear
    to_scene_reference: !<MatrixTransform> {matrix: [0.439632982, 0.382988698, 0.177378320, 0, 0.0897764430, 0.813439429, 0.0967841280, 0, 0.0175411704, 0.111546553, 0.870912276, 0, 0, 0, 0, 1]}";

/// Colours of a test chart: corners, greys, colours between, light below black and far above white.
fn chart() -> Vec<[f32; 3]> {
    let steps = [-0.05, 0.0, 0.001, 0.02, 0.18, 0.5, 1.0, 4.0, 60.0];
    let pairs = steps.iter().flat_map(|&r| steps.iter().map(move |&g| (r, g)));
    pairs.flat_map(|(r, g)| steps.iter().map(move |&b| [r, g, b])).collect()
}

/// A frame of the demo's interview in linear light, with a lamp in it.
fn frame() -> Image {
    let codes = read_encoded(&test_support::repository("assets/interview/frame_000.jpg")).unwrap();
    let (width, height) = codes.0.size();
    Raster::from_fn(width / 3, height / 3, |x, y| {
        let light = codes.0.at(3 * x, 3 * y).map(linear_from_srgb);
        if x < 8 && y < 8 { light.map(|v| 100.0 * v) } else { light }
    })
}

/// PyOpenColorIO's output for pixels: for each target as many.
fn theirs(python: &Path, pixels: &[[f32; 3]], arguments: &[&str]) -> Vec<[f32; 3]> {
    let folder = tempfile::tempdir().unwrap();
    let [from, to] = ["in.f32", "out.f32"].map(|name| folder.path().join(name));
    let bytes: Vec<u8> = pixels.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    std::fs::write(&from, bytes).unwrap();
    let mut peer = Command::new(python);
    peer.arg(test_support::repository("tests/peers/ocio.py"));
    peer.args([&from, &to]).arg("config").args(arguments);
    assert!(peer.status().unwrap().success(), "{arguments:?}");
    let bytes = std::fs::read(&to).unwrap();
    let value = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    let pixel = |b: &[u8]| [value(b), value(&b[4..]), value(&b[8..])];
    bytes.chunks_exact(12).map(pixel).collect()
}

/// The largest difference; relative for values above 1.
fn apart(found: &[[f32; 3]], wanted: &[[f32; 3]]) -> f32 {
    assert_eq!(found.len(), wanted.len());
    let pairs = found.iter().flatten().zip(wanted.iter().flatten());
    pairs.fold(0.0, |most, (a, b)| {
        let off = (a - b).abs() / b.abs().max(1.0);
        if off.is_nan() { f32::INFINITY } else { most.max(off) }
    })
}

/// Compares every view and every colour space with PyOpenColorIO's.
fn compare(python: &Path, path: &Path, pixels: &[[f32; 3]], looks: Option<&str>) -> f32 {
    let config = ColorConfig::open(path).unwrap();
    let names = config.names();
    let mut targets = Vec::new();
    let mut found: Vec<[f32; 3]> = Vec::new();
    let mut add = |target: String, transform: Transform| {
        let mut made = pixels.to_vec();
        transform.apply(&mut made);
        targets.push(target);
        found.extend(made);
    };
    for display in &names.displays {
        for view in &display.views {
            let transform = config.to_view(Some(&display.name), Some(view), looks).unwrap();
            add(format!("{}\t{view}", display.name), transform);
        }
    }
    for space in names.spaces.iter().filter(|space| !["numbers", "Raw"].contains(&&*space.name)) {
        add(space.name.clone(), config.to_space(&space.name, looks).unwrap());
    }
    let source = match names.working.as_str() {
        // Reached through the interchange space.
        "light" if !std::fs::read_to_string(path).unwrap().contains("lin_rec709_scene") => "",
        name => name,
    };
    let mut arguments = vec![path.to_str().unwrap(), source, looks.unwrap_or_default()];
    arguments.extend(targets.iter().map(String::as_str));
    let wanted = theirs(python, pixels, &arguments);
    for (target, (found, wanted)) in targets.iter().zip(found.chunks(pixels.len()).zip(wanted.chunks(pixels.len()))) {
        let off = apart(found, wanted);
        assert!(off < 1e-4, "{} {target}: {off}", path.display());
    }
    let most = apart(&found, &wanted);
    println!("{}: {} targets within {most:.1e}", path.display(), targets.len());
    most
}

#[test]
fn views_and_spaces_are_those_of_opencolorio_on_a_chart_and_on_a_frame() {
    let Some(python) = test_support::python(&["PyOpenColorIO"]) else { return };
    for name in BUILT_IN {
        compare(&python, Path::new(name), &chart(), None);
    }
    compare(&python, Path::new(BUILT_IN[0]), &frame().pixels, None);
    let folder = tempfile::tempdir().unwrap();
    for spaces in [ACES_CG, REC_709] {
        let path = own(folder.path(), spaces);
        for looks in [None, Some("warm"), Some("+warm, -cool")] {
            compare(&python, &path, &chart(), looks);
        }
        compare(&python, &path, &frame().pixels, None);
    }
}

/// Error of a view's table in 8-bit codes: mean, 99th percentile and maximum.
fn table_error(view: &Transform, light: &[[f32; 3]]) -> [f32; 3] {
    let table = view.table(None);
    let mut exact = light.to_vec();
    view.apply(&mut exact);
    let pairs = light.iter().zip(&exact);
    let mut off: Vec<f32> = pairs
        .map(|(light, exact)| {
            let found = table.at(*light);
            (0..3).fold(0f32, |most, c| most.max((found[c] - unit(exact[c])).abs()))
        })
        .map(|off| 255.0 * off)
        .collect();
    off.sort_by(f32::total_cmp);
    let mean = off.iter().sum::<f32>() / off.len() as f32;
    [mean, off[off.len() * 99 / 100], off[off.len() - 1]]
}

#[test]
fn a_view_of_aces_2_is_looked_through_within_a_code_of_8_bits_and_one_with_corners_within_three() {
    let folder = tempfile::tempdir().unwrap();
    let own = own(folder.path(), REC_709);
    // As when the exposure is dragged.
    let frames: Vec<[f32; 3]> = ([0.1f32, 1.0, 6.0].iter())
        .flat_map(|gain| frame().pixels.into_iter().map(move |p| p.map(|v| gain * v)))
        .map(|pixel| pixel.map(|v| v.clamp(0.0, DisplayTable::MOST)))
        .collect();
    let pure: Vec<[f32; 3]> = chart().iter().map(|p| p.map(|v| v.max(0.0))).collect();
    for path in [Path::new(BUILT_IN[0]), Path::new(BUILT_IN[2]), &own] {
        let config = ColorConfig::open(path).unwrap();
        for display in &config.names().displays {
            for name in &display.views {
                let view = config.to_view(Some(&display.name), Some(name), None).unwrap();
                let [by_frame, by_chart] = [&frames, &pure].map(|light| table_error(&view, light));
                println!("{} {name}: frame {by_frame:.2?}, chart {by_chart:.2?}", display.name);
                // ACES 1.0 clips before its displays' powers, and tables have corners: the error is larger within
                // a cell near black.
                let (mean, most) = if path == Path::new(BUILT_IN[0]) { (0.25, 1.0) } else { (0.4, 3.0) };
                assert!(by_frame[0] < mean && by_frame[1] < most, "{name}: {by_frame:?}");
                assert!(by_chart[0] < 0.5, "{name}: {by_chart:?}");
            }
        }
    }
}

#[test]
fn a_configuration_says_what_can_be_chosen() {
    let config = ColorConfig::open(Path::new("ocio://default")).unwrap();
    let names = config.names();
    let display = names.displays.iter().find(|display| display.name == "sRGB - Display").unwrap();
    assert!(display.views.iter().any(|view| view.starts_with("ACES 2.0")), "{display:?}");
    let role = names.roles.iter().find(|role| role.role == "scene_linear").unwrap();
    assert_eq!(role.space, "ACEScg");
    assert_eq!(names.working, "Linear Rec.709 (sRGB)");
    assert!(names.spaces.iter().any(|space| space.name == "ACEScg" && space.is_scene_linear));
    let folder = tempfile::tempdir().unwrap();
    let own = ColorConfig::open(&own(folder.path(), ACES_CG)).unwrap().names();
    assert_eq!((&*own.displays[0].name, &*own.displays[0].views[0]), ("Monitor", "Film"));
    assert_eq!((own.looks, &*own.working), (vec!["warm".to_owned(), "cool".to_owned()], "light"));
    let words = names.sentences();
    assert!(words.contains("scene_linear = ACEScg") && words.contains("sRGB - Display"), "{words}");
}

#[test]
fn a_configuration_that_is_long_and_says_and_often_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = own(folder.path(), REC_709);
    let text = std::fs::read_to_string(&path).unwrap();
    let mut long = text.replace("A studio's own", "Black & white, R&D, a*b, 2 * 3");
    for i in 0..500 {
        writeln!(
            long,
            "  - !<ColorSpace>\n    name: camera {i}\n    family: Sony & others\n    description: |\n      Convert S-Log & \
             S-Gamut, *not* video"
        )
        .unwrap();
    }
    std::fs::write(&path, long).unwrap();
    let names = ColorConfig::open(&path).unwrap().names();
    assert!(names.spaces.len() > 500);
    assert!(names.description.contains("R&D"));
}

#[test]
fn a_role_brings_our_light_to_its_space() {
    let folder = tempfile::tempdir().unwrap();
    for path in [PathBuf::from(BUILT_IN[0]), own(folder.path(), ACES_CG)] {
        let space = ColorConfig::open(&path).unwrap().to_space("scene_linear", None).unwrap();
        assert_eq!(space.known_space(), Some(ColorSpace::AcesCg));
        let matrix = ColorSpace::Rec709.matrix_to(ColorSpace::AcesCg);
        let mut pixels = chart();
        space.apply(&mut pixels);
        let wanted: Vec<_> = chart().iter().map(|rgb| transformed(&matrix, *rgb)).collect();
        assert!(apart(&pixels, &wanted) < 1e-4);
    }
    let path = own(folder.path(), REC_709);
    let config = ColorConfig::open(&path).unwrap();
    let kept = config.to_space("scene_linear", None).unwrap();
    assert_eq!(kept.known_space(), Some(ColorSpace::Rec709));
    assert_eq!(config.to_space("log", None).unwrap().known_space(), None);
    // The encoding is known, whatever its name.
    let views = [Some("Film"), Some("Print")].map(|view| config.to_view(None, view, None).unwrap());
    assert!(views[0].identity() != views[1].identity());
    std::fs::write(folder.path().join("luts/print.spi1d"), "Version 1\nFrom 0 1\nLength 2\nComponents 1\n{\n0\n1\n}\n")
        .unwrap();
    let other = ColorConfig::open(&path).unwrap().to_view(None, Some("Print"), None).unwrap();
    assert!(other.identity() != views[1].identity(), "a table has changed");
}

#[test]
fn hostile_light_has_codes() {
    let config = ColorConfig::open(Path::new(BUILT_IN[0])).unwrap();
    let view = config.to_view(None, None, None).unwrap();
    for value in [f32::NAN, f32::NEG_INFINITY, -1.0, 0.0, 1e30, f32::INFINITY] {
        let codes = view.encoded(&Image::filled(3, 2, [value, 0.5, 0.0]));
        let all = codes.0.pixels.iter().flatten();
        assert!(all.into_iter().all(|code| (0.0..=1.0).contains(code)), "{value}: {codes:?}");
    }
}

#[test]
fn without_a_choice_there_is_no_transform() {
    let none = ColorChoice::default();
    assert_eq!(none.transform().unwrap(), None);
    // A configuration alone changes no picture, and is not even read.
    let config = Some(PathBuf::from("gone.ocio"));
    let named = ColorChoice { config, ..none };
    assert_eq!(named.transform().unwrap(), None);
    let asked = ColorChoice { view: Some("Film".to_owned()), ..named };
    assert!(asked.transform().unwrap_err().to_string().contains("gone.ocio"));
    let both = ColorChoice { space: Some("scene_linear".to_owned()), ..asked };
    assert!(both.transform().unwrap_err().to_string().contains("both"));
}

#[test]
fn what_is_no_configuration_is_refused_with_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let refused = |path: &Path| {
        let said = ColorConfig::open(path).unwrap_err().to_string();
        let name = path.file_name().unwrap().to_str().unwrap();
        assert!(said.contains(name), "{said}");
        said
    };
    refused(&at("gone.ocio"));
    refused(folder.path());
    refused(Path::new("ocio://no-such-config"));
    std::fs::write(at("packed.ocioz"), "PK").unwrap();
    assert!(refused(&at("packed.ocioz")).contains("archive"));
    let plain = own(folder.path(), REC_709);
    let text = std::fs::read_to_string(&plain).unwrap();
    let changed = |from: &str, to: &str| text.replace(from, to);
    let broken = at("broken.ocio");
    for text in [
        String::new(),
        "\u{0}".to_owned(),
        "[".repeat(100_000),
        "{a: ".repeat(100_000),
        "- ".repeat(100_000),
        (0..2000).map(|i| format!("{}a:\n", " ".repeat(i))).collect(),
        "a: &a [x]\n".repeat(100),
        "&".repeat(4 << 20),
        // Each list contains the one before nine times.
        (0..20).map(|i| format!("k{i}: &a{i} [{}]\n", format!("*a{}, ", i.max(1) - 1).repeat(9))).collect(),
        changed("ocio_profile_version: 2.1", "ocio_profile_version: 99"),
        changed("ocio_profile_version: 2.1", ""),
        changed("!<View> {name: Film,", "!<View> {name: Film"),
        changed("roles:", "roles: ["),
        changed("slope: [1.1, 1, 0.9]", "slope: [1.1, many]"),
        text[..text.len() / 2].to_owned(),
        text.replace("aliases: [lin_rec709_scene]", "")
            .replace("aces_interchange: aces", "")
            .replace("scene_linear: light", ""),
    ] {
        std::fs::write(&broken, text).unwrap();
        refused(&broken);
    }
    std::fs::File::create(&broken).unwrap().set_len(1 << 40).unwrap();
    refused(&broken);

    let config = ColorConfig::open(&plain).unwrap();
    for (said, wanted) in [
        (config.to_view(Some("Wall"), None, None), "Monitor"),
        (config.to_view(None, Some("Video"), None), "Film, Print"),
        (config.to_view(None, None, Some("sepia")), "warm, cool"),
        (config.to_space("cineon", None), "scene_linear"),
        (config.to_space("numbers", None), "for data"),
    ] {
        let said = said.unwrap_err().to_string();
        assert!(said.contains(wanted), "{said}");
    }
    // Tables: missing, not a table, a terabyte, a device, elsewhere.
    let film = at("luts/film.cube");
    let view = || ColorConfig::open(&plain).and_then(|config| config.to_view(None, None, None));
    view().unwrap();
    std::fs::remove_file(&film).unwrap();
    assert!(view().unwrap_err().to_string().contains("film.cube"));
    std::fs::write(&film, "LUT_3D_SIZE 9\nno table\n").unwrap();
    view().unwrap_err();
    std::fs::write(&film, "LUT_3D_SIZE 4000\n0 0 0\n").unwrap();
    view().unwrap_err();
    std::fs::File::create(&film).unwrap().set_len(1 << 40).unwrap();
    assert!(view().unwrap_err().to_string().contains("1099511627776 bytes"));
    #[cfg(unix)]
    {
        std::fs::remove_file(&film).unwrap();
        std::os::unix::fs::symlink("/dev/zero", &film).unwrap();
        assert!(view().unwrap_err().to_string().contains("film.cube"));
    }
    let outside = text.replace("search_path: luts", "search_path: /etc:../../..:luts").replace("film.cube", "passwd");
    std::fs::write(&plain, outside).unwrap();
    view().unwrap_err();
    test_support::shown!(Strangers, "An OpenColorIO configuration that is broken, nested without end, or names devices as tables",
        bound: "8 MiB, 64 levels, tables of 256 MiB", measured: "refused");
}

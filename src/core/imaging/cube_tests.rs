use super::super::color::{bt1886_from_linear, srgb_from_linear};
use super::super::color_space::{ColorSpace, transformed};
use super::*;
use proptest::prelude::*;
use std::process::Command;

/// A cube of `size` entries along an axis with curved, mixed channels, and a domain.
fn bent(size: usize, domain: &str) -> String {
    let mut text = format!("TITLE \"bent\"\n# A comment\nLUT_3D_SIZE {size}\n{domain}\n");
    let at = |i: usize| i as f32 / (size - 1) as f32;
    for b in 0..size {
        for g in 0..size {
            for r in 0..size {
                let (r, g, b) = (at(r), at(g), at(b));
                text +=
                    &format!("{} {} {}\n", r.powf(0.6) * 0.9 + 0.1 * g * b, g * g + 0.05 * r, (b + 0.2 * r * g).sin());
            }
        }
    }
    text
}

fn curves(size: usize, before: &str) -> String {
    let mut text = format!("LUT_1D_SIZE {size}\n{before}\n");
    for i in 0..size {
        let x = i as f32 / (size - 1) as f32;
        text += &format!("{} {} {}\n", x.sqrt(), x * x, 1.0 - x);
    }
    text
}

/// Colours of a test chart: corners, greys, colours between, and values outside of the domain.
fn chart() -> Vec<[f32; 3]> {
    let steps = [-0.5, 0.0, 0.001, 0.02, 0.18, 0.3333, 0.5, 0.77, 1.0, 1.7, 9.0];
    let all = steps.iter().flat_map(|&r| steps.iter().map(move |&g| (r, g)));
    all.flat_map(|(r, g)| steps.iter().map(move |&b| [r, g, b])).collect()
}

#[test]
fn a_table_that_changes_nothing_changes_nothing() {
    for size in [2, 3, 17] {
        let mut text = format!("LUT_3D_SIZE {size}\r\n");
        for i in 0..size * size * size {
            let at = [i % size, i / size % size, i / size / size];
            let [r, g, b] = at.map(|v| v as f32 / (size - 1) as f32);
            text += &format!("{r} {g} {b}\r\n");
        }
        let cube = Cube::parse(&text).unwrap();
        for rgb in chart() {
            let wanted = rgb.map(|v| v.clamp(0.0, 1.0));
            let found = cube.apply(rgb);
            assert!((0..3).all(|c| (found[c] - wanted[c]).abs() < 1e-6), "{rgb:?}: {found:?}");
        }
        assert_eq!(cube.apply([f32::NAN; 3]), [0.0; 3]);
        assert_eq!(cube.apply([f32::INFINITY, f32::NEG_INFINITY, 0.0]), [1.0, 0.0, 0.0]);
    }
}

#[test]
fn a_domain_and_a_curve_before_a_cube_are_kept() {
    let cube = Cube::parse(&curves(2, "DOMAIN_MIN 0 -1 0\nDOMAIN_MAX 2 1 0.5")).unwrap();
    assert_eq!(cube.apply([1.0, 0.0, 0.25]), [0.5, 0.5, 0.5]);
    let both = "LUT_1D_SIZE 2\nLUT_1D_INPUT_RANGE 0 4\nLUT_3D_SIZE 2\nLUT_3D_INPUT_RANGE 0 1\n";
    let mut text = both.to_owned() + "0 0 0\n1 1 1\n";
    for i in 0..8 {
        text += &format!("{} {} {}\n", 1 - (i & 1), (i >> 1) & 1, i >> 2);
    }
    assert_eq!(Cube::parse(&text).unwrap().apply([1.0, 2.0, 4.0]), [0.75, 0.5, 1.0]);
}

#[test]
fn what_is_no_table_is_refused_with_its_line() {
    for (text, wanted) in [
        ("", "neither LUT_1D_SIZE nor LUT_3D_SIZE"),
        ("LUT_3D_SIZE 2\n0 0 0\n", "8 lines of values, but it has 1"),
        ("LUT_3D_SIZE 99999999999\n", "line 1: LUT_3D_SIZE"),
        ("LUT_3D_SIZE 4096\n", "2 to 129"),
        ("LUT_1D_SIZE 1\n0 0 0\n", "2 to 65536"),
        ("LUT_1D_SIZE 2\n0 0 0\n0 x 0\n", "line 3"),
        ("LUT_1D_SIZE 2\n0 0 0\n0 nan 0\n", "not finite"),
        ("LUT_1D_SIZE 2\nnan 0 0\n0 0 0\n", "not finite"),
        ("LUT_1D_SIZE 2\n0 0 0\n0 0 0 0\n", "line 3"),
        ("LUT_1D_SIZE 2\n0 0 0\nTITLE late\n1 1 1\n", "after the values"),
        ("LUT_1D_SIZE 2\nDOMAIN_MIN 1 1 1\n0 0 0\n1 1 1\n", "inputs go from"),
        ("LUT_1D_SIZE 2\nDOMAIN_MIN -3e38 0 0\nDOMAIN_MAX 3e38 1 1\n0 0 0\n1 1 1\n", "inputs go from"),
        ("<html>\n", "line 1"),
        ("WHATEVER 3\n", "unknown keyword"),
    ] {
        let said = Cube::parse(text).unwrap_err();
        assert!(said.contains(wanted), "{text:?}: {said}");
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("look.cube");
    std::fs::write(&path, [0xff, 0xfe, 0, 1]).unwrap();
    let said = Cube::read(&path).unwrap_err().to_string();
    assert!(said.contains("look.cube"), "{said}");
    std::fs::File::create(&path).unwrap().set_len(1 << 40).unwrap();
    let said = Cube::read(&path).unwrap_err().to_string();
    assert!(said.contains("look.cube"), "{said}");
    test_support::shown!(Strangers, "A .cube table whose size lies, with NaN, with text, or of a terabyte",
        bound: "tables to 65536 entries, cubes to 129, 128 MiB", measured: "refused");
}

proptest! {
    #[test]
    fn no_text_makes_it_panic(text in "(LUT_[13]D_SIZE [0-9]{1,3}\n|DOMAIN_M(IN|AX) [-0-9.e ]{0,12}\n|[-0-9.e ]{0,9}\n){0,12}") {
        if let Ok(cube) = Cube::parse(&text) {
            cube.apply([0.3, f32::NAN, 1e30]);
        }
    }

    #[test]
    fn a_cube_stays_within_its_values(rgb in proptest::array::uniform3(-1f32..2.0)) {
        let cube = Cube::parse(&bent(5, "")).unwrap();
        let values = &cube.cube.as_ref().unwrap().values;
        for (c, found) in cube.apply(rgb).into_iter().enumerate() {
            let (least, most) = values.iter().fold((f32::MAX, f32::MIN), |(a, b), v| (a.min(v[c]), b.max(v[c])));
            prop_assert!(found >= least - 1e-5 && found <= most + 1e-5);
        }
    }
}

/// OpenColorIO's output for the chart: `tests/peers/ocio.py` with its files and these `arguments`.
fn theirs(python: &Path, folder: &Path, arguments: &[&str]) -> Vec<[f32; 3]> {
    let (from, to) = (folder.join("in.f32"), folder.join("out.f32"));
    let bytes: Vec<u8> = chart().iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    std::fs::write(&from, bytes).unwrap();
    let mut peer = Command::new(python);
    peer.arg(test_support::repository("tests/peers/ocio.py"));
    peer.args([&from, &to]).args(arguments);
    assert!(peer.status().unwrap().success());
    let bytes = std::fs::read(&to).unwrap();
    let value = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    let pixel = |b: &[u8]| [value(b), value(&b[4..]), value(&b[8..])];
    bytes.chunks_exact(12).map(pixel).collect()
}

fn compare(found: impl Iterator<Item = [f32; 3]>, theirs: &[[f32; 3]], what: &str) {
    let found: Vec<_> = found.collect();
    assert_eq!(found.len(), theirs.len());
    let far = (found.iter().flatten().zip(theirs.iter().flatten()))
        .map(|(a, b)| (a - b).abs() / b.abs().max(1.0))
        .fold(0.0, f32::max);
    println!("{what}: within {far:.1e}");
    assert!(far < 1e-4, "{what}: {far}");
}

#[test]
fn tables_and_spaces_are_those_of_opencolorio() {
    let Some(python) = test_support::python(&["PyOpenColorIO"]) else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("look.cube");
    for (name, text) in [
        ("cube of 5", bent(5, "")),
        ("cube of 33", bent(33, "")),
        ("cube with a domain", bent(9, "DOMAIN_MIN -0.25 0 0.1\nDOMAIN_MAX 2 1.5 0.9")),
        ("curves", curves(19, "")),
        ("curves with a domain", curves(19, "DOMAIN_MIN -0.25 0 0.1\nDOMAIN_MAX 2 1.5 0.9")),
    ] {
        std::fs::write(&path, &text).unwrap();
        let cube = Cube::read(&path).unwrap();
        let theirs = theirs(&python, folder.path(), &["table", path.to_str().unwrap()]);
        compare(chart().into_iter().map(|rgb| cube.apply(rgb)), &theirs, name);
    }
    for (space, name) in
        [(ColorSpace::AcesCg, "ACEScg"), (ColorSpace::P3D65, "Linear P3-D65"), (ColorSpace::Rec2020, "Linear Rec.2020")]
    {
        let theirs = theirs(&python, folder.path(), &["space", name]);
        let matrix = ColorSpace::Rec709.matrix_to(space);
        compare(chart().into_iter().map(|rgb| transformed(&matrix, rgb)), &theirs, name);
    }
    // Codes exist only between 0 and 1.
    let within = |rgb: &[f32; 3]| rgb.iter().all(|v| (0.0..=1.0).contains(v));
    for (code, name) in
        [(srgb_from_linear as fn(f32) -> f32, "sRGB - Texture"), (bt1886_from_linear, "Gamma 2.4 Rec.709 - Texture")]
    {
        let theirs = theirs(&python, folder.path(), &["space", name]);
        let pairs = chart().into_iter().zip(theirs).filter(|(rgb, _)| within(rgb));
        let (chart, theirs): (Vec<_>, Vec<_>) = pairs.unzip();
        compare(chart.into_iter().map(|rgb| rgb.map(code)), &theirs, name);
    }
}

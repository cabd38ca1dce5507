use super::*;

/// A pixel as RGBE, with mantissas of 8 bits.
fn rgbe(pixel: [f32; 3]) -> [u8; 4] {
    let most = pixel.into_iter().fold(0.0, f32::max);
    if most <= 0.0 {
        return [0; 4];
    }
    let exponent = most.log2().floor() as i32 + 1;
    let [r, g, b] = pixel.map(|v| (v / 2f32.powi(exponent - 8)).min(255.0) as u8);
    [r, g, b, (exponent + 128) as u8]
}

fn decoded(code: [u8; 4]) -> [f32; 3] {
    let scale = 2f32.powi(i32::from(code[3]) - 136);
    [code[0], code[1], code[2]].map(|v| f32::from(v) * scale)
}

/// Coding of a line.
#[derive(Clone, Copy)]
enum Coding {
    Plain,
    Old,
    New,
}

fn hdr(header: &str, lines: &[Vec<[u8; 4]>], coding: Coding) -> Vec<u8> {
    let mut bytes = header.as_bytes().to_vec();
    for line in lines {
        match coding {
            Coding::Plain => bytes.extend(line.iter().flatten()),
            Coding::Old => {
                let mut x = 0;
                while x < line.len() {
                    let run = line[x..].iter().take_while(|p| **p == line[x]).count();
                    bytes.extend(line[x]);
                    if run > 1 {
                        bytes.extend([1, 1, 1, ((run - 1) & 255) as u8]);
                        if run > 256 {
                            bytes.extend([1, 1, 1, ((run - 1) >> 8) as u8]);
                        }
                    }
                    x += run;
                }
            }
            Coding::New => {
                bytes.extend([2, 2, (line.len() >> 8) as u8, line.len() as u8]);
                for c in 0..4 {
                    let mut x = 0;
                    while x < line.len() {
                        let run = line[x..].iter().take(127).take_while(|p| p[c] == line[x][c]).count();
                        if run > 2 {
                            bytes.extend([128 + run as u8, line[x][c]]);
                            x += run;
                        } else {
                            let count = (line.len() - x).min(100);
                            bytes.push(count as u8);
                            bytes.extend(line[x..x + count].iter().map(|p| p[c]));
                            x += count;
                        }
                    }
                }
            }
        }
    }
    bytes
}

const HEADER: &str = "#?RADIANCE\n# a comment\nFORMAT=32-bit_rle_rgbe\n\n";

#[test]
fn the_eight_orientations_of_radiance_are_one_picture() {
    let folder = Folder::new();
    let (w, h) = (24, 12);
    let codes = Image::from_fn(w, h, |x, y| decoded(rgbe(picture(w, h).at(x, y))));
    let code = |x: usize, y: usize| rgbe(picture(w, h).at(x, y));
    for first in ["-Y", "+Y", "-X", "+X"] {
        for second in ["-Y", "+Y", "-X", "+X"] {
            if first[1..] == second[1..] {
                continue;
            }
            let columns = first.ends_with('X');
            let (x_sign, y_sign) = if columns { (first, second) } else { (second, first) };
            let (lines, length) = if columns { (w, h) } else { (h, w) };
            let at = |i: usize, j: usize| {
                let (x, y) = if columns { (i, j) } else { (j, i) };
                // +X goes right and +Y goes up.
                code(if x_sign == "+X" { x } else { w - 1 - x }, if y_sign == "-Y" { y } else { h - 1 - y })
            };
            let data: Vec<Vec<_>> = (0..lines).map(|i| (0..length).map(|j| at(i, j)).collect()).collect();
            for coding in [Coding::Plain, Coding::Old, Coding::New] {
                let header = format!("{HEADER}{first} {lines} {second} {length}\n");
                let path = folder.write("o.hdr", &hdr(&header, &data, coding));
                let read = read_all(&path);
                assert_eq!(read.environment.radiance, codes, "{first} {second}");
                assert!(read.notes.is_empty(), "{:?}", read.notes);
            }
        }
    }
}

#[test]
fn long_runs_of_the_old_coding_are_read() {
    let folder = Folder::new();
    let lines = vec![vec![[128, 64, 32, 129]; 1400]; 2];
    let path = folder.write("old.hdr", &hdr(&format!("{HEADER}-Y 2 +X 1400\n"), &lines, Coding::Old));
    let reading = ReadSettings { mapping: Some(Mapping::LatLong), ..ReadSettings::default() };
    let image = read(&path, &reading).unwrap().environment.radiance;
    assert!(image.pixels.iter().all(|p| *p == [1.0, 0.5, 0.25]));
}

#[test]
fn xyz_exposure_and_colour_correction_are_taken_out() {
    let folder = Folder::new();
    // D65 white. The header says that the exposure was doubled and red halved after it.
    let lines = vec![vec![[243, 255, 255, 128]; 16]; 8];
    let path = folder.write("xyz.hdr", &hdr("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 8 +X 16\n", &lines, Coding::New));
    let [r, g, b] = read_all(&path).environment.radiance.pixels[0];
    assert!((r - 1.01).abs() < 0.05 && (g - 1.0).abs() < 0.02 && (b - 0.94).abs() < 0.05, "{r} {g} {b}");
    let header =
        "#?RGBE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\nEXPOSURE= 0.5\nEXPOSURE=4\nCOLORCORR=2 1 1\n\n-Y 8 +X 16\n";
    let lines = vec![vec![[128, 128, 128, 131]; 16]; 8];
    let path = folder.write("gain.hdr", &hdr(header, &lines, Coding::New));
    assert_eq!(read_all(&path).environment.radiance.pixels[0], [0.5, 1.0, 1.0]);
}

#[test]
fn broken_files_say_what_is_wrong() {
    let folder = Folder::new();
    let lines = vec![vec![[128, 128, 128, 129]; 16]; 8];
    let whole = hdr(&format!("{HEADER}-Y 8 +X 16\n"), &lines, Coding::New);
    let mut bad_run = whole.clone();
    let at = whole.len() - 2;
    bad_run[at] = 255;
    for (bytes, says) in [
        (whole[..whole.len() - 3].to_vec(), "line 8 of 8"),
        (whole[..20].to_vec(), "header"),
        (bad_run, "run of"),
        (format!("{HEADER}-Y 8 +Z 16\n").into_bytes(), "-Y 512 +X 1024"),
        (format!("{HEADER}-Y 0 +X 16\n").into_bytes(), "0"),
        (format!("{HEADER}-Y 99999999 +X 99999999\n").into_bytes(), "99999999 × 99999999"),
        // Small files that declare a huge size: nothing is allocated for them.
        (format!("{HEADER}-Y 32768 +X 65536\n").into_bytes(), "line 1 of 32768"),
        (format!("{HEADER}-Y 1000000 +X 4096\n").into_bytes(), "needs 4096 × 1000000 in memory"),
        (b"#?RADIANCE\nFORMAT=32-bit_other\n\n-Y 1 +X 2\n".to_vec(), "32-bit_other"),
        (b"no picture at all".to_vec(), "unknown format"),
        (Vec::new(), "unknown format"),
        (b"\x76\x2f\x31\x01 nor this".to_vec(), "sphere.hdr"),
    ] {
        let path = folder.write("sphere.hdr", &bytes);
        let error = super::read(&path, &ReadSettings::default()).unwrap_err().to_string();
        assert!(error.contains(says) && error.contains("sphere.hdr"), "{error} lacks {says}");
    }
    assert!(read(&folder.0.path().join("none.hdr"), &ReadSettings::default()).is_err());
}

#[test]
fn a_panorama_of_8192_columns_is_read_line_by_line() {
    let folder = Folder::new();
    let (w, h) = (8192, 4096);
    let mut bytes = format!("{HEADER}-Y {h} +X {w}\n").into_bytes();
    let line = hdr("", &[(0..w).map(|x| [128, 64, (x / 64) as u8, 129]).collect()], Coding::New);
    (0..h).for_each(|_| bytes.extend(&line));
    let path = folder.write("large.hdr", &bytes);
    let read = read(&path, &ReadSettings { width: 512, mapping: None }).unwrap();
    assert_eq!(read.environment.radiance.size(), (512, 256));
    let sphere = 4.0 * std::f64::consts::PI;
    // Every blue code from 0 to 127 sixty-four times a line: 63.5/128 on average.
    for (is, wanted) in read.environment.energy().into_iter().zip([1.0, 0.5, 63.5 / 128.0]) {
        assert!((is / sphere - wanted).abs() < 1e-5, "{is} for {wanted}");
    }
}

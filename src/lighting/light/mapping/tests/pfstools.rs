//! Comparison with `pfspanoramic` of pfstools, if installed.

use super::*;
use std::io::Write;
use std::path::Path;
use std::process::Command;

/// Portable float map: a header, then rows of little-endian floats from the bottom up.
fn write_pfm(path: &Path, image: &Image) {
    let mut file = std::io::BufWriter::new(std::fs::File::create(path).unwrap());
    write!(file, "PF\n{} {}\n-1.0\n", image.width, image.height).unwrap();
    for row in image.pixels.chunks(image.width).rev() {
        for value in row.iter().flatten() {
            file.write_all(&value.to_le_bytes()).unwrap();
        }
    }
}

fn read_pfm(path: &Path) -> Image {
    let bytes = std::fs::read(path).unwrap();
    let mut fields = Vec::new();
    let mut start = 0;
    while fields.len() < 4 {
        let end = start + bytes[start..].iter().position(u8::is_ascii_whitespace).unwrap();
        fields.push(String::from_utf8(bytes[start..end].to_vec()).unwrap());
        start = end + 1;
    }
    assert_eq!(fields[0], "PF");
    let (width, height) = (fields[1].parse().unwrap(), fields[2].parse().unwrap());
    assert!(fields[3].parse::<f32>().unwrap() < 0.0, "big-endian");
    let values: Vec<f32> =
        bytes[start..].chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    Image::from_fn(width, height, |x, y| {
        let first = 3 * ((height - 1 - y) * width + x);
        [values[first], values[first + 1], values[first + 2]]
    })
}

/// Picture converted by pfspanoramic; `None` if it fails (at some sizes it reads a pixel beyond the last one and
/// aborts).
fn pfspanoramic(image: &Image, from: &str, to: &str, width: usize) -> Option<Image> {
    let folder = tempfile::tempdir().unwrap();
    let (a, b) = (folder.path().join("a.pfm"), folder.path().join("b.pfm"));
    write_pfm(&a, image);
    let pipe = "pfsinpfm \"$1\" | pfspanoramic \"$3\" -i -o $5 -w \"$4\" | pfsoutpfm \"$2\"";
    ["3", "2", "1"].into_iter().find_map(|samples| {
        Command::new("sh")
            .args(["-c", pipe, "sh"])
            .args([a.as_os_str(), b.as_os_str()])
            .args([format!("{from}+{to}"), width.to_string()])
            .arg(samples)
            .output()
            .unwrap();
        b.exists().then(|| read_pfm(&b))
    })
}

/// A lat-long with u' = 3/2 − u (mod 1).
fn mirrored(image: &Image) -> Image {
    let width = image.width;
    Image::from_fn(width, image.height, |x, y| image.at((width / 2 + width - 1 - x) % width, y))
}

#[test]
fn pictures_agree_with_those_of_pfspanoramic() {
    if !test_support::pfspanoramic() {
        return;
    }
    let facts = |mapping| match mapping {
        Mapping::LatLong => ("polar", (256, 128)),
        Mapping::Angular => ("angular", (190, 190)),
        _ => ("mirrorball", (190, 190)),
    };
    let mut agreed = 0;
    use Mapping::{Angular, LatLong, MirrorBall};
    for (from, to) in [(LatLong, Angular), (Angular, LatLong), (MirrorBall, LatLong), (LatLong, MirrorBall)] {
        let ((from_name, from_size), (to_name, to_size)) = (facts(from), facts(to));
        // pfspanoramic's mirror ball is a view from inside (see the module's documentation): its lat-long has u' =
        // 3/2 − u, that is −z for z.
        let flip = DVec3::new(1.0, 1.0, -1.0);
        let flips_back = (from, to) == (MirrorBall, LatLong);
        let its_sky = |d: DVec3| match (from, to) {
            (LatLong, MirrorBall) => sky(d * flip),
            _ => sky(d),
        };
        // It places a pixel's value at the pixel's top left corner.
        let given = drawn(from, from_size, -0.5, its_sky);
        let Some(theirs) = pfspanoramic(&given, from_name, to_name, to_size.0) else {
            eprintln!("pfspanoramic fails at {from_name} → {to_name}");
            continue;
        };
        let theirs = if flips_back { mirrored(&theirs) } else { theirs };
        let ours = convert(&painted(from, from_size), from, to, to_size).unwrap().image;
        assert_eq!(theirs.size(), to_size);
        let (psnr, worst) = compared(&ours, &theirs, to, clear_of_the_rim(from, 128));
        println!("{from_name} → {to_name}: {psnr:.1} dB, worst {worst:.4}");
        assert!(psnr > 50.0, "{from_name} → {to_name}: {psnr:.1} dB");
        agreed += 1;
    }
    assert!(agreed >= 3);
}

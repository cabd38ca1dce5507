//! Radiance HDR line by line: G. Ward, "Real Pixels" (Graphics Gems II, 1991) and the Radiance file formats
//! (radsite.lbl.gov/radiance/refer/filefmts.pdf). The `image` crate reads one of the eight orientations, no XYZE,
//! no primaries, and all of a file at once.

use super::properties::{About, Coding, Origin, Sink};
use super::source::{REMEDY, Source};
use crate::color::linear_from_xyz;
use crate::color_space::{Matrix, Primaries, transformed};
use base::error::{Error, Result};
use std::io::{BufRead, Read};

pub(super) fn stream(mut source: Source, sink: &mut dyn Sink) -> Result<()> {
    let header = Header::read(&mut source)?;
    let Layout { columns, flip_x, flip_y, size: (width, height) } = header.layout;
    let mut notes = Vec::new();
    if header.matrix.is_some() {
        notes.push("Brought from the primaries in its header to Rec. 709.".to_owned());
    }
    let about = About {
        size: (width, height),
        format: "Radiance HDR",
        coding: Coding::Light(header.origin()),
        has_alpha: false,
        bits: 8,
        layer: None,
        turned_by: None,
        is_converted: header.xyz || header.matrix.is_some(),
        is_whole: true,
        notes,
    };
    if !sink.begin(&about)? {
        return Ok(());
    }
    let (lines, length) = if columns { (width, height) } else { (height, width) };
    let mut codes = vec![[0u8; 4]; length];
    let mut line = vec![[0.0f32; 3]; length];
    for i in 0..lines {
        read_line(&mut source.file, &mut codes)
            .map_err(|cause| source.broken(format!("{cause}, in line {} of {lines}", i + 1)))?;
        for (texel, &code) in line.iter_mut().zip(&codes) {
            *texel = header.light(code);
        }
        if columns {
            let x = if flip_x { width - 1 - i } else { i };
            for (j, texel) in line.iter().enumerate() {
                let y = if flip_y { height - 1 - j } else { j };
                sink.run(x, y, std::slice::from_ref(texel), &[]);
            }
        } else {
            if flip_x {
                line.reverse();
            }
            sink.run(0, if flip_y { height - 1 - i } else { i }, &line, &[]);
        }
    }
    Ok(())
}

/// Layout of lines in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Layout {
    /// Lines are columns.
    columns: bool,
    /// From right to left.
    flip_x: bool,
    /// From the bottom up.
    flip_y: bool,
    size: (usize, usize),
}

impl Layout {
    /// From a line such as `-Y 512 +X 1024`: the first axis is the one from line to line, and the file's Y
    /// goes up.
    fn parse(line: &str) -> Option<Self> {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let [first, a, second, b] = words[..] else { return None };
        let (a, b) = (a.parse().ok()?, b.parse().ok()?);
        let (columns, x, y, size) = match (first, second) {
            ("-Y" | "+Y", "-X" | "+X") => (false, second, first, (b, a)),
            ("-X" | "+X", "-Y" | "+Y") => (true, first, second, (a, b)),
            _ => return None,
        };
        Some(Self { columns, flip_x: x == "-X", flip_y: y == "+Y", size })
    }
}

struct Header {
    layout: Layout,
    xyz: bool,
    /// Primaries of RGB, if the header has any.
    primaries: Option<Primaries>,
    /// From those to Rec. 709, if they are others.
    matrix: Option<Matrix>,
    /// The factor for values: the reciprocal of the exposure and colour correction in the header.
    gain: [f32; 3],
}

impl Header {
    fn read(source: &mut Source) -> Result<Self> {
        let mut xyz = false;
        let mut gain = [1.0f64; 3];
        let mut primaries = None;
        loop {
            let line = header_line(source)?;
            if line.is_empty() {
                break;
            }
            let Some((key, value)) = line.split_once('=') else { continue };
            let numbers: Vec<f64> = value.split_ascii_whitespace().filter_map(|word| word.parse().ok()).collect();
            let usable = numbers.iter().all(|v| v.is_finite() && *v > 0.0);
            match (key.trim(), &numbers[..]) {
                ("FORMAT", _) => match value.trim() {
                    "32-bit_rle_rgbe" => xyz = false,
                    "32-bit_rle_xyze" => xyz = true,
                    other => {
                        return Err(Error::invalid(
                            format!(
                                "{} has the format {other}, not 32-bit_rle_rgbe or 32-bit_rle_xyze",
                                source.path.display()
                            ),
                            "Write it again as Radiance HDR or OpenEXR",
                        ));
                    }
                },
                // Each of these may stand several times; they multiply.
                ("EXPOSURE", [all]) if usable => gain.iter_mut().for_each(|v| *v /= all),
                ("COLORCORR", [r, g, b]) if usable => {
                    gain.iter_mut().zip([r, g, b]).for_each(|(v, by)| *v /= by);
                }
                ("PRIMARIES", &[rx, ry, gx, gy, bx, by, wx, wy]) => {
                    let (red, green) = ([rx, ry], [gx, gy]);
                    primaries = Some(Primaries { red, green, blue: [bx, by], white: [wx, wy] });
                }
                _ => {}
            }
        }
        let line = header_line(source)?;
        let layout = Layout::parse(&line).ok_or_else(|| {
            Error::invalid(
                format!("{} has no size such as -Y 512 +X 1024 after its header, but {line:?}", source.path.display()),
                REMEDY,
            )
        })?;
        let gain = gain.map(|v| v as f32);
        let gain = if gain.iter().all(|v| v.is_normal()) { gain } else { [1.0; 3] };
        let primaries = primaries.filter(|p| !xyz && p.is_usable());
        let matrix = primaries.and_then(Primaries::to_rec709);
        Ok(Self { layout, xyz, primaries, matrix, gain })
    }

    fn origin(&self) -> Option<Origin> {
        let origin = |name: &str, by| Origin { name: name.to_owned(), by };
        if self.xyz {
            return Some(origin("CIE XYZ", "its FORMAT"));
        }
        self.primaries.map(|primaries| origin(primaries.name(), "its PRIMARIES"))
    }

    fn light(&self, [r, g, b, e]: [u8; 4]) -> [f32; 3] {
        if e == 0 {
            return [0.0; 3];
        }
        let scale = 2f64.powi(i32::from(e) - 136) as f32;
        let value = [r, g, b].map(|v| f32::from(v) * scale);
        let value = if self.xyz {
            // XYZ holds colours outside of Rec. 709, which have negative channels there.
            linear_from_xyz(value).map(|v| v.max(0.0))
        } else {
            self.matrix.as_ref().map_or(value, |matrix| transformed(matrix, value))
        };
        [0, 1, 2].map(|c| value[c] * self.gain[c])
    }
}

/// A line of the header without its line end. Header lines are short, so a very long one is not a header.
fn header_line(source: &mut Source) -> Result<String> {
    const LONGEST: u64 = 1 << 16;
    let mut line = Vec::new();
    let read = (&mut source.file).take(LONGEST).read_until(b'\n', &mut line);
    let count = read.map_err(|e| source.broken(e))?;
    if count == 0 || line.pop() != Some(b'\n') {
        return Err(source.broken("the file ends inside its header"));
    }
    Ok(String::from_utf8_lossy(&line).trim_end().to_string())
}

/// Reads a line: run-length coded by channel (new), by pixel (old), or plain.
fn read_line(file: &mut impl BufRead, line: &mut [[u8; 4]]) -> std::result::Result<(), String> {
    let ends = |_| "the file ends".to_string();
    let mut pixel = [0; 4];
    file.read_exact(&mut pixel).map_err(ends)?;
    let length = line.len();
    let [a, b, high, low] = pixel;
    let by_channel =
        (8..0x8000).contains(&length) && (a, b) == (2, 2) && usize::from(high) << 8 | usize::from(low) == length;
    if by_channel {
        let mut run = [0; 128];
        for c in 0..4 {
            let mut x = 0;
            while x < length {
                file.read_exact(&mut run[..1]).map_err(ends)?;
                let (count, bytes) = match usize::from(run[0]) {
                    0 => return Err("a run of no pixels".into()),
                    count @ 1..=128 => (count, count),
                    count => (count - 128, 1),
                };
                if x + count > length {
                    return Err(format!("a run of {count} pixels where {} are left", length - x));
                }
                file.read_exact(&mut run[..bytes]).map_err(ends)?;
                for (i, pixel) in line[x..x + count].iter_mut().enumerate() {
                    pixel[c] = run[if bytes == 1 { 0 } else { i }];
                }
                x += count;
            }
        }
        return Ok(());
    }
    let (mut x, mut shift) = (0, 0);
    loop {
        if pixel[..3] == [1, 1, 1] && x > 0 {
            // (1, 1, 1, n) repeats the pixel before it; several in a row are the bytes of one count.
            let count = usize::from(pixel[3]).checked_shl(shift).unwrap_or(usize::MAX);
            if shift > 24 || count > length - x {
                return Err(format!("a run of {count} pixels where {} are left", length - x));
            }
            let repeated = line[x - 1];
            line[x..x + count].fill(repeated);
            x += count;
            shift += 8;
        } else {
            line[x] = pixel;
            x += 1;
            shift = 0;
        }
        if x == length {
            return Ok(());
        }
        file.read_exact(&mut pixel).map_err(ends)?;
    }
}

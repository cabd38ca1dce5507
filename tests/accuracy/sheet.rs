//! Sheet of a shoot: the truth, the network and the methods side by side, on the same frames, in the same light.

use crate::methods::{LIMIT, Scored};
use base::Result;
use base::files::write_beside;
use export::{Tile, contact_sheet};
use imaging::file::{jpeg_bytes, read_encoded};
use imaging::resample::resize;
use imaging::{Encoded, Raster};
use serde_json::Value;
use std::io::Write;
use std::path::Path;

/// Longer side of a picture on the sheet, in pixels.
const SIDE: usize = 152;
/// Size limit of a sheet in bytes.
const MOST_BYTES: usize = 390_000;
/// Frame around the best picture: its width in pixels, and its codes.
const FRAME: usize = 3;
const AMBER: [f32; 3] = [1.0, 0.72, 0.2];
/// Factor on differences.
const GAIN: f32 = 4.0;
/// Exponent that encodes the pictures.
const GAMMA: f32 = 2.2;

/// A row of pictures: a frame in a light.
pub struct Row {
    light: Light,
    frame: u64,
}

enum Light {
    Environment(String),
    /// Lamp, from 0.
    Olat(usize),
}

/// Writes a sheet of the chosen rows as a JPEG. Under each picture is its difference from the truth, and the best is
/// framed. Returns false without a row: nothing is written.
///
/// # Errors
/// When a picture is missing, or the file cannot be written.
pub fn write(path: &Path, methods: &[&Scored], rows: fn(&[&Value]) -> Vec<Row>) -> Result<bool> {
    let mut tiles: Vec<(String, Encoded)> = Vec::new();
    let all: Vec<&Value> = methods.iter().map(|of| &of.kept.result).collect();
    let rows = rows(&all);
    let Some(network) = methods.first().filter(|_| !rows.is_empty()) else { return Ok(false) };
    for row in rows {
        let light = match &row.light {
            Light::Environment(name) => name.clone(),
            Light::Olat(lamp) => format!("olat-{lamp}"),
        };
        let file = |of: &Scored, end: &str| read_encoded(&of.pictures.join(format!("{light}-{}{end}.png", row.frame)));
        let truth = file(network, "-truth")?;
        let reached: Vec<Option<f64>> = methods.iter().map(|of| row.decibels(of)).collect();
        let best = best(methods, &reached);
        let place = format!("{} frame {}", light.replace('-', " "), row.frame);
        tiles.push((place, small(&truth)));
        let mut differences = vec![("difference x 4".to_owned(), small_difference(&truth, &truth))];
        for (number, of) in methods.iter().enumerate() {
            let picture = file(of, "")?;
            let mut shown = small(&picture);
            let mut label = of.method.replace('-', " ");
            if let Some(decibels) = reached[number] {
                label += &format!(" {}", words(decibels));
            }
            if best == Some(number) {
                framed(&mut shown);
                label += " best";
            }
            tiles.push((label, shown));
            differences.push((String::new(), small_difference(&picture, &truth)));
        }
        tiles.extend(differences);
    }
    let tiles: Vec<Tile> = (tiles.iter()).map(|(label, picture)| Tile { label, picture }).collect();
    let sheet = contact_sheet(&tiles, methods.len() + 1)?;
    // The best quality that fits the size limit.
    let mut bytes = Vec::new();
    for quality in (40..=92).rev().step_by(4) {
        bytes = jpeg_bytes(&sheet, quality)?;
        if bytes.len() <= MOST_BYTES {
            break;
        }
    }
    write_beside(path, |out| out.write_all(&bytes))?;
    Ok(true)
}

/// A frame of which all methods have OLATs, under the lamps with the first method's lowest PSNR, its lower quartile and
/// its median.
pub fn olat_rows(methods: &[&Value]) -> Vec<Row> {
    let decibels = |scores: &Value, frame: &str| scores["olat_psnr_by_lamp_db"][frame].clone();
    let Some(first) = methods.first() else { return Vec::new() };
    let frames = first["olat_psnr_by_lamp_db"].as_object().into_iter().flatten();
    let mut common = frames.filter(|(frame, _)| methods.iter().all(|scores| decibels(scores, frame).is_array()));
    let Some((frame, lamps)) = common.next() else { return Vec::new() };
    let Ok(frame) = frame.parse() else { return Vec::new() };
    let reached = lamps.as_array().into_iter().flatten().filter_map(Value::as_f64);
    let mut reached: Vec<(usize, f64)> = reached.enumerate().collect();
    reached.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut places = vec![0, reached.len() / 4, reached.len() / 2];
    places.dedup();
    let lamps = places.into_iter().filter_map(|place| reached.get(place));
    lamps.map(|&(lamp, _)| Row { light: Light::Olat(lamp), frame }).collect()
}

/// Frames to show, out of those that all methods have: in each light the first method's best and worst.
pub fn relit_rows(methods: &[&Value]) -> Vec<Row> {
    let frames_of = |scores: &Value| -> Vec<u64> {
        let frames = scores["frames"].as_array().into_iter().flatten();
        frames.filter_map(Value::as_u64).collect()
    };
    let Some(network) = methods.first() else { return Vec::new() };
    let frames = frames_of(network);
    // The limit exists only for frames with true OLATs.
    let others: Vec<Vec<u64>> = methods.iter().map(|scores| frames_of(scores)).collect();
    let is_common = |frame: &u64| others.iter().all(|frames| frames.contains(frame));
    let mut rows = Vec::new();
    for (environment, by_frame) in network["relit_psnr_by_frame_db"].as_object().into_iter().flatten() {
        let by_frame = by_frame.as_array().into_iter().flatten();
        let mut reached: Vec<(f64, u64)> = by_frame
            .filter_map(Value::as_f64)
            .zip(frames.iter().copied())
            .filter(|(_, frame)| is_common(frame))
            .collect();
        reached.sort_by(|a, b| b.0.total_cmp(&a.0));
        let ends = [reached.first(), reached.last().filter(|_| reached.len() > 1)];
        rows.extend(
            ends.into_iter()
                .flatten()
                .map(|(_, frame)| Row { light: Light::Environment(environment.clone()), frame: *frame }),
        );
    }
    rows
}

impl Row {
    /// PSNR of a method for this row.
    fn decibels(&self, of: &Scored) -> Option<f64> {
        let scores = &of.kept.result;
        let environment = match &self.light {
            Light::Environment(name) => name,
            Light::Olat(lamp) => {
                return scores["olat_psnr_by_lamp_db"][self.frame.to_string()][lamp].as_f64();
            }
        };
        let frames = scores["frames"].as_array()?;
        let place = frames.iter().position(|frame| frame.as_u64() == Some(self.frame))?;
        scores["relit_psnr_by_frame_db"][environment][place].as_f64()
    }
}

/// The method closest to the truth; the rig's limit does not count.
fn best(methods: &[&Scored], reached: &[Option<f64>]) -> Option<usize> {
    let comparable = (methods.iter().zip(reached).enumerate())
        .filter(|(_, (of, _))| of.method != LIMIT)
        .filter_map(|(number, (_, decibels))| Some((number, (*decibels)?)));
    let best = comparable.max_by(|a, b| a.1.total_cmp(&b.1));
    best.map(|(number, _)| number)
}

/// Decibels for a label.
fn words(decibels: f64) -> String {
    if decibels >= evaluation::metrics::MAX_DECIBELS { "exact".to_owned() } else { format!("{decibels:.1} db") }
}

/// A picture at the sheet's size. Averages light, not codes.
fn small(picture: &Encoded) -> Encoded {
    let linear = picture.0.map(|pixel| pixel.map(|code| code.powf(GAMMA)));
    let (width, height) = size_of(&picture.0);
    let small = resize(&linear, width, height);
    Encoded(small.map(|pixel| pixel.map(|value| value.max(0.0).powf(1.0 / GAMMA))))
}

/// Width and height at which the longer side is the sheet's.
fn size_of(picture: &Raster<[f32; 3]>) -> (usize, usize) {
    let longer = picture.width.max(picture.height).max(1);
    let side = |pixels: usize| (pixels * SIDE / longer).max(1);
    (side(picture.width), side(picture.height))
}

/// The amplified difference of codes, about a middle grey.
fn small_difference(picture: &Encoded, truth: &Encoded) -> Encoded {
    let mut difference = picture.0.clone();
    for (pixel, truth) in difference.pixels.iter_mut().zip(&truth.0.pixels) {
        *pixel = std::array::from_fn(|c| (0.5 + GAIN * (pixel[c] - truth[c])).clamp(0.0, 1.0));
    }
    let (width, height) = size_of(&difference);
    Encoded(resize(&difference, width, height))
}

/// Draws a frame inside a picture's border.
fn framed(picture: &mut Encoded) {
    let (width, height) = picture.0.size();
    for (place, pixel) in picture.0.pixels.iter_mut().enumerate() {
        let (x, y) = (place % width, place / width);
        let from_border = x.min(y).min(width - 1 - x).min(height - 1 - y);
        if from_border < FRAME {
            *pixel = AMBER;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kept::Kept;
    use imaging::file::write_png;
    use serde_json::json;

    #[test]
    fn olats_are_shown_under_the_worst_lamp_that_of_the_lower_quartile_and_of_the_median() {
        let first = json!({"olat_psnr_by_lamp_db": {"3": [30.0], "8": [31.0, 25.0, 33.0, 29.0]}});
        let other = json!({"olat_psnr_by_lamp_db": {"8": [20.0, 21.0, 22.0, 23.0]}});
        let shown = olat_rows(&[&first, &other]);
        let lamps: Vec<(usize, u64)> = (shown.iter())
            .map(|row| match row.light {
                Light::Olat(lamp) => (lamp, row.frame),
                Light::Environment(_) => panic!("not an OLAT"),
            })
            .collect();
        assert_eq!(lamps, [(1, 8), (3, 8), (0, 8)]);
        assert!(olat_rows(&[&first, &json!({})]).is_empty());
    }

    #[test]
    fn a_sheet_shows_every_method_and_frames_the_best() -> Result<()> {
        let folder = tempfile::tempdir().unwrap();
        let method = |name: &'static str, decibels: [f64; 2], code: f32| {
            let pictures = folder.path().join(name);
            std::fs::create_dir_all(&pictures).unwrap();
            let picture = |code| Encoded(Raster::filled(64, 48, [code; 3]));
            for frame in [3, 8] {
                write_png(&pictures.join(format!("nave-{frame}.png")), &picture(code)).unwrap();
                let truth = pictures.join(format!("nave-{frame}-truth.png"));
                write_png(&truth, &picture(0.6)).unwrap();
            }
            let result = json!({"frames": [3, 8], "relit_psnr_by_frame_db": {"nave": decibels}});
            Scored { method: name, learnt: None, kept: Kept { build: String::new(), result }, pictures }
        };
        let all = [
            method("network", [30.0, 20.0], 0.5),
            method("ratio", [25.0, 22.0], 0.4),
            method("truth-olats", [40.0, 40.0], 0.6),
        ];
        let results: Vec<&Value> = all.iter().map(|of| &of.kept.result).collect();
        let found: Vec<u64> = relit_rows(&results).iter().map(|row| row.frame).collect();
        assert_eq!(found, [3, 8]);
        // A frame that one method lacks is not shown.
        let fewer = json!({"frames": [8]});
        let shown = relit_rows(&[results[0], &fewer]);
        assert_eq!(shown.iter().map(|row| row.frame).collect::<Vec<_>>(), [8]);
        let all: Vec<&Scored> = all.iter().collect();
        let path = folder.path().join("sheet.jpg");
        assert!(write(&path, &all, relit_rows)?);
        assert!(!write(&path, &all, olat_rows)?);
        let bytes = std::fs::metadata(&path).unwrap().len();
        assert!(bytes > 1000 && bytes <= MOST_BYTES as u64, "{bytes}");
        let sheet = read_encoded(&path)?.0;
        // The amber frame is around the network's first picture and the ratio's second. Tiles are four pixels apart.
        let amber = |tile: usize, y: usize| {
            let pixel = sheet.at(4 + tile * (SIDE + 4) + 1, y);
            pixel[0] > 0.8 && pixel[2] < 0.5
        };
        let middle = 4 + SIDE * 48 / 64 / 2;
        let found = [1, 2, 3].map(|tile| amber(tile, middle));
        assert_eq!(found, [true, false, false]);
        let second = middle + (sheet.height - 4) / 2;
        let found = [1, 2, 3].map(|tile| amber(tile, second));
        assert_eq!(found, [false, true, false]);
        Ok(())
    }
}

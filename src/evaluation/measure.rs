//! One evaluation from a project and a truth to figures, a table and a contact sheet.

use super::{Method, Row, Scores, Truth, excluded_check, markdown, score};
use crate::calibration::Calibration;
use crate::compositor::reference::{extend_edges, view};
use crate::error::{Error, Result};
use crate::export::{Tile, contact_sheet};
use crate::footage::Frame;
use crate::gpu::{ComputeDevice, DeviceChoice};
use crate::imaging::file::{write_beside, write_png};
use crate::imaging::{Encoded, Image, Mask, color::luminance};
use crate::progress::Progress;
use crate::project::Project;
use crate::reflectance::Predictor;
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

/// What a person asks for.
#[derive(Clone, Debug, PartialEq)]
pub struct EvaluateSettings {
    /// A folder with truth, see [`Truth::open`].
    pub truth: PathBuf,
    pub method: Method,
    /// A Markdown file whose section for this shoot is written anew, with all methods.
    pub table: Option<PathBuf>,
    /// A contact sheet of predicted beside true OLATs.
    pub sheet: Option<PathBuf>,
    pub device: DeviceChoice,
}

/// The figures.
#[derive(Clone, Debug, Serialize)]
pub struct EvaluateReport {
    #[serde(flatten)]
    pub scores: Scores,
    /// Steps and seconds of training of the network that was judged.
    pub training_steps: Option<u64>,
    pub training_seconds: Option<f64>,
}

/// Measures `settings.method`, and all methods where a table is asked for.
///
/// # Errors
/// When something is missing, or the network was trained on a frame of the truth.
pub fn evaluate(
    project: &Project,
    settings: &EvaluateSettings,
    progress: &Progress,
) -> Result<EvaluateReport> {
    let calibration = Calibration::load(project)?;
    let truth = Truth::open(project, &settings.truth)?;
    let compute = ComputeDevice::choose(settings.device);
    let asks_network =
        settings.method == Method::Network || settings.table.is_some() || settings.sheet.is_some();
    let predictor = if asks_network {
        let predictor = Predictor::open(project, &compute.device)?;
        excluded_check(&predictor.info().training_frames, &truth.frames)?;
        Some(predictor)
    } else {
        None
    };
    let mut scores_of = |method: Method| {
        let mut predict = |frame: &Frame| match &predictor {
            Some(predictor) => predictor.predict(frame),
            None => Predictor::open(project, &compute.device)?.predict(frame),
        };
        score(
            project,
            &calibration,
            &truth,
            method,
            &mut predict,
            progress,
        )
    };
    let scores = scores_of(settings.method)?;
    if let (Some(path), Some(predictor)) = (&settings.table, &predictor) {
        let methods = [
            Method::Nearest,
            Method::Ratio,
            Method::Network,
            Method::TruthOlats,
        ];
        let all = methods
            .map(&mut scores_of)
            .into_iter()
            .collect::<Result<Vec<_>>>()?;
        let info = predictor.info();
        let trained = format!(
            "{:.1} min of training, {} steps, {}",
            info.seconds / 60.0,
            info.step,
            compute.description
        );
        let rows: Vec<Row> = all.iter().map(|scores| row(scores, &trained)).collect();
        let size = project.settings.size;
        let title = format!("{} at {size} × {size}", project.settings.name);
        write_section(path, &title, &markdown(&rows))?;
    }
    if let (Some(path), Some(predictor)) = (&settings.sheet, &predictor) {
        write_png(path, &sheet(project, &calibration, &truth, predictor)?)?;
    }
    let info = predictor
        .as_ref()
        .filter(|_| settings.method == Method::Network)
        .map(|p| p.info().clone());
    Ok(EvaluateReport {
        scores,
        training_steps: info.as_ref().map(|i| i.step),
        training_seconds: info.map(|i| i.seconds),
    })
}

fn row<'a>(scores: &'a Scores, trained: &'a str) -> Row<'a> {
    let (name, cost) = match scores.method {
        Method::Nearest => ("nearest exemplar pose", "none"),
        Method::Ratio => ("ratio image", "none"),
        Method::Network => ("**network**", trained),
        Method::TruthOlats => ("true OLATs: the rig's limit", "not to be had in use"),
    };
    Row { name, cost, scores }
}

/// Replaces the section headed `## title` of a Markdown file, or adds it at the end.
fn write_section(path: &Path, title: &str, table: &str) -> Result<()> {
    let old = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => String::new(),
        Err(e) => return Err(Error::file("open", path, e, "Check that it is a text file")),
    };
    let new = with_section(&old, title, table);
    write_beside(path, |out| out.write_all(new.as_bytes()))
}

fn with_section(text: &str, title: &str, body: &str) -> String {
    let heading = format!("## {title}\n");
    let section = format!("{heading}\n{body}");
    match text.find(&heading) {
        Some(start) => {
            let rest = &text[start + heading.len()..];
            let after = rest.find("\n## ").map_or("", |end| &rest[end..]);
            format!("{}{section}{after}", &text[..start])
        }
        None if text.is_empty() => section,
        None => format!("{}\n\n{section}", text.trim_end()),
    }
}

/// Eight lamps of one truth frame that no training saw, spread over the rig: true above predicted.
fn sheet(
    project: &Project,
    calibration: &Calibration,
    truth: &Truth,
    predictor: &Predictor,
) -> Result<Encoded> {
    const LAMPS: usize = 8;
    let frame = truth
        .frames
        .iter()
        .copied()
        .find(|&f| truth.has_olats(f))
        .ok_or_else(|| {
            Error::unexpected(
                "the truth",
                "a frame with true OLATs",
                "none",
                "Leave out the contact sheet",
            )
        })?;
    let frame = Frame::load(project, &calibration.response, frame)?;
    let field = predictor.predict(&frame)?;
    let truths = truth.olats(frame.index)?;
    let predicted: Vec<Image> = (0..field.lamps).map(|lamp| field.olat(lamp)).collect();
    let (true_level, level) = (
        brightness(&truths, &frame.mask),
        brightness(&predicted, &frame.mask),
    );
    let picked: Vec<usize> = (0..LAMPS.min(field.lamps))
        .map(|i| i * field.lamps / LAMPS.min(field.lamps))
        .collect();
    let mut tiles: BTreeMap<(usize, usize), (String, Encoded)> = BTreeMap::new();
    for (column, &lamp) in picked.iter().enumerate() {
        let name = &project.settings.shoot.lamps[lamp];
        tiles.insert(
            (0, column),
            (
                format!("{name} true"),
                shown(&truths[lamp], &frame.mask, true_level),
            ),
        );
        tiles.insert(
            (1, column),
            (
                format!("{name} predicted"),
                shown(&predicted[lamp], &frame.mask, level),
            ),
        );
    }
    let tiles: Vec<Tile> = tiles
        .values()
        .map(|(label, picture)| Tile { label, picture })
        .collect();
    contact_sheet(&tiles, picked.len())
}

/// Mean luminance of a set inside the subject.
fn brightness(olats: &[Image], mask: &Mask) -> f32 {
    let (mut sum, mut count) = (0f64, 0u64);
    for olat in olats {
        for (pixel, _) in olat
            .pixels
            .iter()
            .zip(&mask.pixels)
            .filter(|&(_, &alpha)| alpha > 0.98)
        {
            sum += f64::from(luminance(*pixel));
            count += 1;
        }
    }
    (sum / count.max(1) as f64) as f32
}

fn shown(olat: &Image, mask: &Mask, level: f32) -> Encoded {
    let gain = 0.12 / level.max(f32::MIN_POSITIVE);
    let mut tile = olat.clone();
    extend_edges(&mut tile, mask);
    for (pixel, &alpha) in tile.pixels.iter_mut().zip(&mask.pixels) {
        *pixel = pixel.map(|v| v * gain * alpha);
    }
    view(&tile)
}

#[cfg(test)]
mod tests {
    use super::with_section;

    #[test]
    fn a_section_is_replaced_and_its_neighbours_stay() {
        let text = "# Accuracy\n\nWords.\n\n## a\n\nold\n\n## b\n\nkept\n";
        assert_eq!(
            with_section(text, "a", "new\n"),
            "# Accuracy\n\nWords.\n\n## a\n\nnew\n\n## b\n\nkept\n"
        );
        assert_eq!(
            with_section(text, "c", "new\n"),
            format!("{}\n\n## c\n\nnew\n", text.trim_end())
        );
        assert_eq!(with_section("", "c", "new\n"), "## c\n\nnew\n");
    }
}

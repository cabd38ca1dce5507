//! One evaluation: from a project and its truth to scores, a table and contact sheets.

use super::display::{display_gain, display_picture};
use super::{Method, Row, Scores, Truth, excluded_check, markdown, score};
use base::error::{Error, Result};
use base::files::{self, write_beside};
use base::progress::Progress;
use calibration::Calibration;
use export::{Tile, contact_sheet};
use footage::{Frame, PictureSize, picture_size};
use gpu::{ComputeDevice, DeviceChoice};
use imaging::file::write_png;
use imaging::{Encoded, Image};
use light::weights::Weighting;
use project::Project;
use reflectance::Predictor;
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

/// What to evaluate, and what to write.
#[derive(Clone, Debug, PartialEq, clap::Args)]
pub struct EvaluateSettings {
    /// A folder with truth.json and truth/.
    #[arg(long, value_name = "DIR")]
    pub truth: PathBuf,
    /// What predicts the OLATs.
    #[arg(long = "with", value_enum, default_value_t = Method::Network)]
    pub method: Method,
    /// What the pictures show that are measured, and at which resolution.
    #[arg(long, value_enum, default_value_t)]
    pub at: PictureSize,
    /// How an environment is given to the lamps.
    #[arg(long = "weights", value_enum, default_value_t)]
    pub weighting: Weighting,
    /// Also measure all methods and write their table into this Markdown file, in the shoot's section.
    #[arg(long, value_name = "FILE")]
    pub table: Option<PathBuf>,
    /// Also write a contact sheet of predicted beside true OLATs.
    #[arg(long, value_name = "FILE.png")]
    pub sheet: Option<PathBuf>,
    /// Also write a contact sheet of the 20 lamps and frames whose OLATs are furthest from the truth.
    #[arg(long, value_name = "FILE.png")]
    pub worst: Option<PathBuf>,
    /// Where the network runs.
    #[arg(long, value_enum, default_value_t)]
    pub device: DeviceChoice,
}

/// The scores.
#[derive(Clone, Debug, Serialize)]
pub struct EvaluateReport {
    #[serde(flatten)]
    pub scores: Scores,
    /// Steps and seconds of training of the network that was evaluated.
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
    let asks_network = settings.method == Method::Network
        || settings.table.is_some()
        || settings.sheet.is_some()
        || settings.worst.is_some();
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
            settings.weighting,
            (method, settings.at),
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
        let (width, height) = picture_size(project, settings.at)?;
        let light = project.settings.size;
        let title = match settings.at {
            PictureSize::Square => format!("{} at {width} × {height}", project.settings.name),
            _ => format!(
                "{} at {width} × {height}, light at {light}",
                project.settings.name
            ),
        };
        write_section(path, &title, &markdown(&rows))?;
    }
    if let (Some(path), Some(predictor)) = (&settings.sheet, &predictor) {
        write_png(path, &sheet(project, &calibration, &truth, predictor)?)?;
    }
    if let (Some(path), Some(predictor)) = (&settings.worst, &predictor) {
        let scores = match settings.method {
            Method::Network => &scores,
            _ => &scores_of(Method::Network)?,
        };
        write_png(
            path,
            &worst(project, &calibration, &truth, predictor, scores)?,
        )?;
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
    let old = match files::read_text(path, files::MOST_TEXT) {
        Ok(text) => text,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => String::new(),
        Err(e) => return Err(Error::io("open", path, e, "Check that it is a text file")),
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

/// A truth frame's OLATs, predicted and true, as contact sheets show them.
struct OlatPictures {
    predicted: Vec<Encoded>,
    truth: Vec<Encoded>,
}

impl OlatPictures {
    fn new(
        project: &Project,
        calibration: &Calibration,
        truth: &Truth,
        predictor: &Predictor,
        frame: usize,
    ) -> Result<Self> {
        let frame = Frame::load(project, &calibration.response, frame)?;
        let field = predictor.predict(&frame)?;
        let predicted: Vec<Image> = (0..field.lamps).map(|lamp| field.olat(lamp)).collect();
        let all = |olats: &[Image]| {
            let gain = display_gain(olats.iter(), &frame.mask);
            let show = |olat| display_picture(olat, &frame.mask, gain);
            olats.iter().map(show).collect()
        };
        Ok(Self {
            predicted: all(&predicted),
            truth: all(&truth.olats(frame.index)?),
        })
    }
}

/// Lays labelled pictures out in rows of `columns`.
fn sheet_of(tiles: &[(String, Encoded)], columns: usize) -> Result<Encoded> {
    let tiles: Vec<Tile> = tiles
        .iter()
        .map(|(label, picture)| Tile { label, picture })
        .collect();
    contact_sheet(&tiles, columns)
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
        .ok_or_else(no_true_olats)?;
    let shown = OlatPictures::new(project, calibration, truth, predictor, frame)?;
    let count = LAMPS.min(shown.truth.len());
    let picked = (0..count).map(|i| i * shown.truth.len() / count);
    let row = |pictures: &[Encoded], what: &str| -> Vec<(String, Encoded)> {
        let name = |lamp: usize| &project.settings.shoot.lamps[lamp];
        let tile = |lamp: usize| (format!("{} {what}", name(lamp)), pictures[lamp].clone());
        picked.clone().map(tile).collect()
    };
    let mut tiles = row(&shown.truth, "true");
    tiles.extend(row(&shown.predicted, "predicted"));
    sheet_of(&tiles, count)
}

/// The lamps and frames whose OLATs score lowest, worst first: true, predicted, and four times their
/// difference in display codes about a middle grey.
fn worst(
    project: &Project,
    calibration: &Calibration,
    truth: &Truth,
    predictor: &Predictor,
    scores: &Scores,
) -> Result<Encoded> {
    const CELLS: usize = 20;
    const CELLS_PER_ROW: usize = 4;
    let mut cells: Vec<(f64, usize, usize)> = Vec::new();
    for (&frame, lamps) in &scores.olat_psnr_by_lamp_db {
        cells.extend(
            lamps
                .iter()
                .enumerate()
                .map(|(lamp, &db)| (db, frame, lamp)),
        );
    }
    if cells.is_empty() {
        return Err(no_true_olats());
    }
    cells.sort_by(|a, b| a.0.total_cmp(&b.0));
    cells.truncate(CELLS);
    let mut frames: BTreeMap<usize, OlatPictures> = BTreeMap::new();
    let mut tiles = Vec::new();
    for (db, frame, lamp) in cells {
        if let std::collections::btree_map::Entry::Vacant(entry) = frames.entry(frame) {
            entry.insert(OlatPictures::new(
                project,
                calibration,
                truth,
                predictor,
                frame,
            )?);
        }
        let (predicted, truth) = (&frames[&frame].predicted[lamp], &frames[&frame].truth[lamp]);
        let mut difference = predicted.clone();
        for (d, t) in difference.0.pixels.iter_mut().zip(&truth.0.pixels) {
            *d = std::array::from_fn(|c| (0.5 + 4.0 * (d[c] - t[c])).clamp(0.0, 1.0));
        }
        let name = &project.settings.shoot.lamps[lamp];
        tiles.push((format!("frame {frame} {name}"), truth.clone()));
        tiles.push((format!("predicted {db:.1} db"), predicted.clone()));
        tiles.push(("difference x 4".to_owned(), difference));
    }
    sheet_of(&tiles, 3 * CELLS_PER_ROW)
}

fn no_true_olats() -> Error {
    Error::missing(
        "no frame of the truth has true OLATs",
        "Leave out the contact sheet",
    )
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

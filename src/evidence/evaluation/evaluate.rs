//! One evaluation: from a project and its truth to scores, a table and contact sheets.

use super::accuracy::Predicted;
use super::display::{display_gain, display_picture};
use super::flicker::{self, ClipFlicker};
use super::{Comparison, Learnt, Method, Row, Scores, Truth, compare, excluded_check, markdown, truth_weights};
use base::error::{Error, Result};
use base::files::{self, write_beside};
use base::numbers::within;
use base::progress::Progress;
use calibration::Calibration;
use export::{Tile, contact_sheet};
use footage::{Frame, PictureSize, picture_size};
use gpu::{ComputeDevice, DeviceChoice};
use imaging::file::write_png;
use imaging::{Encoded, Image};
use light::weights::Weighting;
use project::Project;
use reflectance::{Predictor, ReflectanceField};
use rivals::{Effort, Spent};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use transfer::{FineField, OlatPredictor};

/// Allowed training minutes of methods that are trained during evaluation.
pub const MINUTES: std::ops::RangeInclusive<f64> = 0.001..=10_000.0;
/// As in the preset `quick`.
const DEFAULT_MINUTES: f64 = 10.0;

/// Settings of an evaluation and its output files.
#[derive(Clone, Debug, PartialEq, clap::Args)]
pub struct EvaluateSettings {
    /// Folder with truth.json and truth/.
    #[arg(long, value_name = "DIR")]
    pub truth: PathBuf,
    /// Method that predicts the OLATs.
    #[arg(long = "with", value_enum, default_value_t = Method::Prediction)]
    pub method: Method,
    /// Part and resolution of the plate for the measured pictures.
    #[arg(long, value_enum, default_value_t)]
    pub at: PictureSize,
    /// Weighting of the lamps for an environment.
    #[arg(long = "weights", value_enum, default_value_t)]
    pub weighting: Weighting,
    /// Training minutes for texler and sun, which are trained now [default: as long as the project's network, else 10].
    #[arg(long, value_parser = within(MINUTES))]
    pub minutes: Option<f64>,
    /// Random seed for texler and sun [default: the project's].
    #[arg(long)]
    pub seed: Option<u64>,
    /// Also measure all methods and write their table into this Markdown file, in the shoot's section. Texler and sun
    /// are included only if --minutes is given.
    #[arg(long, value_name = "FILE")]
    pub table: Option<PathBuf>,
    /// Also write a contact sheet of predicted and true OLATs side by side.
    #[arg(long, value_name = "FILE.png")]
    pub sheet: Option<PathBuf>,
    /// Also write a contact sheet of the 20 OLATs furthest from the truth.
    #[arg(long, value_name = "FILE.png")]
    pub worst: Option<PathBuf>,
    /// Also write each measured frame, its OLATs and their truths into this folder.
    #[arg(long, value_name = "DIR")]
    pub pictures: Option<PathBuf>,
    /// Device of the network.
    #[arg(long, value_enum, default_value_t)]
    pub device: DeviceChoice,
}

/// The scores.
#[derive(Clone, Debug, Serialize)]
pub struct EvaluateReport {
    #[serde(flatten)]
    pub scores: Scores,
    /// Training steps and seconds of the evaluated network; for texler, of the network for the environments.
    pub training_steps: Option<u64>,
    pub training_seconds: Option<f64>,
    /// Flicker of the interview relit by the network under the truth's first environment.
    pub flicker: Option<ClipFlicker>,
}

/// Measures `settings.method`, and all methods if a table is requested.
///
/// # Errors
/// When input is missing, or the network was trained on a frame of the truth.
pub fn evaluate(project: &Project, settings: &EvaluateSettings, progress: &Progress) -> Result<EvaluateReport> {
    let calibration = Calibration::load(project)?;
    let truth = Truth::open(project, &settings.truth)?;
    let compute = ComputeDevice::choose(settings.device);
    let minutes = learning_minutes(project, settings.minutes);
    let asks_predictor =
        settings.method.predicts() || settings.table.is_some() || settings.sheet.is_some() || settings.worst.is_some();
    let predictor =
        asks_predictor.then(|| open_predictor(project, &calibration, settings, &truth, &compute)).transpose()?;
    let weights = truth_weights(project, &calibration, &truth, settings.weighting)?;
    let asks_olats = truth.frames.iter().any(|&frame| truth.has_olats(frame));
    let compared = |method: Method| -> Result<(Comparison, Option<Spent>)> {
        let effort = Effort { minutes, steps: None, seed: settings.seed.unwrap_or(project.settings.seed) };
        let learn = || {
            let from = (project, &calibration);
            Learnt::learn(method, from, &weights, asks_olats, &effort, &compute, progress)
        };
        let learnt = method.learns().then(|| compute.guarded(learn)).transpose()?;
        let mut predict = |frame: &Frame, olats| match (&learnt, &predictor) {
            (Some(learnt), _) => Ok(Predicted::Pictures(learnt.predict(frame, olats)?)),
            (None, Some(predictor)) => {
                let (field, fine) = predicted(predictor, method, frame)?;
                Ok(Predicted::Field(field, fine))
            }
            (None, None) => Err(Error::bug("nothing to predict with")),
        };
        let compared = compare(project, &calibration, &truth, &weights, (method, settings.at), &mut predict, progress)?;
        Ok((compared, learnt.map(|learnt| learnt.spent())))
    };
    let method_scores = |method: Method| {
        let (compared, spent) = compared(method)?;
        Ok::<_, Error>((compared.scores()?, spent))
    };
    let (found, learnt) = compared(settings.method)?;
    let scores = found.scores()?;
    if let Some(folder) = &settings.pictures {
        found.write_pictures(folder)?;
    }
    drop(found);
    if let (Some(path), Some(predictor)) = (&settings.table, &predictor) {
        let methods = [
            Method::Nearest,
            Method::Ratio,
            Method::Harmonics,
            Method::Texler,
            Method::Sun,
            Method::Transfer,
            Method::Network,
            Method::Prediction,
            Method::TruthOlats,
        ];
        let wanted = methods.into_iter();
        let wanted = wanted.filter(|m| settings.minutes.is_some() || !m.learns());
        let trained = predictor.network().is_some();
        let wanted = wanted.filter(|m| trained || *m != Method::Network);
        let mut all = Vec::new();
        for method in wanted {
            let (scores, learnt) = match &learnt {
                Some(learnt) if method == settings.method => (scores.clone(), Some(*learnt)),
                _ => method_scores(method)?,
            };
            let spent = learnt.or_else(|| training_record(predictor, method));
            let cost = spent.map_or("none".to_owned(), |s| cost(s, &compute.description));
            all.push((scores, cost));
        }
        let rows: Vec<Row> = all.iter().map(|(scores, cost)| row(scores, cost)).collect();
        let (width, height) = picture_size(project, settings.at)?;
        let light = project.settings.size;
        let title = match settings.at {
            PictureSize::Square => format!("{} at {width} × {height}", project.settings.name),
            _ => format!("{} at {width} × {height}, light at {light}", project.settings.name),
        };
        write_section(path, &title, &markdown(&rows))?;
    }
    if let (Some(path), Some(predictor)) = (&settings.sheet, &predictor) {
        write_png(path, &sheet(project, &calibration, &truth, predictor)?)?;
    }
    if let (Some(path), Some(predictor)) = (&settings.worst, &predictor) {
        let scores = match settings.method {
            Method::Prediction => &scores,
            _ => &method_scores(Method::Prediction)?.0,
        };
        write_png(path, &worst(project, &calibration, &truth, predictor, scores)?)?;
    }
    let flicker = match &predictor {
        Some(predictor) if settings.method.predicts() => {
            let named = &truth.environments[0];
            let found = light::panorama::load(&project.shoot_path(&named.file)).and_then(|read| {
                flicker::clip_flicker(
                    project,
                    &calibration,
                    (&Arc::new(read), named.front().turned(0.0)),
                    flicker::middle(project),
                    &mut |frame| Ok(predicted(predictor, settings.method, frame)?.0),
                    progress,
                )
            });
            flicker::if_possible(found, progress)?
        }
        _ => None,
    };
    let network = (predictor.as_ref()).and_then(|p| training_record(p, settings.method));
    let spent = network.or(learnt);
    Ok(EvaluateReport {
        scores,
        training_steps: spent.map(|spent| spent.steps),
        training_seconds: spent.map(|spent| spent.seconds),
        flicker,
    })
}

/// Opens the OLAT predictor, and refuses a network that was trained on the truth's frames.
fn open_predictor(
    project: &Project,
    calibration: &Calibration,
    settings: &EvaluateSettings,
    truth: &Truth,
    compute: &ComputeDevice,
) -> Result<OlatPredictor> {
    if settings.method == Method::Network && !project.checkpoint_path().exists() {
        Predictor::open(project, &compute.device)?;
    }
    let mut predictor = OlatPredictor::open(project, calibration, &compute.device)?.steady(project, calibration);
    if settings.at != PictureSize::Square {
        predictor = predictor.with_detail(project, calibration)?;
    }
    if let Some(network) = predictor.network()
        && settings.method != Method::Transfer
    {
        excluded_check(&network.info().training_frames, &truth.frames)?;
    }
    Ok(predictor)
}

/// A frame's OLATs by a method that [predicts](Method::predicts).
fn predicted(
    predictor: &OlatPredictor,
    method: Method,
    frame: &Frame,
) -> Result<(ReflectanceField, Option<FineField>)> {
    match (method, predictor.network()) {
        (Method::Transfer, _) => {
            let carried = predictor.carry(frame);
            let fine = predictor.fine(&carried);
            Ok((carried.field, fine))
        }
        (Method::Network, Some(network)) => Ok((network.predict(frame)?, None)),
        _ => {
            let (field, fine) = predictor.predict_fine(frame)?;
            Ok((field.read()?, fine))
        }
    }
}

/// Training record of a method's network.
fn training_record(predictor: &OlatPredictor, method: Method) -> Option<Spent> {
    let uses = matches!(method, Method::Network | Method::Prediction);
    let info = predictor.network().filter(|_| uses)?.info();
    Some(Spent { steps: info.step, seconds: info.seconds })
}

/// Training minutes during evaluation: as set, or as long as the project's network was trained.
pub fn learning_minutes(project: &Project, asked: Option<f64>) -> f64 {
    let trained = || reflectance::checkpoint::info(&project.checkpoint_path()).ok();
    let minutes = asked.or_else(|| Some(trained()?.seconds / 60.0));
    let minutes = minutes.unwrap_or(DEFAULT_MINUTES);
    minutes.clamp(*MINUTES.start(), *MINUTES.end())
}

/// Cost of a training in words.
fn cost(spent: Spent, device: &str) -> String {
    let minutes = spent.seconds / 60.0;
    format!("{minutes:.1} min of training, {} steps, {device}", spent.steps)
}

fn row<'a>(scores: &'a Scores, trained: &'a str) -> Row<'a> {
    let (name, cost) = match scores.method {
        Method::Nearest => ("nearest pose", "none"),
        Method::Ratio => ("ratio image", "none"),
        Method::Harmonics => ("ratio image of order-2 harmonics", "none"),
        Method::Texler => ("Texler 2020, a network for these looks", trained),
        Method::Sun => ("Sun 2019, trained on the poses", trained),
        Method::Transfer => ("poses carried over", "none"),
        Method::Network => ("network", trained),
        Method::Prediction => ("**both: the prediction**", trained),
        Method::TruthOlats => ("true OLATs: the rig's limit", "not to be had in use"),
    };
    Row { name, cost, scores }
}

/// Replaces the section headed `## title` of a Markdown file, or appends it.
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

/// Predicted and true OLATs of a truth frame, as in contact sheets.
struct OlatPictures {
    predicted: Vec<Encoded>,
    truth: Vec<Encoded>,
}

impl OlatPictures {
    fn new(
        project: &Project,
        calibration: &Calibration,
        truth: &Truth,
        predictor: &OlatPredictor,
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
        Ok(Self { predicted: all(&predicted), truth: all(&truth.olats(frame.index)?) })
    }
}

/// Arranges labelled pictures in rows of `columns`.
fn labelled_sheet(tiles: &[(String, Encoded)], columns: usize) -> Result<Encoded> {
    let tiles: Vec<Tile> = tiles.iter().map(|(label, picture)| Tile { label, picture }).collect();
    contact_sheet(&tiles, columns)
}

/// Eight lamps spread over the rig in a truth frame outside the training: true above predicted.
fn sheet(project: &Project, calibration: &Calibration, truth: &Truth, predictor: &OlatPredictor) -> Result<Encoded> {
    const LAMPS: usize = 8;
    let frame = truth.frames.iter().copied().find(|&f| truth.has_olats(f)).ok_or_else(no_true_olats)?;
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
    labelled_sheet(&tiles, count)
}

/// OLATs with the lowest scores, worst first: true, predicted, and four times their difference in display codes about a
/// middle grey.
fn worst(
    project: &Project,
    calibration: &Calibration,
    truth: &Truth,
    predictor: &OlatPredictor,
    scores: &Scores,
) -> Result<Encoded> {
    const CELLS: usize = 20;
    const CELLS_PER_ROW: usize = 4;
    let mut cells: Vec<(f64, usize, usize)> = Vec::new();
    for (&frame, lamps) in &scores.olat_psnr_by_lamp_db {
        cells.extend(lamps.iter().enumerate().map(|(lamp, &db)| (db, frame, lamp)));
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
            entry.insert(OlatPictures::new(project, calibration, truth, predictor, frame)?);
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
    labelled_sheet(&tiles, 3 * CELLS_PER_ROW)
}

fn no_true_olats() -> Error {
    Error::missing("the truth has no OLATs", "Leave out the contact sheet")
}

#[cfg(test)]
mod tests {
    use super::with_section;

    #[test]
    fn a_section_is_replaced_and_its_neighbours_stay() {
        let text = "# Accuracy\n\nWords.\n\n## a\n\nold\n\n## b\n\nkept\n";
        assert_eq!(with_section(text, "a", "new\n"), "# Accuracy\n\nWords.\n\n## a\n\nnew\n\n## b\n\nkept\n");
        assert_eq!(with_section(text, "c", "new\n"), format!("{}\n\n## c\n\nnew\n", text.trim_end()));
        assert_eq!(with_section("", "c", "new\n"), "## c\n\nnew\n");
    }
}

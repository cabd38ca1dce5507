//! References for predictions: frames with a truth, or a pose that no network was trained on.

use super::ladder::TradeoffSettings;
use base::error::{Error, Result};
use calibration::Calibration;
use compositor::reference::{lit_lamps, relight};
use compositor::{Plate, PlateSquare};
use evaluation::Truth;
use footage::{Exemplar, Frame, PictureSize, dimensions};
use imaging::{Image, Mask};
use light::weights::{Partition, Weighting};
use light::{Environment, built_in};
use project::Project;
use reflectance::ReflectanceField;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Memory limit for true OLATs in bytes: frames beyond it are compared only relit.
const MOST_OLATS: usize = 1 << 30;
/// Number of environments for relighting a held-out pose.
const ENVIRONMENTS: usize = 3;

/// Reference of a project's rungs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Against {
    /// The truth in this folder.
    Truth(PathBuf),
    /// This pose, from 0.
    Pose(usize),
}

impl Against {
    /// Reference from the settings; by default the middle pose.
    ///
    /// # Errors
    /// When there are too few poses, or the pose does not exist.
    pub fn new(project: &Project, settings: &TradeoffSettings) -> Result<Self> {
        if let Some(folder) = &settings.truth {
            // The project may be opened from another working directory next time.
            let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.clone());
            return Ok(Self::Truth(folder));
        }
        let poses = project.settings.shoot.poses.len();
        let pose = settings.hold_out.unwrap_or(poses / 2);
        if pose < poses && poses > 1 {
            return Ok(Self::Pose(pose));
        }
        Err(Error::invalid(
            format!("pose {pose} cannot be held out: the shoot has {poses} poses, counted from 0, and one must stay"),
            ("Choose another pose, or compare with truth", "--hold-out POSE, or --truth DIR"),
        ))
    }

    /// Description for use in a sentence.
    pub fn words(&self, project: &Project) -> String {
        match self {
            Self::Truth(folder) => format!("the truth in {}", folder.display()),
            Self::Pose(pose) => {
                let name = project.settings.shoot.poses.get(*pose);
                let name = name.map_or_else(|| pose.to_string(), Clone::clone);
                format!("pose {name}, which no network has seen")
            }
        }
    }
}

/// Environment of the compared pictures.
pub struct Lit {
    pub name: String,
    pub environment: Arc<Environment>,
    /// Yaw that turns its front to the front.
    pub yaw_deg: f32,
}

/// Test cases and their true pictures.
pub struct Judge {
    pub lit: Vec<Lit>,
    pub subject: Subject,
    /// Truth of each case under each of `lit`, at the compared size.
    truths: Vec<Vec<Image>>,
    /// True OLATs of each case, where known.
    olats: Vec<Option<Vec<Image>>>,
}

/// Source of the compared pictures.
pub enum Subject {
    Truth(Truth, PictureSize),
    /// The pose, its plate and its matte at the compared size.
    Pose(usize, Image, Mask),
}

/// One picture to predict.
pub struct Case {
    pub frame: Frame,
    /// Set if the picture is compared at another size than the network's.
    pub plate: Option<Plate>,
}

impl Case {
    /// Subject coverage at the compared size.
    pub fn matte(&self) -> &Mask {
        (self.plate.as_ref()).map_or(&self.frame.mask, |plate| &plate.matte)
    }
}

impl Judge {
    /// Reads the truth; for a pose, at `most` pixels at most.
    ///
    /// # Errors
    /// When part of it is missing or cannot be read.
    pub fn open(
        project: &Project,
        calibration: &Calibration,
        against: &Against,
        at: PictureSize,
        most: usize,
    ) -> Result<Self> {
        match against {
            Against::Truth(folder) => Self::from_truth(project, folder, at),
            Against::Pose(pose) => Self::from_pose(project, calibration, *pose, most),
        }
    }

    fn from_truth(project: &Project, folder: &Path, at: PictureSize) -> Result<Self> {
        let truth = Truth::open(project, folder)?;
        let lit = truth.environments.iter().map(|named| {
            Ok(Lit {
                name: named.name.clone(),
                environment: Arc::new(light::panorama::load(&project.shoot_path(&named.file))?),
                yaw_deg: named.front().turned(0.0),
            })
        });
        let lit: Vec<Lit> = lit.collect::<Result<_>>()?;
        let mut room = MOST_OLATS;
        let mut judge = Self { lit, truths: Vec::new(), olats: Vec::new(), subject: Subject::Truth(truth, at) };
        let Subject::Truth(truth, at) = &judge.subject else { return Err(Error::bug("a truth is no longer one")) };
        for &frame in &truth.frames {
            let relit = judge.lit.iter().map(|lit| truth.relit_at(frame, &lit.name, *at));
            judge.truths.push(relit.collect::<Result<_>>()?);
            let olats = if truth.has_olats(frame) && room > 0 { Some(truth.olats_at(frame, *at)?) } else { None };
            let bytes: usize = (olats.iter().flatten()).map(|olat| size_of_val(&olat.pixels[..])).sum();
            room = room.saturating_sub(bytes);
            judge.olats.push(olats);
        }
        Ok(judge)
    }

    fn from_pose(project: &Project, calibration: &Calibration, pose: usize, most: usize) -> Result<Self> {
        let mut large = project.clone();
        large.settings.size = exemplar_size(project)?.min(most).max(project.settings.size);
        let exemplar = Exemplar::load(&large, &calibration.response, pose)?;
        let light = calibration.interview_light();
        let plate = exemplar.relit_by_all(&large, &calibration.response, &light)?;
        let partition = Partition::new(Weighting::default(), &calibration.rig);
        let lit = environments(project)?;
        let field = ReflectanceField::from_olats(&exemplar.olats);
        let relit = lit.iter().map(|lit| {
            let weights = partition.weights(&lit.environment, lit.yaw_deg).per_lamp;
            relight(&field, &weights, &lit_lamps(&weights))
        });
        Ok(Self {
            truths: vec![relit.collect()],
            lit,
            olats: vec![Some(exemplar.olats)],
            subject: Subject::Pose(pose, plate, exemplar.mask),
        })
    }

    /// Frame numbers excluded from training.
    pub fn frames(&self) -> Vec<usize> {
        match &self.subject {
            Subject::Truth(truth, _) => truth.frames.clone(),
            Subject::Pose(..) => Vec::new(),
        }
    }

    /// Pose excluded from training.
    pub fn held_out(&self) -> Option<usize> {
        match &self.subject {
            Subject::Truth(..) => None,
            Subject::Pose(pose, ..) => Some(*pose),
        }
    }

    /// Number of pictures per environment.
    pub fn count(&self) -> usize {
        self.truths.len()
    }

    /// True picture of case `case` under environment `lit`.
    pub fn relit(&self, case: usize, lit: usize) -> &Image {
        &self.truths[case][lit]
    }

    /// True picture of case `case` under each lamp of the project, if known.
    pub fn olats(&self, case: usize) -> Option<&[Image]> {
        self.olats[case].as_deref()
    }

    /// Case `case` as seen by a network of `variant`: the project with another size and other lamps.
    ///
    /// # Errors
    /// When a picture cannot be read.
    pub fn case(&self, variant: &Project, calibration: &Calibration, case: usize) -> Result<Case> {
        let response = &calibration.response;
        match &self.subject {
            Subject::Truth(truth, at) => {
                let (frame, filmed) = Frame::load_filmed(variant, response, truth.frames[case])?;
                let filmed = filmed.shown(*at);
                let plate = filmed.map(|filmed| Plate::from_filmed(filmed, &frame)).transpose()?;
                Ok(Case { frame, plate })
            }
            Subject::Pose(pose, radiance, matte) => {
                let exemplar = Exemplar::load(variant, response, *pose)?;
                let light = calibration.interview_light();
                let frame =
                    Frame { index: 0, plate: exemplar.relit_by_all(variant, response, &light)?, mask: exemplar.mask };
                let side = matte.width;
                let square = PlateSquare { x: 0.0, y: 0.0, side: side as f32 };
                let plate = (side != frame.mask.width)
                    .then(|| Plate::new(radiance.clone(), matte.clone(), square, &frame.mask))
                    .transpose()?;
                Ok(Case { frame, plate })
            }
        }
    }
}

/// Height of the network's square in the exemplars, rounded down to a power of two.
///
/// # Errors
/// When the first OLAT cannot be read.
pub fn exemplar_size(project: &Project) -> Result<usize> {
    let picture = dimensions(&project.first_olat(0))?;
    let side = project.settings.framing.for_size(picture).side;
    Ok(1 << side.max(1).ilog2())
}

/// Environments for relighting a pose: the project's first ones, or built-in ones.
fn environments(project: &Project) -> Result<Vec<Lit>> {
    let there = project.environments().into_iter().filter(|known| !known.missing);
    let own = there.take(ENVIRONMENTS).map(|known| {
        Ok(Lit {
            environment: Arc::new(light::panorama::load(&known.file)?),
            yaw_deg: known.front.unwrap_or_default().turned(0.0),
            name: known.name,
        })
    });
    let own: Vec<Lit> = own.collect::<Result<_>>()?;
    if !own.is_empty() {
        return Ok(own);
    }
    let built_in = ["courtyard", "nave"].into_iter().filter_map(built_in::named);
    let built_in = built_in.map(|own| Lit { name: own.name.to_owned(), environment: own.environment(), yaw_deg: 0.0 });
    Ok(built_in.collect())
}

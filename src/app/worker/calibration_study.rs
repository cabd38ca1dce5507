//! Views of a calibration for the window: the light that the mirror ball shows within a circle, and the exemplars
//! under a response.

use super::srgb_picture::SrgbPicture;
use base::error::{Error, Result};
use base::progress::{Control, Progress};
use calibration::gamma::{Case, CurveFit, GammaStudy, Histogram, Surface};
use calibration::light_probe::{BallView, ClippedLight, Photograph, light_probe};
use calibration::probe::Probes;
use calibration::silhouette::{self, Circle, Photographs, Silhouette};
use calibration::{Calibration, PROVISIONAL, Trial};
use imaging::Encoded;
use light::Lamp;
use project::Project;
use std::path::PathBuf;
use std::sync::Arc;

/// Longer side of a photograph in a panel, in pixels.
const PICTURE_PX: usize = 1024;
/// Size of the light probe in a panel, in pixels.
const PANORAMA_PX: (usize, usize) = (384, 192);
/// Steps along each axis of the loss surface.
const SURFACE_STEPS: usize = 25;

/// View of the mirror balls.
#[derive(Clone, Debug)]
pub struct ProbeView {
    /// Lamp of the photograph; None for the interview's light.
    pub photograph: Option<usize>,
    /// The photograph, reduced, in camera codes.
    pub picture: SrgbPicture,
    /// Width and height of the full photograph.
    pub size: (usize, usize),
    /// Silhouette used for this view, and the project's own.
    pub circle: Circle,
    pub kept: Circle,
    /// Visibility of the rim at this circle, and the circle found in the photographs. Sentences if there is none.
    pub rim: std::result::Result<Silhouette, String>,
    pub found: std::result::Result<Silhouette, String>,
    /// Reasons that this circle shows no lamps, a sentence each.
    pub findings: Vec<String>,
    /// Checks of the calibration's lamps, as in the project check; none before the first calibration.
    pub checks: Vec<check::Check>,
    /// Light of the photograph as a lat-long panorama, as bright as the photograph.
    pub panorama: SrgbPicture,
    /// Number of ball pixels with a clipped channel, and their centres in the photograph.
    pub clipped_pixels: usize,
    pub clipped_at: Vec<[f32; 2]>,
    /// Share of the sphere that the ball does not show, and share of the light that was filled in there.
    pub blind_share: f32,
    pub filled_share: f32,
    /// Lamps as their balls show them within this circle.
    pub lamps: Vec<SeenLamp>,
}

/// A lamp and its highlight on the ball.
#[derive(Clone, Debug)]
pub struct SeenLamp {
    pub lamp: Lamp,
    /// Position in pixels of the photograph; None if the ball does not show it.
    pub on_ball: Option<[f32; 2]>,
}

/// Fit of a response to the exemplars and the interview.
#[derive(Clone, Debug)]
pub struct GammaView {
    /// Response used for this view, and the calibration's own.
    pub trial: Trial,
    pub calibrated: Trial,
    /// Standard deviations of the calibration's γ1 and γ2.
    pub deviation: [f32; 2],
    /// Ambiguous solutions of the calibration, the more probable one first, each with the pose relit under it.
    /// Empty if the solution is unambiguous.
    pub cases: Arc<Vec<(Case, SrgbPicture)>>,
    /// Frame number in the interview.
    pub frame: usize,
    /// Names of all poses, and index of the relit one.
    pub poses: Vec<String>,
    pub pose: usize,
    /// The frame and the relit pose, in camera codes.
    pub interview: SrgbPicture,
    pub relit: SrgbPicture,
    /// Levels of the interview's frames and of the relit poses inside the subject; the latter also under a plain
    /// power of 2.2.
    pub interview_histogram: Histogram,
    pub relit_histogram: Histogram,
    pub before_histogram: Histogram,
    /// Root-mean-square distance of the encoded quantiles on the subject and on the mirror balls, 0 to 1.
    pub subject_distance: f32,
    pub ball_distance: f32,
    /// Cost of each pair of exponents, and of other curves.
    pub surface: Arc<Surface>,
    pub curves: Arc<Vec<CurveFit>>,
}

type FoundCircle = std::result::Result<Silhouette, String>;

/// Cached parts of a calibration.
pub struct CalibrationStudy {
    root: PathBuf,
    stop: Control,
    calibrations: Option<u64>,
    /// The average of the ball's photographs and its circle; sentences if there is none.
    found: Option<std::result::Result<(Photographs, FoundCircle), String>>,
    /// The photograph that was read last.
    photograph: Option<(Option<usize>, Encoded)>,
    /// The lamps within the last requested circle, or the reason that it shows none.
    lamps: Option<(Circle, std::result::Result<Vec<Lamp>, String>)>,
    exemplars: Option<Exemplars>,
    /// The interview's frame that was read last.
    frame: Option<(usize, SrgbPicture)>,
}

/// Basis for trials of a response.
struct Exemplars {
    study: GammaStudy,
    /// The pose in `study`.
    pose: usize,
    calibrated: Trial,
    deviation: [f32; 2],
    cases: Vec<Case>,
    /// The pose relit under each case; None before the first request.
    relit_cases: Option<Arc<Vec<(Case, SrgbPicture)>>>,
    before: Histogram,
    surface: Arc<Surface>,
    curves: Arc<Vec<CurveFit>>,
}

impl CalibrationStudy {
    /// Nothing read yet of the project in folder `root`.
    pub fn new(root: PathBuf, stop: Control) -> Self {
        Self {
            root,
            stop,
            calibrations: None,
            found: None,
            photograph: None,
            lamps: None,
            exemplars: None,
            frame: None,
        }
    }

    /// Drops what depends on the calibration, if that may have changed: if the number of possible changes differs from
    /// the last one.
    pub fn renewed(&mut self, calibrations: u64) -> &mut Self {
        if self.calibrations.replace(calibrations) != Some(calibrations) {
            *self = Self {
                calibrations: Some(calibrations),
                found: self.found.take(),
                photograph: self.photograph.take(),
                frame: self.frame.take(),
                ..Self::new(self.root.clone(), self.stop.clone())
            };
        }
        self
    }

    /// View of a photograph of the mirror ball within a circle; None for the project's own circle.
    ///
    /// # Errors
    /// When the project or its photographs cannot be read, or a stop was requested.
    pub fn probe(&mut self, photograph: Option<usize>, circle: Option<Circle>) -> Result<ProbeView> {
        let silent = |_| {};
        let progress = Progress::new(&silent, self.stop.clone());
        let mut project = Project::open(&self.root)?;
        if project.settings.shoot.without_balls {
            return Err(Error::missing(
                "This shoot has no mirror balls: the lamps' directions are those of its list",
                "Calibrate; the lamps are shown in Relight",
            ));
        }
        let found = match self.found.take() {
            Some(found) => found,
            None => find_circle(&project, &progress)?,
        };
        let (photographs, found) = match &*self.found.insert(found) {
            Ok((photographs, found)) => (Some(photographs), found.clone()),
            Err(sentence) => (None, Err(sentence.clone())),
        };
        let mut findings = Vec::new();
        // A shoot without a known ball starts with the circle that was found, or with one to drag.
        if !project.settings.shoot.ball.has_circle() {
            let circle = match &found {
                Ok(found) => found.circle,
                Err(sentence) => {
                    findings.push(format!(
                        "The mirror ball was not found: {sentence}. Drag the circle in the middle of the \
                         photograph onto the ball's outline, then calibrate"
                    ));
                    in_the_middle(footage::dimensions(&project.interview_probe_picture())?)
                }
            };
            circle.apply_to(&mut project.settings.shoot.ball);
        }
        let kept = Circle::from_ball(&project.settings.shoot.ball);
        let circle = circle.unwrap_or(kept);
        circle.apply_to(&mut project.settings.shoot.ball);
        let shoot = &project.settings.shoot;
        let calibration = Calibration::load(&project).ok();
        let response = calibration.as_ref().map_or(PROVISIONAL, |c| c.response);
        let photograph = photograph.filter(|&lamp| lamp < shoot.all_lamps().len());
        let encoded = match self.photograph.take() {
            Some((read, encoded)) if read == photograph => encoded,
            _ => {
                let picture = photograph
                    .map_or_else(|| project.interview_probe_picture(), |lamp| project.lamp_probe_picture(lamp));
                footage::read_picture(&picture)?
            }
        };
        let (_, encoded) = &*self.photograph.insert((photograph, encoded));
        let lamps = match self.lamps.take() {
            Some((within, lamps)) if within == circle => lamps,
            _ => match Probes::load(&project, &progress) {
                Ok(probes) => Ok(probes.lamps(shoot.all_lamps(), &response)),
                // While the circle is being dragged it may show no ball.
                Err(refusal @ Error::Invalid { .. }) => Err(refusal.to_string()),
                Err(refusal) => return Err(refusal),
            },
        };
        let (_, lamps) = &*self.lamps.insert((circle, lamps));
        findings.extend(lamps.as_ref().err().cloned());
        let checks = calibration.as_ref().map_or_else(Vec::new, check::lamp_checks);
        let size = encoded.0.size();
        let view = BallView::new(&shoot.ball, shoot.dome_radius_m);
        let light = Photograph::from_encoded(encoded, &response);
        let probe = light_probe(&light, &view, ClippedLight::Keep, PANORAMA_PX)?;
        let [cx, cy] = circle.center_px;
        let clipped_at = (light.clipped.pixels.iter().enumerate())
            .filter(|(_, clipped)| clipped.contains(&true))
            .map(|(i, _)| [(i % size.0) as f32 + 0.5, (i / size.0) as f32 + 0.5])
            .filter(|[x, y]| (f64::from(*x) - cx).hypot(f64::from(*y) - cy) <= circle.radius_px)
            .collect();
        let on_ball = |lamp: &Lamp| view.place(lamp.direction, size);
        Ok(ProbeView {
            photograph,
            picture: SrgbPicture::reduced(encoded, PICTURE_PX),
            size,
            circle,
            kept,
            rim: match (photographs, &found) {
                (Some(photographs), _) => silhouette::measure(photographs, &circle).map_err(|e| e.to_string()),
                (None, found) => found.clone(),
            },
            found,
            findings,
            checks,
            panorama: SrgbPicture::as_exposed(&probe.panorama),
            clipped_pixels: probe.clipped_pixels,
            clipped_at,
            blind_share: probe.blind_share,
            filled_share: probe.filled_share,
            lamps: (lamps.iter().flatten())
                .map(|lamp| SeenLamp { on_ball: on_ball(lamp), lamp: lamp.clone() })
                .collect(),
        })
    }

    /// A pose relit as an interview frame, by a response and an exposure; None for the calibration's own.
    ///
    /// # Errors
    /// When the project has no calibration or its pictures cannot be read, or a stop was requested.
    pub fn gamma(&mut self, frame: usize, pose: usize, trial: Option<Trial>) -> Result<GammaView> {
        let silent = |_| {};
        let progress = Progress::new(&silent, self.stop.clone());
        let project = Project::open(&self.root)?;
        // A shoot without frames or poses is rejected here.
        let exemplars = match self.exemplars.take() {
            Some(exemplars) => exemplars,
            None => Exemplars::read(&project, &progress)?,
        };
        let frame = frame.min(project.settings.shoot.frames.len() - 1);
        if self.frame.as_ref().is_none_or(|(read, _)| *read != frame) {
            let path = project.frame_picture(footage::readable_frame(&project, frame)?);
            let encoded = footage::read_encoded(&path, &project.settings.framing)?;
            self.frame = Some((frame, SrgbPicture::reduced(&encoded, PICTURE_PX)));
        }
        let exemplars = self.exemplars.insert(exemplars);
        let pose = pose.min(project.settings.shoot.poses.len() - 1);
        if exemplars.pose != pose {
            exemplars.study.show_pose(&project, pose)?;
            exemplars.pose = pose;
            exemplars.relit_cases = None;
        }
        let cases = exemplars.relit_cases();
        let Exemplars { study, pose: shown_pose, calibrated, .. } = &*exemplars;
        let trial = trial.unwrap_or(*calibrated);
        let response = trial.response;
        let weights = study.weights(&response);
        let [subject_distance, ball_distance] = study.distances(&response, trial.exposure);
        Ok(GammaView {
            trial,
            calibrated: *calibrated,
            deviation: exemplars.deviation,
            cases,
            frame,
            poses: project.settings.shoot.poses.clone(),
            pose: *shown_pose,
            interview: (self.frame.as_ref()).map(|(_, shown)| shown.clone()).unwrap_or_default(),
            relit: SrgbPicture::reduced(&study.relit(&response, trial.exposure, &weights), PICTURE_PX),
            interview_histogram: *study.interview_histogram(),
            relit_histogram: study.relit_histogram(&response, trial.exposure, &weights),
            before_histogram: exemplars.before,
            subject_distance,
            ball_distance,
            surface: exemplars.surface.clone(),
            curves: exemplars.curves.clone(),
        })
    }
}

impl Exemplars {
    /// Reads the exemplars and fits the response, for the surface and the comparison of curves.
    fn read(project: &Project, progress: &Progress) -> Result<Self> {
        let calibration = Calibration::load(project)?;
        let study = GammaStudy::load(project, 0, progress)?;
        let (surface, curves) = {
            let fitted = study.fit(None, progress)?;
            (fitted.surface(SURFACE_STEPS, progress)?, fitted.compare(progress)?)
        };
        let plain = PROVISIONAL;
        let before = study.relit_histogram(&plain, 1.0, &study.weights(&plain));
        Ok(Self {
            calibrated: Trial { response: calibration.response, exposure: calibration.exposure },
            deviation: calibration.gamma_deviation,
            cases: calibration.gamma_evidence.open_cases().to_vec(),
            relit_cases: None,
            before,
            pose: 0,
            surface: Arc::new(surface),
            curves: Arc::new(curves),
            study,
        })
    }

    /// The chosen pose relit under each case.
    fn relit_cases(&mut self) -> Arc<Vec<(Case, SrgbPicture)>> {
        let (study, cases) = (&self.study, &self.cases);
        let relit = self.relit_cases.get_or_insert_with(|| {
            let picture = |case: &Case| {
                let Trial { response, exposure } = case.trial();
                let weights = study.weights(&response);
                let relit = study.relit(&response, exposure, &weights);
                (*case, SrgbPicture::reduced(&relit, PICTURE_PX))
            };
            Arc::new(cases.iter().map(picture).collect())
        });
        relit.clone()
    }
}

/// The average of all balls of the project, and their common circle; sentences if there is none.
///
/// # Errors
/// When a stop was requested.
fn find_circle(
    project: &Project,
    progress: &Progress,
) -> Result<std::result::Result<(Photographs, FoundCircle), String>> {
    let photographs = match Photographs::read(&project.probe_pictures(), progress) {
        Ok(photographs) => photographs,
        Err(stop @ Error::Cancelled { .. }) => return Err(stop),
        Err(refusal) => return Ok(Err(refusal.to_string())),
    };
    let found = silhouette::find(&photographs).map_err(|e| e.to_string());
    Ok(Ok((photographs, found)))
}

/// A circle to drag onto the ball, in the middle of a photograph of `width × height` pixels.
fn in_the_middle((width, height): (usize, usize)) -> Circle {
    Circle {
        center_px: [width, height].map(|side| 0.5 * side as f64),
        radius_px: (0.35 * width.min(height) as f64).max(silhouette::MIN_RADIUS_PX),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::{Raster, file};
    use project::{Ball, Shoot};

    #[test]
    fn a_ball_that_is_not_found_can_be_outlined_by_hand() {
        let folder = tempfile::tempdir().unwrap();
        let names = |name: &str| vec![name.to_owned()];
        let mut project = Project::without_shoot(folder.path());
        project.settings.shoot = Shoot {
            poses: names("pose00"),
            lamps: names("olat_00"),
            frames: names("frame_000").into(),
            ball: Ball::unknown(),
            ..project.settings.shoot
        };
        let mut study = CalibrationStudy::new(project.root.clone(), Control::default());
        let missing = study.probe(None, None).unwrap_err().to_string();
        assert!(missing.contains("project.toml"), "{missing}");
        project.save().unwrap();
        // A lamp in front of a wall as bright as the ball's reflections: the rim is invisible.
        for path in project.probe_pictures() {
            let picture = Raster::from_fn(96, 80, |x, y| {
                let lamp = x.abs_diff(40) < 3 && y.abs_diff(36) < 3;
                [if lamp { 0.9 } else { 0.1 }; 3]
            });
            file::write_png(path.file(), &Encoded(picture)).unwrap();
        }
        let view = study.probe(None, None).unwrap();
        assert!(view.found.is_err());
        assert_eq!(view.circle.center_px, [48.0, 40.0]);
        assert!(view.findings[0].contains("Drag the circle"), "{:?}", view.findings);
        let by_hand = Circle::new([47.0, 41.0], 36.0).unwrap();
        let view = study.probe(None, Some(by_hand)).unwrap();
        assert_eq!((view.circle, view.lamps.len()), (by_hand, 1));
        // A circle beside the photograph gives a sentence, and can be dragged back.
        let beside = Circle::new([90.0, 41.0], 12.0).unwrap();
        assert!(study.probe(None, Some(beside)).is_ok());
        assert!(study.probe(None, Some(by_hand)).is_ok());
    }
}

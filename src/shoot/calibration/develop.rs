//! Development of mirror-ball photographs into a light probe.

use super::light_probe::{
    BallCamera, BallView, ClippedLight, Exposure, Photograph, TwoBallsSettings, light_probe, merge, merge_balls,
};
use super::silhouette::{self, Circle, Photographs, Silhouette};
use base::error::{Error, Result};
use glam::Quat;
use imaging::picture::Coding;
use imaging::{Image, Response, file};
use light::Mapping;
use light::mapping::convert_turned;
use light::weights::rotation;
use serde::Serialize;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// Rows of the panorama before rotation and mapping.
pub const ROWS: RangeInclusive<usize> = 1..=4096;

/// One ball as seen by one camera.
#[derive(Clone, Debug)]
pub struct BallPictures {
    /// One photograph, or an exposure bracket from a fixed camera.
    pub photographs: Vec<PathBuf>,
    /// Exposures of the bracket in stops; empty for a single photograph.
    pub stops: Vec<f32>,
    /// Silhouette; `None` to detect it.
    pub circle: Option<Circle>,
}

/// Known facts about the camera.
#[derive(Clone, Copy, Debug)]
pub enum Lens {
    Camera(BallCamera),
    /// Field of view in degrees across the full width of the uncropped photographs.
    FieldOfView(f64),
}

/// Photographs of the ball, and settings for the panorama.
#[derive(Clone, Debug)]
pub struct DevelopSettings {
    pub ball: BallPictures,
    /// The ball from another side, and the angle of that camera to the right of the first, in degrees about the
    /// vertical.
    pub second: Option<(BallPictures, f32)>,
    pub lens: Lens,
    /// Camera response for pictures that are not linear.
    pub response: Response,
    /// Reflectance of the ball per channel.
    pub reflectivity: [f32; 3],
    pub clipped: ClippedLight,
    /// Yaw of the written panorama in degrees.
    pub yaw_deg: f32,
    pub mapping: Mapping,
    /// Rows of the written picture.
    pub height: usize,
    /// Layer of EXR photographs that have several; None for the finished picture.
    pub layer: Option<String>,
    /// The EXR to write.
    pub to: PathBuf,
}

/// Result of the development, with quality figures.
#[derive(Clone, Debug, Serialize)]
pub struct DevelopReport {
    pub written: PathBuf,
    pub size: (usize, usize),
    /// Silhouettes and the quality of their rims.
    pub balls: Vec<Silhouette>,
    /// Share of the sphere that no photograph shows, and share of the light filled in there.
    pub blind_share: f32,
    pub filled_share: f32,
    /// Clipped pixels of each ball, and the share of its light estimated for them.
    pub clipped_pixels: Vec<usize>,
    pub estimated_energy_share: Vec<f32>,
    /// Repaired pixels of each ball: NaN, infinite or negative.
    pub repaired_pixels: Vec<usize>,
    /// Disagreement in stops between each ball's given bracket exposures and its pictures.
    pub bracket_disagreement_stops: Vec<f32>,
    /// Brightness ratio of the second ball's photographs to the first, disagreement of the two in stops, and
    /// refinement of the angle between them in degrees.
    pub exposure_ratio: Option<f32>,
    pub disagreement_stops: Option<f32>,
    pub refined_deg: Option<f32>,
}

/// A ball with its photograph read and its silhouette found.
struct Ball {
    photograph: Photograph,
    view: BallView,
    silhouette: Silhouette,
    disagreement_stops: f32,
}

/// Makes a light probe from photographs and writes it.
///
/// # Errors
/// When a photograph cannot be read or shows no ball, or a value is out of range.
pub fn develop(settings: &DevelopSettings) -> Result<DevelopReport> {
    if !ROWS.contains(&settings.height) {
        return Err(Error::invalid(
            format!("light probe height of {} rows is outside {} to {}", settings.height, ROWS.start(), ROWS.end()),
            "Give a height such as 512",
        ));
    }
    let balls = settings.second.iter().map(|(ball, _)| ball).chain([&settings.ball]);
    for photograph in balls.flat_map(|ball| &ball.photographs) {
        imaging::picture::choose_layer(photograph, settings.layer.as_deref());
    }
    let first = Ball::read(&settings.ball, settings)?;
    let panorama_size = Mapping::LatLong.size(settings.height);
    let mut report = DevelopReport {
        written: settings.to.clone(),
        size: settings.mapping.size(settings.height),
        balls: vec![first.silhouette],
        blind_share: 0.0,
        filled_share: 0.0,
        clipped_pixels: Vec::new(),
        estimated_energy_share: Vec::new(),
        repaired_pixels: Vec::new(),
        bracket_disagreement_stops: vec![first.disagreement_stops],
        exposure_ratio: None,
        disagreement_stops: None,
        refined_deg: None,
    };
    let panorama = match &settings.second {
        None => {
            let probe = light_probe(&first.photograph, &first.view, settings.clipped, panorama_size)?;
            report.blind_share = probe.blind_share;
            report.filled_share = probe.filled_share;
            report.clipped_pixels = vec![probe.clipped_pixels];
            report.estimated_energy_share = vec![probe.estimated_energy_share];
            report.repaired_pixels = vec![probe.repaired_pixels];
            probe.panorama
        }
        Some((pictures, angle_deg)) => {
            let second = Ball::read(pictures, settings)?;
            report.balls.push(second.silhouette);
            report.bracket_disagreement_stops.push(second.disagreement_stops);
            let joined = merge_balls(
                [(&first.photograph, &first.view), (&second.photograph, &second.view)],
                Quat::from_rotation_y(angle_deg.to_radians()),
                &TwoBallsSettings { size: panorama_size, clipped: settings.clipped, ..TwoBallsSettings::default() },
            )?;
            report.blind_share = joined.blind_share;
            report.filled_share = joined.filled_share;
            report.clipped_pixels = joined.clipped_pixels.to_vec();
            report.estimated_energy_share = joined.estimated_energy_share.to_vec();
            report.repaired_pixels = joined.repaired_pixels.to_vec();
            report.exposure_ratio = Some(joined.exposure_ratio);
            report.disagreement_stops = Some(joined.disagreement_stops);
            report.refined_deg = Some(joined.refined_deg);
            joined.panorama
        }
    };
    file::write_exr(&settings.to, &mapped(&panorama, settings, report.size)?)?;
    Ok(report)
}

fn mapped(panorama: &Image, settings: &DevelopSettings, size: (usize, usize)) -> Result<Image> {
    // A yaw moves the content towards larger u, opposite to the right-handed rotation about +Y.
    let turn = rotation(settings.yaw_deg, 0.0, 0.0);
    let converted = convert_turned(panorama, Mapping::LatLong, settings.mapping, size, turn)?;
    Ok(converted.image)
}

impl Ball {
    fn read(pictures: &BallPictures, settings: &DevelopSettings) -> Result<Self> {
        let paths = &pictures.photographs;
        let bracket = paths.len() > 1;
        if paths.is_empty() || (bracket && pictures.stops.len() != paths.len()) {
            return Err(Error::invalid(
                format!(
                    "{} photographs of the mirror ball but {} exposures: needs one photograph, or a bracket \
                     with an exposure in stops for each",
                    paths.len(),
                    pictures.stops.len()
                ),
                "Give one exposure for each photograph, in the same order, such as --stops 0,-2,-4",
            ));
        }
        let read = paths.iter().map(|path| photograph(path, &settings.response)).collect::<Result<Vec<_>>>()?;
        let (photograph, disagreement_stops) = if bracket {
            let exposures: Vec<Exposure> =
                (read.iter().zip(&pictures.stops)).map(|(photograph, &stops)| Exposure { photograph, stops }).collect();
            let merged = merge(&exposures)?;
            (merged.photograph, merged.disagreement_stops)
        } else {
            (read[0].clone(), 0.0)
        };
        // Light is encoded first, because the rim stands out in encoded values.
        let codes = |place: usize| settings.response.encode(&read[place].light);
        let mut seen = Photographs::one(paths[0].display(), &codes(0))?;
        for (place, path) in paths.iter().enumerate().skip(1) {
            seen.add(path.display(), &codes(place))?;
        }
        let silhouette = match pictures.circle {
            Some(circle) => silhouette::measure(&seen, &circle)?,
            None => silhouette::find(&seen)?,
        };
        Ok(Self {
            view: BallView {
                centre_px: silhouette.circle.center_px,
                radius_px: silhouette.circle.radius_px,
                camera: match settings.lens {
                    Lens::Camera(camera) => camera,
                    Lens::FieldOfView(degrees) => {
                        BallCamera::FieldOfView { degrees, frame_px: photograph.size().0 as f64 }
                    }
                },
                surroundings_radii: None,
                reflectivity: settings.reflectivity,
            },
            photograph,
            silhouette,
            disagreement_stops,
        })
    }
}

/// Light as the file holds it, or codes as the camera encoded them.
fn photograph(path: &Path, response: &Response) -> Result<Photograph> {
    let picture = imaging::picture::read(path)?;
    Ok(match picture.about.coding {
        Coding::Light(_) => Photograph::from_linear(picture.into_light(), None),
        Coding::Named(_) | Coding::Open => Photograph::from_encoded(&picture.into_encoded(), response),
    })
}

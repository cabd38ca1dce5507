//! Methods without a network: the nearest pose of the OLAT session, unchanged or times a ratio.

use super::accuracy::Method;
use super::harmonics::low_order_olats;
use base::error::{Error, Result};
use calibration::Calibration;
use footage::{Exemplar, Frame};
use imaging::{Image, Mask};
use project::Project;
use reflectance::ReflectanceField;

/// Poses that supply the OLATs of frames.
pub struct Nearest {
    poses: Vec<Pose>,
    /// True to multiply the OLATs by frame / pose.
    ratio: bool,
}

impl Nearest {
    /// Reads the poses for a method without a network; None for other methods.
    ///
    /// # Errors
    /// When a picture cannot be read.
    pub fn new(method: Method, project: &Project, calibration: &Calibration) -> Result<Option<Self>> {
        let ratio = match method {
            Method::Nearest => false,
            Method::Ratio | Method::Harmonics => true,
            Method::Prediction
            | Method::Transfer
            | Method::Network
            | Method::TruthOlats
            | Method::Texler
            | Method::Sun => return Ok(None),
        };
        let mut poses = Pose::load_all(project, calibration)?;
        if method == Method::Harmonics {
            for pose in &mut poses {
                pose.exemplar.olats = low_order_olats(&pose.exemplar.olats, &calibration.rig);
            }
        }
        Ok(Some(Self { poses, ratio }))
    }

    /// OLATs of a frame.
    ///
    /// # Errors
    /// When there is no pose.
    pub fn field(&self, frame: &Frame) -> Result<ReflectanceField> {
        let pose = nearest(&self.poses, frame)?;
        Ok(if self.ratio { pose.ratio_field(&frame.plate) } else { ReflectanceField::from_olats(&pose.exemplar.olats) })
    }
}

/// A pose of the OLAT session, and its picture under the interview's light.
struct Pose {
    exemplar: Exemplar,
    interview: Image,
    encoded_plate: Image,
}

impl Pose {
    fn load_all(project: &Project, calibration: &Calibration) -> Result<Vec<Self>> {
        let light = calibration.interview_light();
        let exemplars = Exemplar::load_all(project, &calibration.response)?;
        exemplars
            .into_iter()
            .map(|exemplar| {
                let interview = exemplar.relit_by_all(project, &calibration.response, &light)?;
                Ok(Self { encoded_plate: encoded_plate(&interview, &exemplar.mask), interview, exemplar })
            })
            .collect()
    }

    /// OLATs times frame / pose, both under the interview's light. The offset, a thousandth of white,
    /// keeps the quotient finite in the dark.
    fn ratio_field(&self, plate: &Image) -> ReflectanceField {
        let quotient = |i: usize| -> [f32; 3] {
            std::array::from_fn(|c| plate.pixels[i][c] / (self.interview.pixels[i][c] + 1e-3))
        };
        let times = |olat: &Image| Image {
            pixels: olat
                .pixels
                .iter()
                .enumerate()
                .map(|(i, pixel)| {
                    let q = quotient(i);
                    std::array::from_fn(|c| pixel[c] * q[c])
                })
                .collect(),
            ..*olat
        };
        ReflectanceField::from_olats(&self.exemplar.olats.iter().map(times).collect::<Vec<_>>())
    }
}

/// The pose whose picture under the interview's light has the smallest square error from the frame.
fn nearest<'a>(poses: &'a [Pose], frame: &Frame) -> Result<&'a Pose> {
    let there = encoded_plate(&frame.plate, &frame.mask);
    let distance = |pose: &Pose| -> f64 {
        let pairs = pose.encoded_plate.pixels.iter().flatten().zip(there.pixels.iter().flatten());
        pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum()
    };
    poses
        .iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
        .ok_or_else(|| Error::missing("the shoot has no pose of the OLAT session", "Import the shoot again"))
}

/// Encoded, with a finite slope at black, and cut out by the matte.
fn encoded_plate(linear: &Image, mask: &Mask) -> Image {
    let encode = |v: f32| (v.max(0.0) + 0.01).powf(1.0 / 2.2) - 0.01f32.powf(1.0 / 2.2);
    let pixels = linear.pixels.iter().zip(&mask.pixels).map(|(p, alpha)| p.map(|v| encode(v) * alpha)).collect();
    Image { width: linear.width, height: linear.height, pixels }
}

//! The two descriptions beside the pictures: the manifest, for everyone who uses the shoot, and the truth, only for
//! evaluation.

use super::ball::{BALL_RADIUS_M, ball_radius_px};
use super::camera;
use super::dome::{Dome, LAMP_RADIUS_M, RADIUS_M};
use super::motion::{FRAME_RATE, Pose};
use super::panel::Panel;
use super::trouble::Trouble;
use imaging::Response;
use serde::{Serialize, Serializer};
use std::collections::BTreeMap;

/// `manifest.json`. Paths are relative to it.
#[derive(Serialize)]
pub struct Manifest {
    name: &'static str,
    resolution: [usize; 2],
    frames: usize,
    frame_rate: f64,
    exemplar_poses: usize,
    olat_conditions: usize,
    coordinates: &'static str,
    camera: Camera,
    dome_radius_m: f32,
    lamps_total: usize,
    lamp_disc_radius_m: f32,
    bank_directions: Vec<[f32; 3]>,
    bank_lamp_counts: Vec<usize>,
    lamp_directions: Vec<[f32; 3]>,
    lamp_bank: Vec<usize>,
    probes: Probes,
    panorama_convention: &'static str,
    hdris: Vec<Hdri>,
    files: BTreeMap<&'static str, &'static str>,
    response_form: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    tracking: Option<Tracking>,
}

/// Pictures of the fully lit subject, taken between the lamps.
#[derive(Serialize)]
pub struct Tracking {
    pub files: &'static str,
    /// Number of the lamp that follows each picture; the number of lamps for the last one.
    pub before_lamp: Vec<usize>,
}

#[derive(Serialize)]
struct Camera {
    position: [f32; 3],
    looks_at: [f32; 3],
    frame_height_m_at_subject: f32,
    vertical_fov_deg: f64,
}

#[derive(Serialize)]
struct Probes {
    resolution: [usize; 2],
    ball_center_px: [f64; 2],
    ball_radius_px: f64,
    ball_radius_m: f32,
    note: &'static str,
}

#[derive(Serialize)]
struct Hdri {
    name: String,
    file: String,
}

impl Manifest {
    /// Description of a shoot of `size` pixels with these frames and poses.
    pub fn new(
        dome: &Dome,
        size: usize,
        frames: usize,
        poses: usize,
        environments: &[&str],
        tracking: Option<Tracking>,
    ) -> Self {
        Self {
            name: "virtual stage",
            resolution: [size; 2],
            frames,
            frame_rate: FRAME_RATE,
            exemplar_poses: poses,
            olat_conditions: dome.banks.len(),
            coordinates: "right handed; +x right in the image, +y up, +z from subject to camera; light direction = unit vector from subject to bank centre",
            camera: Camera {
                position: camera::POSITION.to_array(),
                looks_at: [0.0; 3],
                frame_height_m_at_subject: camera::FRAME_HEIGHT_M,
                vertical_fov_deg: camera::field_of_view_deg(),
            },
            dome_radius_m: RADIUS_M,
            lamps_total: dome.lamps.len(),
            lamp_disc_radius_m: LAMP_RADIUS_M,
            bank_directions: dome.banks.iter().map(|d| d.to_array()).collect(),
            bank_lamp_counts: dome.bank_counts(),
            lamp_directions: dome.lamps.iter().map(|d| d.to_array()).collect(),
            lamp_bank: dome.bank_of_lamp.clone(),
            probes: Probes {
                resolution: [size; 2],
                ball_center_px: [size as f64 / 2.0; 2],
                ball_radius_px: ball_radius_px(size),
                ball_radius_m: BALL_RADIUS_M,
                note: "same camera and response; all probe photos (interview and OLAT) share ONE neutral density relative to the interview/OLAT images of the subject; not clipped",
            },
            panorama_convention: "equirect: u=0.5 (centre column) is -z (what the camera looks at behind the subject), u=0.75 is +x (image right), v=0 is +y up; d=(sin(phi)sin(th),cos(th),-cos(phi)sin(th)), phi=2pi(u-0.5), th=pi v",
            hdris: environments
                .iter()
                .map(|name| Hdri { name: (*name).to_owned(), file: format!("environments/{name}.exr") })
                .collect(),
            files: BTreeMap::from([
                ("exemplars", "exemplars/poseNN/olat_BB.png (8 bit, encoded, black background)"),
                ("masks", "exemplar_masks/poseNN.png, interview_masks/frame_NNN.png (8 bit linear alpha)"),
                ("interview", "interview/frame_NNN.png (8 bit encoded, green screen)"),
                ("probes", "probes/interview.png, probes/olat_BB.png"),
            ]),
            response_form: "linear = (1-I)*I^g1 + I*I^g2 for encoded I in 0..1 (g1,g2 unknown to the user; see truth.json)",
            tracking,
        }
    }
}

/// `truth.json`: reference for calibration and relighting.
#[derive(Serialize)]
pub struct Truth {
    pub g1: f32,
    pub g2: f32,
    /// Factor from radiance units to linear values of the interview's pictures.
    pub exposure_interview: f32,
    /// Factor from radiance units to linear values of the OLATs.
    pub exposure_olat: f32,
    pub probe_neutral_density: f32,
    pub probe_ambient_linear: f32,
    pub noise: &'static str,
    pub interview_kind: &'static str,
    pub weights_linear_interview_per_olat: Vec<[f32; 3]>,
    pub weights_note: &'static str,
    pub bank_weights_unit_radiance: Vec<[f32; 3]>,
    pub interview_lamp_weights: Vec<[f32; 3]>,
    /// Mean radiance that falls on each bank's lamps, per environment.
    pub hdri_bank_weights: BTreeMap<String, Vec<[f32; 3]>>,
    pub hdri_note: &'static str,
    pub poses: Vec<Pose>,
    pub frames: Vec<Pose>,
    pub truth_frames: Vec<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trouble: Option<TroubleTruth>,
}

/// Truth of a shoot with trouble.
#[derive(Serialize)]
pub struct TroubleTruth {
    /// Settings and the values drawn for those left open.
    #[serde(flatten)]
    pub trouble: Trouble,
    /// Response of the camera. `g1` and `g2` are the nearest dual gamma, at this distance: the root mean square
    /// difference of encoded values.
    #[serde(serialize_with = "told")]
    pub response: Response,
    pub response_distance: f32,
    /// The interview's lamps outside the stage, in metres; radiance in units of `bank_weights_unit_radiance`.
    pub panels: Vec<Panel>,
    /// Share of the interview's picture that no sum of the banks with non-negative weights explains (root mean square,
    /// on the subject in the first frame of `truth_frames`), and the weights of the nearest sum, linear interview per
    /// OLAT.
    pub off_span: f32,
    pub nearest_sum_linear_interview_per_olat: Vec<[f32; 3]>,
    /// Offset of the face from its place in the pose's matte and truth, per pose and lamp, in pixels right and down;
    /// empty if the subject sat still.
    pub sway_px: Vec<Vec<[f32; 2]>>,
}

/// A response as in its own files, except a log curve, which is given by K alone: `{"log": 30}`.
fn told<S: Serializer>(response: &Response, serializer: S) -> Result<S::Ok, S::Error> {
    match response {
        Response::Log(k) => BTreeMap::from([("log", k)]).serialize(serializer),
        other => other.serialize(serializer),
    }
}

/// Text of `noise`.
pub const NOISE: &str = "sigma_lin = 0.003*sqrt(L)+5e-5, before encoding and 8-bit rounding";
/// Text of `interview_kind`.
pub const INTERVIEW_KIND: &str = "exact: interview = sum_b weights_b * bank_b";
/// Text of `interview_kind` of other light.
pub const OTHER_INTERVIEW_KIND: &str =
    "other light: weights_b is what falls to the bank nearest to each of its directions";
/// Text of `weights_note`.
pub const WEIGHTS_NOTE: &str = "decode(interview subject image) = sum_b weights_b * decode(olat_b) on the subject; the same weights hold between the probe photos";
/// Text of `hdri_note`.
pub const HDRI_NOTE: &str = "truth/*_relit_<name>.exr = linear, every lamp weighted with the mean radiance of the env over its share of the sphere; sum_b hdri_bank_weights*bank_b approximates it. Truth EXRs are in unit-radiance units: decode(olat PNG) = exposure_olat * truth OLAT";

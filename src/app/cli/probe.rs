//! `afterlight probe`.

use super::OutputArgs;
use super::parse::parse_shares;
use base::numbers::{ANGLES, within};
use calibration::Circle;
use calibration::develop::{BallPictures, DevelopSettings, Lens, ROWS};
use calibration::light_probe::{BallCamera, ClippedLight};
use clap::Args;
use imaging::Response;
use light::Mapping;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use worker::Job;

/// Range of exposures relative to another, in stops.
const STOPS: RangeInclusive<f32> = -40.0..=40.0;

/// Make a light probe, a panorama of the light, from photographs of a mirror ball.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: afterlight probe ball_0.png ball_2.png ball_4.png --stops 0,-2,-4 --fov 20 --to light.exr"
)]
pub struct ProbeArgs {
    /// The ball's photograph, or an exposure bracket. EXR and HDR are linear; --gamma applies to other formats.
    #[arg(required = true)]
    photographs: Vec<PathBuf>,
    /// Exposures of the photographs in stops, in the same order.
    #[arg(long, value_delimiter = ',', allow_negative_numbers = true, value_parser = within(STOPS))]
    stops: Vec<f32>,
    /// The ball's centre and radius in pixels [default: found in the photographs].
    #[arg(long, value_name = "X,Y,RADIUS")]
    circle: Option<Circle>,
    /// Photographs of the same ball from another side, to fill in what the first one hides.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    second: Vec<PathBuf>,
    /// Exposures of those photographs in stops.
    #[arg(
        long,
        value_delimiter = ',',
        allow_negative_numbers = true,
        value_parser = within(STOPS),
        requires = "second"
    )]
    second_stops: Vec<f32>,
    /// Angle from the first camera to the second, positive to the right, seen from the ball.
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 90.0,
        allow_negative_numbers = true,
        value_parser = within(-180.0f32..=180.0)
    )]
    second_angle: f32,
    /// The camera's horizontal field of view [default: a distant camera].
    #[arg(long, value_name = "DEG", group = "lens", allow_negative_numbers = true, value_parser = within(0.1f64..=179.0))]
    fov: Option<f64>,
    /// The camera's focal length in pixels.
    #[arg(long, value_name = "PIXELS", group = "lens", allow_negative_numbers = true, value_parser = within(1.0f64..=1e7))]
    focal_length: Option<f64>,
    /// The camera's distance from the ball's centre, in ball radii.
    #[arg(long, value_name = "RADII", group = "lens", allow_negative_numbers = true, value_parser = within(1.01f64..=1e6))]
    distance: Option<f64>,
    /// The camera's response: one or two exponents, srgb, rec709, linear, or log,K.
    #[arg(long, value_name = "RESPONSE", default_value = "2.2,2.2")]
    gamma: Response,
    /// The share of light that the ball reflects, in red, green and blue.
    #[arg(long, value_name = "R,G,B", default_value = "1,1,1", value_parser = parse_shares)]
    reflectivity: [f32; 3],
    /// Estimate clipped light from its surroundings; otherwise clipped pixels are only counted.
    #[arg(long)]
    estimate_clipped: bool,
    /// Turn the light probe; positive moves its front to camera-right.
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true,
        value_parser = within(ANGLES)
    )]
    yaw: f32,
    /// Layout of the sphere in the picture.
    #[arg(long, value_enum, default_value = "lat-long")]
    mapping: Mapping,
    /// Layer of EXR photographs that have several [default: the finished picture].
    #[arg(long, value_name = "NAME")]
    layer: Option<String>,
    /// Rows of the picture.
    #[arg(long, default_value_t = 512, allow_negative_numbers = true, value_parser = within(ROWS))]
    height: usize,
    /// The EXR to write.
    #[arg(long, value_name = "FILE.exr")]
    to: PathBuf,
    #[command(flatten)]
    pub output: OutputArgs,
}

impl ProbeArgs {
    /// The requested job.
    pub fn job(&self) -> Job {
        let camera = match (self.fov, self.focal_length, self.distance) {
            (Some(degrees), ..) => Lens::FieldOfView(degrees),
            (_, Some(px), _) => Lens::Camera(BallCamera::FocalLength { px }),
            (.., Some(ball_radii)) => Lens::Camera(BallCamera::Distance { ball_radii }),
            _ => Lens::Camera(BallCamera::Far),
        };
        let second = BallPictures { photographs: self.second.clone(), stops: self.second_stops.clone(), circle: None };
        Job::Develop {
            settings: Box::new(DevelopSettings {
                ball: BallPictures {
                    photographs: self.photographs.clone(),
                    stops: self.stops.clone(),
                    circle: self.circle,
                },
                second: (!self.second.is_empty()).then_some((second, self.second_angle)),
                lens: camera,
                response: self.gamma,
                reflectivity: self.reflectivity,
                clipped: if self.estimate_clipped { ClippedLight::Estimate } else { ClippedLight::Keep },
                yaw_deg: self.yaw,
                mapping: self.mapping,
                height: self.height,
                layer: self.layer.clone(),
                to: self.to.clone(),
            }),
        }
    }
}

//! Simple sitters that represent any subject: the share of the light from each direction that a pixel sends to the
//! camera.
//!
//! Weights must get the common traits of subjects right: the camera on +Z sees one side, light at grazing angles
//! falls off by the cosine, nose, chin and shoulders cast shadows with edges, and skin shines. A bust of ellipsoids
//! in three poses has the large shadows in realistic places. A ball with a crease at every point has small shadows
//! everywhere. Each is matt and light or shiny and dark.

use super::points::points;
use glam::{DMat3, DVec3};
use std::f64::consts::{PI, TAU};
use std::sync::OnceLock;

/// A picture of one subject with one finish: per pixel the radiance towards the camera for a radiance of 1 from a
/// steradian around each of [`points`]; zero entries are omitted.
pub(super) struct Sitter {
    pub pixels: Vec<Vec<(u16, f32)>>,
}

/// Reflectance of a surface.
#[derive(Clone, Copy)]
struct Finish {
    /// Diffuse reflectance.
    albedo: f64,
    /// Mirror reflectance face-on.
    mirror: f64,
    /// Width of the highlight: the α of the GGX distribution.
    roughness: f64,
}

/// Skin is between these two.
const FINISHES: [Finish; 2] =
    [Finish { albedo: 0.5, mirror: 0.0, roughness: 1.0 }, Finish { albedo: 0.08, mirror: 0.035, roughness: 0.2 }];

/// A point visible to the camera, and its visible directions.
struct Place {
    normal: DVec3,
    open: Box<dyn Fn(DVec3) -> f64>,
}

/// All sitters; made on first use and cached.
pub(super) fn sitters() -> &'static [Sitter] {
    static MADE: OnceLock<Vec<Sitter>> = OnceLock::new();
    MADE.get_or_init(|| {
        let directions = points();
        [bust(), creased_ball()]
            .iter()
            .flat_map(|places| FINISHES.map(|finish| sitter(places, finish, &directions)))
            .collect()
    })
}

fn sitter(places: &[Place], finish: Finish, directions: &[DVec3]) -> Sitter {
    // Subdirections around each direction, so that a shadow's edge between two directions partly covers each.
    const ABOUT: usize = 7;
    let reach = (4.0 / directions.len() as f64).sqrt();
    let about = |direction: DVec3| -> [DVec3; ABOUT] {
        let (across, up) = direction.any_orthonormal_pair();
        std::array::from_fn(|i| {
            let (sin, cos) = (TAU * i as f64 / 6.0).sin_cos();
            let off = if i == 6 { 0.0 } else { 0.7 * reach };
            (direction + off * (cos * across + sin * up)).normalize()
        })
    };
    // Single-threaded: a pool thread that waits here could be given work that waits for this result.
    let pixels = places.iter().map(|place| {
        let seen = directions.iter().enumerate().map(|(i, direction)| {
            let light = about(*direction).map(|light| {
                let facing = place.normal.dot(light);
                if facing <= 0.0 {
                    return 0.0;
                }
                (place.open)(light) * finish.reflected(place.normal, light)
            });
            (i as u16, (light.iter().sum::<f64>() / ABOUT as f64) as f32)
        });
        seen.filter(|(_, radiance)| *radiance > 0.0).collect()
    });
    Sitter { pixels: pixels.collect() }
}

impl Finish {
    /// Radiance towards the camera for light facing the surface: Lambert's law, and a microfacet highlight (GGX
    /// with Smith's height-correlated shadowing and Schlick's Fresnel, Heitz 2014).
    fn reflected(&self, normal: DVec3, light: DVec3) -> f64 {
        let facing = normal.dot(light);
        let diffuse = self.albedo / PI * facing;
        if self.mirror == 0.0 {
            return diffuse;
        }
        let half = (light + DVec3::Z).normalize_or(normal);
        let (nh, vh) = (normal.dot(half), half.z.max(0.0));
        let alpha2 = self.roughness * self.roughness;
        let spread = nh * nh * (alpha2 - 1.0) + 1.0;
        let facets = alpha2 / (PI * spread * spread);
        let seen = normal.z.max(0.02);
        let smith = |a: f64, b: f64| a * (b * b * (1.0 - alpha2) + alpha2).sqrt();
        let shadowing = 0.5 / (smith(facing, seen) + smith(seen, facing)).max(1e-6);
        let fresnel = self.mirror + (1.0 - self.mirror) * (1.0 - vh).powi(5);
        diffuse + facets * shadowing * fresnel * facing
    }
}

/// Points spread over the camera's half of a ball, each at the foot of a wall that hides part of its sky.
fn creased_ball() -> Vec<Place> {
    const POINTS: usize = 200;
    // Steps of the R2 sequence (Roberts 2018), which fills a square evenly.
    const STEPS: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053];
    (0..POINTS)
        .map(|i| {
            let (radius, turn) = (((i as f64 + 0.5) / POINTS as f64).sqrt(), 2.399_963_229_728_653 * i as f64);
            let normal = DVec3::new(radius * turn.cos(), radius * turn.sin(), (1.0 - radius * radius).sqrt());
            let [turn, lean] = STEPS.map(|step| (step * i as f64).fract());
            let (across, up) = normal.any_orthonormal_pair();
            let (sin, cos) = (TAU * turn).sin_cos();
            let lean = (60.0 + 50.0 * lean).to_radians();
            let wall = lean.cos() * normal + lean.sin() * (cos * across + sin * up);
            Place { normal, open: Box::new(move |light| f64::from(u8::from(wall.dot(light) > 0.0))) }
        })
        .collect()
}

/// An ellipsoid: its centre and half axes in metres.
type Part = ([f64; 3], [f64; 3]);

/// Parts of the head, relative to the point between the ears.
const HEAD: [Part; 8] = [
    ([0.0, 0.0, 0.0], [0.075, 0.105, 0.095]),
    ([0.0, -0.075, 0.035], [0.045, 0.045, 0.050]),
    ([0.0, -0.020, 0.100], [0.013, 0.030, 0.020]),
    ([0.0, 0.027, 0.083], [0.050, 0.010, 0.015]),
    ([0.040, -0.030, 0.065], [0.025, 0.025, 0.022]),
    ([-0.040, -0.030, 0.065], [0.025, 0.025, 0.022]),
    ([0.077, -0.010, -0.010], [0.012, 0.030, 0.020]),
    ([-0.077, -0.010, -0.010], [0.012, 0.030, 0.020]),
];
/// Neck and shoulders.
const TRUNK: [Part; 2] =
    [([0.0, -0.160, -0.020], [0.055, 0.100, 0.055]), ([0.0, -0.285, -0.030], [0.215, 0.100, 0.100])];
/// Rotations of the head in degrees: to the side, and down.
const POSES: [[f64; 2]; 3] = [[-23.0, 0.0], [0.0, -9.0], [20.0, 6.0]];

/// An ellipsoid as a unit ball in its own axes.
#[derive(Clone, Copy)]
struct Ellipsoid {
    centre: DVec3,
    ball_from_world: DMat3,
}

impl Ellipsoid {
    /// The t at which the ray `origin + t · direction` enters the ellipsoid, if it does.
    fn entry(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let (o, d) = (self.ball_from_world * (origin - self.centre), self.ball_from_world * direction);
        let (a, b, c) = (d.length_squared(), o.dot(d), o.length_squared() - 1.0);
        let inside = b * b - a * c;
        (inside > 0.0).then(|| (-b - inside.sqrt()) / a)
    }

    fn normal(&self, place: DVec3) -> DVec3 {
        let gradient = self.ball_from_world * (place - self.centre);
        (self.ball_from_world.transpose() * gradient).normalize()
    }
}

/// Points of a bust on a grid of the picture, in each of its poses.
fn bust() -> Vec<Place> {
    const ACROSS: usize = 16;
    const FRAME_M: f64 = 0.44;
    const MIDDLE_M: f64 = -0.03;
    let mut places = Vec::new();
    for [yaw, pitch] in POSES {
        let turn = DMat3::from_rotation_y(yaw.to_radians()) * DMat3::from_rotation_x(pitch.to_radians());
        let part = |&(centre, axes): &Part, turn: DMat3| Ellipsoid {
            centre: turn * DVec3::from(centre),
            ball_from_world: DMat3::from_diagonal(DVec3::from(axes).recip()) * turn.transpose(),
        };
        let head = HEAD.iter().map(|p| part(p, turn));
        let parts: Vec<Ellipsoid> = head.chain(TRUNK.iter().map(|p| part(p, DMat3::IDENTITY))).collect();
        for i in 0..ACROSS * ACROSS {
            let along = |i: usize| ((i as f64 + 0.5) / ACROSS as f64 - 0.5) * FRAME_M;
            let origin = DVec3::new(along(i % ACROSS), MIDDLE_M - along(i / ACROSS), 1.0);
            let hits = parts.iter().filter_map(|part| Some((part.entry(origin, DVec3::NEG_Z)?, part)));
            let Some((depth, part)) = hits.min_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
            let place = origin + depth * DVec3::NEG_Z;
            let normal = part.normal(place);
            let start = place + 0.002 * normal;
            let parts = parts.clone();
            places.push(Place {
                normal,
                // A ray that starts inside another part, where two join, leaves it freely.
                open: Box::new(move |light| {
                    let hidden = parts.iter().any(|part| part.entry(start, light).is_some_and(|t| t > 0.0));
                    f64::from(u8::from(!hidden))
                }),
            });
        }
    }
    places
}

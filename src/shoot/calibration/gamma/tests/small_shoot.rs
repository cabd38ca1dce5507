//! A small shoot of a spotted ball with known camera and light.

use super::super::*;
use glam::Vec3;
use imaging::{Image, Mask, Response, file};
use project::{Ball, Project, Settings, Shoot};
use std::path::{Path, PathBuf};

const SIZE: usize = 96;

/// Settings of a small shoot of a spotted ball.
#[derive(Clone, Copy)]
pub struct SmallShoot {
    pub response: Response,
    /// Exposure of the interview's camera relative to the OLATs'.
    pub exposure: f32,
    /// Rotation of the frames' heads relative to the poses', in radians.
    pub turn: f32,
    /// Ambient light on the subject under each lamp, relative to the lamp.
    pub fill: f32,
    /// Reflectance of the darkest spot, relative to the brightest.
    pub darkest_spot: f32,
    /// Brightness of subject and balls.
    pub subject: f32,
    pub ball: f32,
    /// True if a lamp's image on the ball is a disc of constant level.
    pub flat: bool,
    /// Brightness of a warm window that also lights the interview, relative to all lamps.
    pub window: f32,
    /// Reflectance of the subject for red, green and blue.
    pub skin: [f32; 3],
    /// Sensor noise relative to the virtual stage's.
    pub noise: f32,
    pub seed: u32,
}

pub fn dual(gamma1: f32, gamma2: f32) -> Response {
    Response::Dual(DualGamma { gamma1, gamma2 })
}

impl Default for SmallShoot {
    fn default() -> Self {
        Self {
            response: dual(2.5, 1.9),
            exposure: 1.0,
            turn: 0.05,
            fill: 0.004,
            darkest_spot: 0.2,
            subject: 0.25,
            ball: 0.8,
            flat: false,
            window: 0.0,
            skin: [0.9, 0.8, 0.8],
            noise: 1.0,
            seed: 1,
        }
    }
}

/// Directions of a small dome and the brightness of each lamp during the interview.
fn dome() -> Vec<(Vec3, f32)> {
    (0..14)
        .map(|i| {
            let (y, turn) = (0.95 - 0.125 * i as f32, i as f32 * 2.399_963);
            let across = (1.0 - y * y).sqrt();
            let direction = Vec3::new(across * turn.sin(), y, across * turn.cos());
            (direction, 0.1 + 0.05 * ((i * 5) % 7) as f32)
        })
        .collect()
}

impl SmallShoot {
    pub fn project(&self, root: &Path) -> Project {
        let ball = Ball { center_px: [48.0, 48.0], radius_px: 42.0, radius_m: 0.075, camera_distance_m: 4.0 };
        let names = |what: &str, n: usize| (0..n).map(|i| format!("{what}{i:02}")).collect::<Vec<_>>();
        Project {
            root: root.to_path_buf(),
            results: None,
            settings: Settings {
                format: project::FORMAT,
                name: "small".into(),
                size: 32,
                seed: 1,
                shoot: Shoot {
                    folder: PathBuf::from("shoot"),
                    frame_rate: 25.0,
                    without_balls: false,
                    layer: None,
                    corrections: project::Corrections::default(),
                    poses: names("pose", 4),
                    lamps: names("olat_", dome().len()),
                    other_lamps: vec![],
                    frames: names("frame_", 4).into(),
                    damaged_frames: Default::default(),
                    takes: Default::default(),
                    ball,
                    second_ball: None,
                    dome_radius_m: None,
                    environments: vec![],
                    lamp_layout: vec![],
                },
                environments: vec![],
                color_config: None,
                framing: Default::default(),
            },
        }
    }

    /// Writes the shoot into `root` and returns its project.
    pub fn shoot(&self, root: &Path) -> Project {
        let project = self.project(root);
        let (ball, lamps) = (project.settings.shoot.ball, dome());
        let mut seed = self.seed.wrapping_mul(2_654_435_761);
        let mut even = move || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / 16_777_216.0 - 0.5
        };
        // Sensor noise as on the virtual stage (four uniform draws are near enough to a Gaussian), then eight bits.
        let mut write = |picture: project::Picture, light: &Image| {
            let noisy = light.map(|pixel| {
                pixel.map(|l| {
                    let draw = 3f32.sqrt() * (even() + even() + even() + even());
                    (l + self.noise * (0.003 * l.sqrt() + 5e-5) * draw).max(0.0)
                })
            });
            file::write_png(picture.file(), &self.response.encode(&noisy)).unwrap();
        };
        let sum = |pictures: &[Image], exposure: f32| {
            let mut sum = Image::filled(SIZE, SIZE, [0.0; 3]);
            for (picture, (_, weight)) in pictures.iter().zip(&lamps) {
                for (s, p) in sum.pixels.iter_mut().zip(&picture.pixels) {
                    *s = [0, 1, 2].map(|c| s[c] + exposure * weight * p[c]);
                }
            }
            sum
        };
        let geometry = crate::mirror_ball::MirrorBall::new(&ball, None, (SIZE, SIZE)).unwrap();
        let probes: Vec<Image> = lamps
            .iter()
            .map(|(direction, _)| {
                let mut picture = Image::filled(SIZE, SIZE, [0.0002; 3]);
                for pixel in &geometry.pixels {
                    let away = (1.0 - pixel.direction.dot(*direction)) / 0.01;
                    let glow = if self.flat { f32::from(away < 1.0) } else { (-away).exp() };
                    picture.pixels[pixel.index] = [1.0, 0.9, 0.7].map(|c| self.ball * c * glow + 0.0002);
                }
                picture
            })
            .collect();
        // Light of the window in the interview: a uniform bright patch on the ball, and light from many directions
        // within it on the subject.
        const WARM: [f32; 3] = [1.3, 1.0, 0.6];
        let (to_window, reach) = (Vec3::new(-0.6, 0.35, 0.72).normalize(), 0.12f32);
        let all: f32 = lamps.iter().map(|(_, weight)| weight).sum();
        let panes: Vec<Vec3> = (0..40)
            .map(|i| {
                let (away, turn) = (reach * (i as f32 + 0.5) / 40.0, i as f32 * 2.399_963);
                let (side, up) = to_window.any_orthonormal_pair();
                let across = (1.0 - (1.0 - away).powi(2)).sqrt();
                (1.0 - away) * to_window + across * (turn.cos() * side + turn.sin() * up)
            })
            .collect();
        let mut interview = sum(&probes, 1.0);
        for pixel in &geometry.pixels {
            if 1.0 - pixel.direction.dot(to_window) < reach {
                // A lamp's image has the energy of a disc of its peak with 1 − cos = 0.01.
                let level = self.window * all * self.ball * 0.01 / reach;
                let light = &mut interview.pixels[pixel.index];
                *light = [0, 1, 2].map(|c| light[c] + level * WARM[c] * [1.0, 0.9, 0.7][c]);
            }
        }
        write(project.interview_probe_picture(), &interview);
        for (i, probe) in probes.iter().enumerate() {
            write(project.lamp_probe_picture(i), probe);
        }
        let subject = |turn: f32, direction: Vec3| {
            Image::from_fn(SIZE, SIZE, |x, y| {
                let (dx, dy) = ((x as f32 - 47.5) / 44.0, (47.5 - y as f32) / 44.0);
                let n = Vec3::new(dx, dy, (1.0 - dx * dx - dy * dy).max(0.0).sqrt());
                let spots = 0.5 + 0.5 * (9.0 * (n.x + turn)).sin() * (7.0 * n.y).cos();
                let light = self.subject * n.dot(direction).max(0.0) + self.fill;
                let [red, green, blue] = self.skin;
                [red, green * (0.75 + 0.25 * spots), blue * (0.375 + 0.625 * spots)]
                    .map(|albedo| albedo * (self.darkest_spot + (1.0 - self.darkest_spot) * spots) * light)
            })
        };
        let mask = Mask::from_fn(SIZE, SIZE, |x, y| f32::from((x as f32 - 47.5).hypot(y as f32 - 47.5) < 44.0));
        for pose in 0..4 {
            let turn = 0.7 * pose as f32;
            let olats = |turn: f32| -> Vec<Image> { lamps.iter().map(|(d, _)| subject(turn, *d)).collect() };
            for (i, olat) in olats(turn).iter().enumerate() {
                write(project.olat_picture(pose, i), olat);
            }
            file::write_mask_png(project.exemplar_matte(pose).file(), &mask).unwrap();
            let mut frame = sum(&olats(turn + self.turn), self.exposure);
            for pane in panes.iter().filter(|_| self.window > 0.0) {
                let lit = subject(turn + self.turn, *pane);
                let share = self.exposure * self.window * all / panes.len() as f32;
                for (sum, light) in frame.pixels.iter_mut().zip(&lit.pixels) {
                    *sum = [0, 1, 2].map(|c| sum[c] + share * WARM[c] * light[c]);
                }
            }
            write(project.frame_picture(pose), &frame);
            file::write_mask_png(project.frame_matte(pose).file(), &mask).unwrap();
        }
        project
    }

    /// Makes and reads the shoot.
    pub fn load(&self) -> (Subject, Probes) {
        let folder = tempfile::tempdir().unwrap();
        let project = self.shoot(folder.path());
        let probes = Probes::load(&project, &Progress::silent()).unwrap();
        let subject = Subject::load(&project, &probes, &Progress::silent()).unwrap();
        (subject, probes)
    }
}

/// A dark shoot: nothing is brighter than a quarter of the range.
pub fn without_bright() -> SmallShoot {
    SmallShoot { subject: 0.01, fill: 0.0002, ball: 0.03, ..SmallShoot::default() }
}

/// A shoot in fog: every lamp lights all of a pale subject, and lamps are uniform discs on the balls.
pub fn without_dark() -> SmallShoot {
    SmallShoot { subject: 0.05, fill: 0.2, darkest_spot: 0.7, flat: true, ..SmallShoot::default() }
}

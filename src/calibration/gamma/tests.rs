use super::*;
use crate::imaging::{Image, Mask, file};
use crate::project::{Ball, Project, Settings, Shoot};
use glam::Vec3;
use std::path::{Path, PathBuf};

const SIZE: usize = 96;

/// How a small shoot of a spotted ball was made.
#[derive(Clone, Copy)]
struct Making {
    response: DualGamma,
    /// Of the interview's camera beside that of the OLATs.
    exposure: f32,
    /// Turn of the frames' heads against the poses', in radians.
    turn: f32,
    /// Light that comes from everywhere onto the subject under each lamp, beside that of the lamp.
    fill: f32,
    /// Levels of subject and balls.
    subject: f32,
    ball: f32,
    /// Whether a lamp's image on the ball is a disc of one level.
    flat: bool,
    /// Noise of the sensor beside that of the virtual stage's.
    noise: f32,
    seed: u32,
}

impl Default for Making {
    fn default() -> Self {
        Self {
            response: DualGamma {
                gamma1: 2.5,
                gamma2: 1.9,
            },
            exposure: 1.0,
            turn: 0.05,
            fill: 0.004,
            subject: 0.25,
            ball: 0.8,
            flat: false,
            noise: 1.0,
            seed: 1,
        }
    }
}

/// The directions of a small dome and how bright each lamp was during the interview.
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

impl Making {
    /// Writes the shoot into `root` and gives its project.
    fn shoot(&self, root: &Path) -> Project {
        let ball = Ball {
            center_px: [48.0, 48.0],
            radius_px: 42.0,
            radius_m: 0.075,
            camera_distance_m: 4.0,
        };
        let names =
            |what: &str, n: usize| (0..n).map(|i| format!("{what}{i:02}")).collect::<Vec<_>>();
        let lamps = dome();
        let project = Project {
            root: root.to_path_buf(),
            settings: Settings {
                format: crate::project::FORMAT,
                name: "small".into(),
                size: 32,
                seed: 1,
                shoot: Shoot {
                    folder: PathBuf::from("shoot"),
                    frame_rate: 25.0,
                    poses: names("pose", 4),
                    lamps: names("olat_", lamps.len()),
                    frames: names("frame_", 4),
                    ball,
                    dome_radius_m: None,
                    environments: vec![],
                },
            },
        };
        let mut seed = self.seed.wrapping_mul(2_654_435_761);
        let mut even = move || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / 16_777_216.0 - 0.5
        };
        // A sensor's noise as on the virtual stage (four even draws are near enough to a Gaussian), then
        // eight bits.
        let mut write = |path: PathBuf, light: &Image| {
            let noisy = light.map(|pixel| {
                pixel.map(|l| {
                    let draw = 3f32.sqrt() * (even() + even() + even() + even());
                    (l + self.noise * (0.003 * l.sqrt() + 5e-5) * draw).max(0.0)
                })
            });
            file::write_png(&path, &self.response.encode(&noisy)).unwrap();
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
        let geometry =
            crate::calibration::mirror_ball::MirrorBall::new(&ball, None, (SIZE, SIZE)).unwrap();
        let probes: Vec<Image> = lamps
            .iter()
            .map(|(direction, _)| {
                let mut picture = Image::filled(SIZE, SIZE, [0.0002; 3]);
                for pixel in &geometry.pixels {
                    let away = (1.0 - pixel.direction.dot(*direction)) / 0.01;
                    let glow = if self.flat {
                        f32::from(away < 1.0)
                    } else {
                        (-away).exp()
                    };
                    picture.pixels[pixel.index] =
                        [1.0, 0.9, 0.7].map(|c| self.ball * c * glow + 0.0002);
                }
                picture
            })
            .collect();
        write(project.interview_probe_path(), &sum(&probes, 1.0));
        for (i, probe) in probes.iter().enumerate() {
            write(project.lamp_probe_path(i), probe);
        }
        let subject = |turn: f32, direction: Vec3| {
            Image::from_fn(SIZE, SIZE, |x, y| {
                let (dx, dy) = ((x as f32 - 47.5) / 44.0, (47.5 - y as f32) / 44.0);
                let n = Vec3::new(dx, dy, (1.0 - dx * dx - dy * dy).max(0.0).sqrt());
                let spots = 0.5 + 0.5 * (9.0 * (n.x + turn)).sin() * (7.0 * n.y).cos();
                let light = self.subject * n.dot(direction).max(0.0) + self.fill;
                [0.9, 0.6 + 0.2 * spots, 0.3 + 0.5 * spots]
                    .map(|albedo| albedo * (0.2 + 0.8 * spots) * light)
            })
        };
        let mask = Mask::from_fn(SIZE, SIZE, |x, y| {
            f32::from((x as f32 - 47.5).hypot(y as f32 - 47.5) < 44.0)
        });
        for pose in 0..4 {
            let turn = 0.7 * pose as f32;
            let olats = |turn: f32| -> Vec<Image> {
                lamps.iter().map(|(d, _)| subject(turn, *d)).collect()
            };
            for (i, olat) in olats(turn).iter().enumerate() {
                write(project.olat_path(pose, i), olat);
            }
            file::write_mask_png(&project.exemplar_mask_path(pose), &mask).unwrap();
            write(
                project.frame_path(pose),
                &sum(&olats(turn + self.turn), self.exposure),
            );
            file::write_mask_png(&project.frame_mask_path(pose), &mask).unwrap();
        }
        project
    }

    /// Makes the shoot and reads it.
    fn load(&self) -> (Subject, Probes) {
        let folder = tempfile::tempdir().unwrap();
        let project = self.shoot(folder.path());
        let probes = Probes::load(&project, &Progress::silent()).unwrap();
        let subject = Subject::load(&project, &probes, &Progress::silent()).unwrap();
        (subject, probes)
    }
}


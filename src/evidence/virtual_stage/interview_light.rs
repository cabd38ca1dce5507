//! Light of the interview: the stage's own banks, or light outside their span.

use super::dome::Dome;
use super::panel::Panel;
use super::room::{Room, mean_radiance};
use super::transport::Source;
use super::trouble::{LightKind, Trouble};
use chacha20::ChaCha8Rng;
use glam::Vec3;
use imaging::Image;
use rand::{RngExt, SeedableRng};
use std::f32::consts::PI;

/// Fewest sources that represent a room on the subject.
const ROOM_SOURCES: usize = 200;

/// Light of the interview, in units where all lamps of the dome together are a sphere of radiance 1.
pub struct InterviewLight {
    /// Radiance per bank and channel; 0 if the banks do not light the interview.
    pub banks: Vec<[f32; 3]>,
    /// Lamps that do not belong to the stage.
    pub panels: Vec<Panel>,
    /// Radiance emitted by the room; `None` if it is dark.
    pub ambient: Option<Image>,
    /// The panels as small discs.
    pub others: Vec<Source>,
    /// Radiance per channel of every lamp of the dome, for banks and room, and then of every other source.
    pub weights: Vec<[f32; 3]>,
}

impl InterviewLight {
    /// Light drawn from `seed`. `bounce` holds the room's reflection of each bank, as radiances of the lamps.
    pub fn draw(dome: &Dome, trouble: &Trouble, room: &Room, bounce: Option<&[Vec<[f32; 3]>]>, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x6c_6967_6874);
        let mut panels = match trouble.interview_light {
            LightKind::Banks => vec![],
            LightKind::Lamps => lamps(&mut random),
            LightKind::Window => vec![window(&mut random)],
            LightKind::Softboxes => softboxes(&mut random),
        };
        let tinted = |radiance: [f32; 3]| [0, 1, 2].map(|c: usize| radiance[c] * trouble.tint[c]);
        for panel in &mut panels {
            panel.radiance = tinted(panel.radiance);
        }
        let banks: Vec<[f32; 3]> = if panels.is_empty() {
            (dome.interview_bank_weights().iter()).map(|w| tinted([*w; 3])).collect()
        } else {
            vec![[0.0; 3]; dome.banks.len()]
        };
        let mut weights: Vec<[f32; 3]> = dome.bank_of_lamp.iter().map(|&b| banks[b]).collect();
        for (bank, reflected) in banks.iter().zip(bounce.unwrap_or_default()) {
            for (weight, reflected) in weights.iter_mut().zip(reflected) {
                *weight = [0, 1, 2].map(|c| weight[c] + bank[c] * reflected[c]);
            }
        }
        let (mut others, mut other_weights) = (vec![], vec![]);
        for panel in &panels {
            let sources = panel.sources();
            other_weights.extend(vec![panel.radiance; sources.len()]);
            others.extend(sources);
        }
        let flux = |weights: &[[f32; 3]], solid_angle: &dyn Fn(usize) -> f32| -> f32 {
            (weights.iter().enumerate()).map(|(i, w)| (w[0] + w[1] + w[2]) / 3.0 * solid_angle(i)).sum()
        };
        let direct = flux(&weights, &|_| dome.lamp_solid_angle()) + flux(&other_weights, &|i| others[i].solid_angle);
        let ambient = (trouble.ambient > 0.0).then(|| {
            // The glow's mean radiance is 1.
            let level = trouble.ambient / (1.0 - trouble.ambient) * direct / (4.0 * PI);
            room.glow.map(|pixel| pixel.map(|v| v * level))
        });
        if let Some(ambient) = &ambient {
            // Few lamps cannot represent a room.
            if dome.lamps.len() < ROOM_SOURCES {
                let room = Dome::with(1, ROOM_SOURCES);
                other_weights.extend(room.lamp_weights(ambient));
                others.extend(Source::lamps(&room));
            } else {
                for (weight, glow) in weights.iter_mut().zip(dome.lamp_weights(ambient)) {
                    *weight = [0, 1, 2].map(|c| weight[c] + glow[c]);
                }
            }
        }
        weights.extend(other_weights);
        Self { banks, panels, ambient, others, weights }
    }

    /// True for a sum of banks only.
    pub fn is_of_banks(&self) -> bool {
        self.panels.is_empty() && self.ambient.is_none()
    }

    /// Radiance per bank and channel if each bank takes all light from the directions nearest to it. Exact if the light
    /// [is of banks](Self::is_of_banks).
    pub fn nearest_banks(&self, dome: &Dome) -> Vec<[f32; 3]> {
        if self.is_of_banks() {
            return self.banks.clone();
        }
        let counts = dome.bank_counts();
        let mut nearest = self.banks.clone();
        let mut add = |bank: usize, radiance: [f32; 3], solid_angle: f32| {
            let share = solid_angle / (counts[bank] as f32 * dome.lamp_solid_angle());
            nearest[bank] = [0, 1, 2].map(|c| nearest[bank][c] + radiance[c] * share);
        };
        if let Some(ambient) = &self.ambient
            && dome.lamps.len() >= ROOM_SOURCES
        {
            for (radiance, &bank) in dome.lamp_weights(ambient).into_iter().zip(&dome.bank_of_lamp) {
                add(bank, radiance, dome.lamp_solid_angle());
            }
        }
        for (source, &radiance) in self.others.iter().zip(&self.weights[dome.lamps.len()..]) {
            let cosine = |bank: &usize| dome.banks[*bank].dot(source.place);
            let nearest = (0..dome.banks.len()).max_by(|a, b| cosine(a).total_cmp(&cosine(b)));
            add(nearest.unwrap_or(0), radiance, source.solid_angle);
        }
        nearest
    }

    /// Irradiance per channel of a surface at the stage's middle that faces `normal`, excluding the banks and the
    /// room's reflection of them.
    pub fn irradiance(&self, dome: &Dome, normal: Vec3) -> Vec3 {
        let others = self.others.iter().zip(&self.weights[dome.lamps.len()..]);
        let panels = others.map(|(source, radiance)| {
            let facing = normal.dot(source.place / source.distance_m).max(0.0);
            Vec3::from(*radiance) * (facing * source.solid_angle)
        });
        // The room emits light from everywhere; the exact directions do not matter to dust.
        let room = self.ambient.as_ref().map_or(Vec3::ZERO, |a| PI * mean_radiance(a));
        panels.sum::<Vec3>() + room
    }
}

/// Direction from azimuth (positive to camera-right, from the camera) and elevation, in degrees.
fn direction(azimuth: f32, elevation: f32) -> Vec3 {
    let (sin, cos) = azimuth.to_radians().sin_cos();
    let (rise, level) = elevation.to_radians().sin_cos();
    Vec3::new(level * sin, rise, level * cos)
}

/// The panel with the radiance that gives a flux of `flux` at the stage's middle.
fn with_flux(panel: Panel, flux: f32) -> Panel {
    let solid_angle: f32 = panel.sources().iter().map(|s| s.solid_angle).sum();
    Panel { radiance: [flux / solid_angle.max(1e-6); 3], ..panel }
}

/// Two to four bare lamps about the subject, mostly in front.
fn lamps(random: &mut ChaCha8Rng) -> Vec<Panel> {
    let count = random.random_range(2..=4);
    (0..count)
        .map(|_| {
            let mut within = |low: f32, high: f32| random.random_range(low..high);
            let towards = direction(within(-115.0, 115.0), within(-10.0, 60.0));
            let (distance, radius, flux) = (within(1.2, 3.5), within(0.03, 0.12), within(-1.2, 0.0));
            let disc = Panel { round: true, ..Panel::facing(towards, distance, [radius; 2], [1.0; 3]) };
            with_flux(disc, flux.exp())
        })
        .collect()
}

/// A window with panes on one side.
fn window(random: &mut ChaCha8Rng) -> Panel {
    let mut within = |low: f32, high: f32| random.random_range(low..high);
    let side = if within(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
    let azimuth = side * within(35.0, 100.0);
    let (distance, turn) = (within(1.0, 2.5), within(-20.0, 20.0));
    let half = [within(0.35, 0.8), within(0.5, 0.9)];
    let panes = [within(1.0, 4.0) as usize, within(1.0, 5.0) as usize];
    let centre = direction(azimuth, 0.0) * distance + Vec3::Y * within(-0.1, 0.5);
    // Upright, and not quite facing the subject.
    let normal = -direction(azimuth + turn, 0.0);
    let window = Panel { centre, normal, across: Vec3::Y.cross(normal), half, round: false, panes, radiance: [1.0; 3] };
    with_flux(window, 1.0)
}

/// A key light, a fill from the other side, and sometimes a backlight.
fn softboxes(random: &mut ChaCha8Rng) -> Vec<Panel> {
    let mut within = |low: f32, high: f32| random.random_range(low..high);
    let side = if within(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
    let mut softbox = |azimuth: [f32; 2], elevation: [f32; 2], flux: f32| {
        let towards = direction(side * within(azimuth[0], azimuth[1]), within(elevation[0], elevation[1]));
        let (distance, half) = (within(1.0, 2.2), [within(0.25, 0.6), within(0.25, 0.6)]);
        let round = within(0.0, 1.0) < 0.4;
        let half = if round { [half[0]; 2] } else { half };
        let panel = Panel { round, ..Panel::facing(towards, distance, half, [1.0; 3]) };
        (with_flux(panel, flux), within(0.0, 1.0))
    };
    let (key, fill_level) = softbox([15.0, 60.0], [10.0, 50.0], 1.0);
    let (fill, rim_level) = softbox([-75.0, -15.0], [-5.0, 30.0], 0.1 + 0.5 * fill_level);
    let (rim, _) = softbox([140.0, 220.0], [15.0, 50.0], 0.2 + 1.5 * rim_level);
    if rim_level < 0.4 { vec![key, fill, rim] } else { vec![key, fill] }
}

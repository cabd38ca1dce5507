//! A lamp's footprint: the mirror-ball pixels that show the lamp, and measurements from them.

use super::code_values::{CodeValues, ResponseTable, STEPS, is_clipped};
use super::highlight::{self, Grid, Highlight, Levels, NEAR_DEG, clipped_weight};
use super::mirror_ball::MirrorBall;
use glam::{DVec3, Vec3};
use light::Lamp;

/// Lamp pixels of one ball photograph, and the level of all others.
pub(super) struct Footprint {
    /// Indices into [`MirrorBall::pixels`] with their code values.
    pub pixels: Vec<(u32, CodeValues)>,
    /// Histogram of code values per channel in pixels without a lamp.
    dark: [Vec<(u16, u32)>; 3],
    /// The lamp among the pixels; `None` if all of them count as the lamp.
    aim: Option<Aim>,
}

/// Pixels of a footprint that show the lamp itself.
struct Aim {
    /// For each of [`Footprint::pixels`] that shows the lamp, the code value of the room's light there, as the mean
    /// of the channels.
    room: Vec<Option<u16>>,
    /// See [`Highlight::direction`] and [`Highlight::outline`].
    direction: Vec3,
    outline: Vec3,
    confidence: f32,
}

impl Footprint {
    /// Pixels below this share of the brightest are not the lamp. 8 bits resolve no more.
    const FAINTEST: f32 = 0.002;

    /// Finds the lamp in a ball's photograph, given as one code per pixel of the ball. `provisional` is a plausible
    /// response: pixels far above black are so under any other.
    pub fn find(photograph: &[CodeValues], provisional: &ResponseTable) -> Self {
        let level = |code: &CodeValues| provisional.rgb(*code).into_iter().sum::<f32>() / 3.0;
        let mut levels: Vec<f32> = photograph.iter().map(level).collect();
        levels.sort_by(f32::total_cmp);
        let quantile = |q: f32| levels[(q * (levels.len() - 1) as f32) as usize];
        // The darker part of the ball holds the room's light and the sensor's noise. The noise deviation is about
        // the distance between the 10 % and 40 % quantiles; six deviations are not noise. Even a clean sensor
        // flickers by one 8-bit code.
        let dark = quantile(0.4);
        let code = (provisional.encode(dark) * f32::from(STEPS)) as u16;
        let flicker = provisional.light((code + 16).min(STEPS)) - provisional.light(code);
        let noise = (dark - quantile(0.1)).max(flicker);
        let threshold = dark + (6.0 * noise).max(Self::FAINTEST * (quantile(1.0) - dark));
        let mut pixels = Vec::new();
        let mut counts = vec![[0u32; 3]; usize::from(STEPS) + 1];
        for (i, code) in photograph.iter().enumerate() {
            if level(code) > threshold {
                pixels.push((i as u32, *code));
            } else {
                for c in 0..3 {
                    counts[usize::from(code[c])][c] += 1;
                }
            }
        }
        let dark = [0, 1, 2].map(|c| {
            let counted = counts.iter().enumerate().filter(|(_, count)| count[c] > 0);
            counted.map(|(code, count)| (code as u16, count[c])).collect()
        });
        Self { pixels, dark, aim: None }
    }

    /// Applies the result of the full series: `highlight` (`None` if the lamp was not seen), its confidence, and
    /// the room's light per cell under `provisional`. Without it every bright pixel counts as the lamp.
    fn aim(
        &mut self,
        highlight: Option<&Highlight>,
        confidence: f32,
        (grid, room): (&Grid, &[f32]),
        provisional: &ResponseTable,
    ) {
        let mut is_body = vec![false; grid.solid_angle.len()];
        for &cell in highlight.iter().flat_map(|highlight| &highlight.body) {
            is_body[cell as usize] = true;
        }
        let code = |light: f32| (provisional.encode(light) * f32::from(STEPS) + 0.5) as u16;
        self.aim = Some(Aim {
            room: (self.pixels.iter())
                .map(|(pixel, _)| grid.cell(*pixel))
                .map(|cell| is_body[cell].then(|| code(room[cell])))
                .collect(),
            direction: highlight.map_or(Vec3::Z, |highlight| highlight.direction),
            outline: highlight.map_or(Vec3::Z, |highlight| highlight.outline),
            confidence,
        });
    }

    /// Mean light of the pixels without a lamp.
    pub fn background(&self, table: &ResponseTable) -> [f32; 3] {
        [0, 1, 2].map(|c| {
            let (mut sum, mut count) = (0.0, 0.0);
            for &(code, times) in &self.dark[c] {
                sum += f64::from(table.light(code)) * f64::from(times);
                count += f64::from(times);
            }
            (sum / f64::max(count, 1.0)) as f32
        })
    }

    /// Number of pixels with a clipped channel, whose light has only a lower bound.
    pub fn clipped_pixels(&self) -> usize {
        self.pixels.iter().filter(|(_, code)| is_clipped(code)).count()
    }

    /// Measures the lamp from its footprint. Clipping lowers the energy but not the direction, which is then the
    /// middle of the outline.
    pub fn lamp(&self, name: &str, ball: &MirrorBall, table: &ResponseTable) -> Lamp {
        let background = self.background(table);
        let dark = background.iter().sum::<f32>() / 3.0;
        let (mut energy, mut moment, mut clipped) = ([0.0f64; 3], DVec3::ZERO, 0.0f64);
        let mut parts = Vec::with_capacity(self.pixels.len());
        for (place, (i, code)) in self.pixels.iter().enumerate() {
            let room = match &self.aim {
                None => 0.0,
                Some(aim) => match aim.room[place] {
                    None => continue,
                    // The room's windows, without the ball's overall level.
                    Some(code) => (table.light(code) - dark).max(0.0),
                },
            };
            let pixel = &ball.pixels[*i as usize];
            let light = table.rgb(*code);
            let mut part = 0.0;
            for c in 0..3 {
                let channel = f64::from((light[c] - background[c] - room).max(0.0) * pixel.solid_angle);
                energy[c] += channel;
                part += channel;
            }
            let direction = pixel.direction.as_dvec3();
            moment += part * direction;
            clipped += if is_clipped(code) { part } else { 0.0 };
            parts.push((direction, part));
        }
        let all: f64 = energy.iter().sum();
        let mut direction = moment.normalize_or_zero();
        if all <= 0.0 || all.is_nan() || direction == DVec3::ZERO {
            // No lamp seen. The direction must not be NaN; confidence 0 marks it as meaningless.
            return Lamp {
                name: name.into(),
                direction: Vec3::Z,
                energy: [0.0; 3],
                spread_deg: 0.0,
                confidence: 0.0,
                clipped: 0.0,
            };
        }
        let clipped = clipped / all;
        let confidence = match &self.aim {
            None => 1.0,
            Some(aim) => {
                let weight = f64::from(clipped_weight(clipped as f32));
                direction = direction.lerp(aim.outline.as_dvec3(), weight).normalize();
                // Too dim for most pixels to count, or another response: the weighed pixels differ from the
                // measured ones.
                let apart = aim.direction.as_dvec3().angle_between(direction);
                let off = apart.to_degrees() as f32 / NEAR_DEG;
                aim.confidence * (-off * off).exp()
            }
        };
        let square: f64 = parts.iter().map(|(d, part)| part * d.angle_between(direction).powi(2)).sum();
        let spread_deg = (square / all).sqrt().to_degrees();
        Lamp {
            name: name.into(),
            direction: direction.as_vec3(),
            energy: energy.map(|e| e as f32),
            spread_deg: spread_deg as f32,
            confidence,
            clipped: clipped as f32,
        }
    }
}

/// Finds the lamp in each footprint of a series. `series` holds the same photographs, reduced under the response
/// `provisional`.
pub(super) fn aim(footprints: &mut [Footprint], series: &[Levels], grid: &Grid, provisional: &ResponseTable) {
    let room = grid.room(series);
    let highlights = highlight::find(grid, series, &room);
    let trust = highlight::weigh(&highlights, grid, &room);
    for ((footprint, highlight), trust) in footprints.iter_mut().zip(&highlights).zip(trust) {
        footprint.aim(highlight.as_ref(), trust, (grid, &room), provisional);
    }
}

//! Bright parts of one photograph, and the lamp among them.

use super::bank::{BANK, Part, SAME_BANK, bank};
use super::grid::{Grid, Levels};
use super::shape::{inner_radius, opened, widened};
use glam::Vec3;

/// A lamp in one photograph.
#[derive(Clone, Debug)]
pub(crate) struct Highlight {
    /// Unit direction of its light, or of its outline in proportion to clipping.
    pub direction: Vec3,
    /// Unit direction of the outline's middle; correct even if the lamp is clipped.
    pub outline: Vec3,
    /// Grid cells that show the lamp, ascending, without streaks and other reflections.
    pub body: Vec<u32>,
    /// Standard deviation of the direction in degrees, if this is the lamp.
    pub deviation_deg: f32,
    /// Root-mean-square angle of the body's light about its middle, in degrees.
    pub spread_deg: f32,
    /// Light of the body: ∫ L dω over the extra light of the photograph.
    pub energy: f32,
    /// Highest radiance of the body; clipping keeps it below 1.
    pub peak: f32,
    /// Light of the strongest rival part, relative to the lamp's.
    pub rival: f32,
    /// Share of the photograph's extra light outside the body.
    pub elsewhere: f32,
}

/// Smallest radiance of a bright part, relative to the highest.
pub(super) const BRIGHT: f32 = 0.5;
/// Smallest radiance of the body, relative to the highest: the dim end of a softbox.
pub(super) const FAINT: f32 = 0.2;
/// The same for a bank, because the ball may nearly hide one of its lamps.
const FAINT_IN_BANK: f32 = 0.01;
/// Largest ratio, either way, of a part's light between two photographs.
const SAME_LIGHT: f32 = 8.0;
/// Opening radius of an outline, relative to its largest inner disc. Streaks are up to this much narrower.
const STREAK: f32 = 0.8;

/// One photograph of a series, without the room.
pub(super) struct Photograph<'a> {
    grid: &'a Grid,
    levels: &'a Levels,
    /// The room's light plus this photograph's own dark level.
    room: &'a [f32],
    dark: f32,
    /// Extra light above the room and the photograph's dark level, per cell; not negative.
    more: Vec<f32>,
    /// Noise level of `more`.
    noise: f32,
    /// The highest radiance.
    peak: f32,
    /// Bright parts, in descending order of light.
    bright: Vec<Part>,
}

/// Light of a set of cells on the sphere.
struct Moments {
    energy: f32,
    direction: Vec3,
    /// Root-mean-square angle from the direction in degrees.
    spread_deg: f32,
}

impl<'a> Photograph<'a> {
    /// `None` if nothing rises above the noise.
    pub fn new(grid: &'a Grid, levels: &'a Levels, room: &'a [f32]) -> Option<Self> {
        let cells: Vec<usize> = (0..room.len()).filter(|&c| grid.is_ball(c)).collect();
        let mut sorted: Vec<f32> = cells.iter().map(|&c| levels.light(c) - room[c]).collect();
        let last = sorted.len().checked_sub(1)?;
        let mut quantile = |q: f32| {
            let rank = (q * last as f32) as usize;
            *sorted.select_nth_unstable_by(rank, f32::total_cmp).1
        };
        // As in `Footprint::find`: most of the ball shows no lamp.
        let (dark, low) = (quantile(0.4), quantile(0.1));
        let raw = |c: usize| (levels.light(c) - room[c] - dark - flicker(room[c])).max(0.0);
        let mut more = vec![0.0f32; room.len()];
        for &cell in &cells {
            // A single outlier pixel is the sensor's fault: the lens spreads a lamp over several.
            let around = grid.around(cell).map(&raw).fold(0.0, f32::max);
            more[cell] = raw(cell).min(around);
        }
        let peak = more.iter().copied().fold(0.0, f32::max);
        // A hundredth of an 8-bit code near black is below the resolution of any photograph.
        let noise = (6.0 * (dark - low)).max(1e-5);
        let mut photograph = Self { grid, levels, room, dark, more, noise, peak, bright: vec![] };
        if peak > 2.0 * noise {
            photograph.bright = photograph.find_bright(BRIGHT);
        }
        (!photograph.bright.is_empty()).then_some(photograph)
    }

    /// Parts above a share of the peak, in descending order of light.
    pub fn find_bright(&self, share: f32) -> Vec<Part> {
        let mut parts: Vec<(f32, Vec<u32>)> = (self.parts(share).into_iter())
            .map(|cells| (cells.iter().map(|&cell| self.light(cell)).sum(), cells))
            .collect();
        parts.sort_by(|a, b| b.0.total_cmp(&a.0));
        // Parts with less light are not the lamp, and there can be thousands.
        let least = 0.02 * parts.first().map_or(0.0, |(energy, _)| *energy);
        parts.retain(|(energy, _)| *energy >= least);
        let part = |(_, cells): (f32, Vec<u32>)| {
            let Moments { energy, direction, spread_deg } = self.moments(&cells);
            let core = self.moments(&opened(&cells, self.grid, STREAK));
            Part {
                energy,
                direction,
                radius_deg: std::f32::consts::SQRT_2 * spread_deg,
                inner_radius: inner_radius(&cells, self.grid),
                core: core.direction,
                core_radius_deg: std::f32::consts::SQRT_2 * core.spread_deg,
                cells,
            }
        };
        parts.into_iter().map(part).collect()
    }

    /// True if this photograph shows another photograph's part at the same or a neighbouring place, like the glint
    /// of a ball that hardly moves with the lamps.
    pub fn shows(&self, part: &Part) -> bool {
        let reach = 1.0 + 0.5 * part.core_radius_deg;
        self.bright.iter().any(|own| {
            let ratio = own.energy / part.energy;
            own.core.angle_between(part.core).to_degrees() < reach && ratio < SAME_LIGHT && ratio * SAME_LIGHT > 1.0
        })
    }

    /// Light of a cell on the sphere.
    fn light(&self, cell: u32) -> f32 {
        self.more[cell as usize] * self.grid.solid_angle[cell as usize]
    }

    fn moments(&self, cells: &[u32]) -> Moments {
        let (mut energy, mut moment) = (0.0f64, glam::DVec3::ZERO);
        let part = |&cell: &u32| {
            let direction = self.grid.direction[cell as usize].as_dvec3();
            (f64::from(self.light(cell)), direction)
        };
        for (light, direction) in cells.iter().map(part) {
            energy += light;
            moment += light * direction;
        }
        let middle = moment.normalize_or(glam::DVec3::Z);
        let square: f64 =
            (cells.iter().map(part)).map(|(light, direction)| light * direction.angle_between(middle).powi(2)).sum();
        let spread = (square / energy.max(f64::MIN_POSITIVE)).sqrt().to_degrees();
        Moments { energy: energy as f32, direction: middle.as_vec3(), spread_deg: spread as f32 }
    }

    /// Connected parts above a share of the peak.
    fn parts(&self, share: f32) -> Vec<Vec<u32>> {
        let least = (share * self.peak).max(self.noise);
        self.grid.parts(|cell| self.more[cell] >= least)
    }

    /// The lamp among the bright parts, given the parts that belong to the room.
    pub fn highlight(&self, is_shared: impl Fn(&Part) -> bool) -> Option<Highlight> {
        let (mut own, shared): (Vec<&Part>, Vec<&Part>) = self.bright.iter().partition(|part| !is_shared(part));
        // If every part is shared, the lamp may be in front of a bright room, or off.
        let only_shared = own.is_empty();
        if only_shared {
            own = shared;
        }
        let (bank, others) = bank(own);
        let energy: f32 = bank.iter().map(|part| part.energy).sum();
        let rival = others.iter().map(|part| part.energy / energy).fold(0.0, f32::max);
        let rival = if only_shared { rival.max(1.0) } else { rival };
        Some(self.bank_highlight(&bank, rival))
    }

    /// A bank with lamps far apart, from its lamps. Most photographs of the series show `usual` lamps.
    pub fn bank_apart(&self, glints: &[Part], usual: f32) -> Highlight {
        let bank: Vec<&Part> = glints.iter().collect();
        let found = self.bank_highlight(&bank, 0.0);
        // Lamps of a bank are equally bright. Unequal or missing lamps may shift the middle.
        let count = (bank.len() as f32).max(usual);
        let all: f32 = bank.iter().map(|part| part.energy).sum();
        let mean = all / count;
        let missing = (count - bank.len() as f32) * mean * mean;
        let unlike: f32 = (bank.iter().map(|part| (part.energy - mean).powi(2))).sum();
        let by_lamps = found.spread_deg * (unlike + missing).sqrt() / all;
        Highlight { deviation_deg: found.deviation_deg.hypot(by_lamps), ..found }
    }

    /// The lamp made of these parts, beside a rival with this share of its light.
    fn bank_highlight(&self, bank: &[&Part], rival: f32) -> Highlight {
        let is_bank = bank.len() >= BANK;
        let faint = if is_bank { FAINT_IN_BANK } else { FAINT };
        let levels = self.without_streaks(bank, [faint, BRIGHT, 0.7, 0.9]);
        let (outline, drift) = self.outline(&levels[1..]);
        // The body includes the fall-off, but not the remains of streaks.
        let reach = (0.5 * inner_radius(&levels[0], self.grid)).max(2.0);
        let body = widened(&levels[..2].concat(), self.grid, reach);
        let clipped = |cell: &&u32| self.levels.is_clipped(**cell as usize);
        let clipped: f32 = body.iter().filter(clipped).map(|&c| self.light(c)).sum();
        let Moments { energy, direction: middle, spread_deg } = self.moments(&body);
        let clipped = clipped_weight(clipped / energy.max(f32::MIN_POSITIVE));
        let all: f32 =
            (0..self.more.len() as u32).filter(|&c| self.more[c as usize] > self.noise).map(|c| self.light(c)).sum();
        // An outline's middle is known to about an eighth of its radius, the width left by streaks. Clipped light
        // only limits how far the outline may be off. The lamps of a bank err independently.
        let radius = (bank.iter().map(|part| part.core_radius_deg)).fold(0.0, f32::max);
        let alone = 1.0 / (bank.len() as f32).sqrt();
        let apart = middle.angle_between(outline).to_degrees();
        let doubt = if is_bank { 0.5 } else { 0.4 };
        let by_outline = (drift.hypot(0.125 * alone * radius)).hypot(doubt * apart);
        let by_light = 0.5 * alone * apart;
        // Clipping takes about as much from each lamp of a bank, which hardly moves the centroid.
        let outline = if is_bank { middle } else { outline };
        let hidden = self.hidden(&body);
        // Light hidden on one side moves the middle to the other.
        let by_hidden = 2.0 * hidden * std::f32::consts::SQRT_2 * spread_deg;
        let deviation_deg = clipped * by_outline + (1.0 - clipped) * by_light;
        Highlight {
            direction: middle.lerp(outline, clipped).normalize_or(Vec3::Z),
            outline,
            deviation_deg: deviation_deg.hypot(by_hidden),
            spread_deg,
            energy,
            peak: self.peak,
            rival,
            elsewhere: (1.0 - energy / all.max(energy)).max(0.0),
            body,
        }
    }

    /// True if extra light of a given radiance would be invisible at a cell, because the room is nearly white
    /// there.
    fn is_full(&self, cell: u32) -> bool {
        headroom(self.room[cell as usize]) - self.dark < BRIGHT * self.peak
    }

    /// Share of the cells around a body where extra light would be invisible.
    fn hidden(&self, body: &[u32]) -> f32 {
        let mut around = widened(body, self.grid, 2.0);
        let is_body: std::collections::HashSet<u32> = body.iter().copied().collect();
        around.retain(|cell| !is_body.contains(cell));
        let full = around.iter().filter(|cell| self.is_full(**cell)).count();
        full as f32 / around.len().max(1) as f32
    }

    /// Parts of the bank without streaks at each of several levels, given as shares of the peak.
    fn without_streaks<const N: usize>(&self, bank: &[&Part], levels: [f32; N]) -> [Vec<u32>; N] {
        let mut is_bank = vec![false; self.more.len()];
        for &cell in bank.iter().flat_map(|part| &part.cells) {
            is_bank[cell as usize] = true;
        }
        let belongs = |cells: &[u32]| {
            cells.iter().any(|&cell| is_bank[cell as usize])
                || bank.len() >= BANK && {
                    let Moments { direction, spread_deg, .. } = self.moments(cells);
                    let radius_deg = std::f32::consts::SQRT_2 * spread_deg;
                    bank.iter().any(|part| part.is_near(direction, radius_deg))
                }
        };
        let parts = levels.map(|share| {
            let mut parts: Vec<(f32, Vec<u32>)> = (self.parts(share).into_iter())
                .filter(|cells| belongs(cells))
                .map(|cells| (inner_radius(&cells, self.grid), cells))
                .collect();
            if bank.len() < BANK {
                let largest = parts.iter().map(|(radius, _)| *radius).fold(0.0, f32::max);
                parts.retain(|(radius, _)| *radius >= SAME_BANK * largest);
            }
            parts
        });
        let most = parts.iter().map(Vec::len).max().unwrap_or(0);
        parts.map(|parts| {
            let cells = parts.into_iter().map(|(_, cells)| cells);
            if most < BANK {
                let opened = cells.map(|cells| opened(&cells, self.grid, STREAK));
                opened.flatten().collect()
            } else {
                cells.flatten().collect()
            }
        })
    }

    /// Middle of the bank's outline, as the mean over several levels, and their spread in degrees.
    fn outline(&self, levels: &[Vec<u32>]) -> (Vec3, f32) {
        let middles: Vec<Vec3> = levels.iter().map(|cells| self.moments(cells).direction).collect();
        let middle = middles.iter().sum::<Vec3>().normalize_or(Vec3::Z);
        let square: f32 = (middles.iter()).map(|one| one.angle_between(middle).to_degrees().powi(2)).sum();
        (middle, (square / middles.len() as f32).sqrt())
    }
}

/// Largest apparent difference of the room's light between two photographs: six 8-bit codes at γ 2.2, for noise and
/// JPEG.
fn flicker(room: f32) -> f32 {
    2.2 * room.powf(1.0 - 1.0 / 2.2) * 6.0 / 255.0
}

/// Largest visible light above the room's.
pub(super) fn headroom(room: f32) -> f32 {
    1.0 - room - flicker(room)
}

/// Weight of the outline against the light in a direction, for this clipped share of the light.
pub(crate) fn clipped_weight(share: f32) -> f32 {
    let t = ((share - 0.02) / 0.18).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

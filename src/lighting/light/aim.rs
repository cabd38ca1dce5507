//! Light by the face: the direction from which a light falls brightest on a chosen point of the subject.

use super::{Lamp, Rig};
use glam::Vec3;
use imaging::color::luminance;
use imaging::{Image, Mask, Raster};
use std::fmt;

/// Smallest matte value that counts as the subject.
pub const LEAST_MATTE: f32 = 0.5;
/// Standard deviation in pixels of the Gaussian neighbourhood around a point, and its reach.
const SIGMA: f32 = 1.5;
const REACH: usize = 4;
/// One pixel in this many is brighter than the subject's reference brightness. Glints are smaller.
const BRIGHTEST: usize = 50;
/// Smallest brightness of a usable point, relative to the subject's brightest under any lamp.
const LEAST_LIGHT: f32 = 1e-3;
/// Smallest ratio of the best lamp's brightness to the mean over lamps.
const LEAST_LEAD: f32 = 1.05;
/// Mean-shift steps. Each comes several times closer to the direction.
const STEPS: usize = 30;

/// Reason for a missing direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoAim {
    /// The point is not on the subject.
    Outside,
    /// No lamp lights the point.
    Dark,
    /// All lamps light the point alike.
    Alike,
    /// Fewer than two lamps have a known direction and energy.
    FewLamps,
}

impl fmt::Display for NoAim {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::Outside => "No light placed: this is not the subject",
            Self::Dark => "No light placed: every lamp leaves this point dark",
            Self::Alike => "No light placed: this point looks alike under every lamp",
            Self::FewLamps => "No light placed: fewer than two lamps are calibrated",
        })
    }
}

/// Brightness of each pixel of a subject under each lamp, per unit of lamp energy.
pub struct LampResponses {
    matte: Mask,
    lamps: Vec<LampResponse>,
}

struct LampResponse {
    /// Index in the rig.
    index: usize,
    direction: Vec3,
    /// Luminance per unit of energy; 0 where the OLAT is not finite or not positive.
    light: Raster<f32>,
    /// Luminance that one pixel in [`BRIGHTEST`] exceeds.
    peak: f32,
}

impl LampResponses {
    /// Reads one OLAT for each lamp of the rig. Skips lamps that cannot be used and pictures that differ in size
    /// from the matte.
    ///
    /// # Errors
    /// Passes on the error of `olat`, which gets the lamp's index.
    pub fn new<E>(rig: &Rig, matte: &Mask, mut olat: impl FnMut(usize) -> Result<Image, E>) -> Result<Self, E> {
        let mut lamps = Vec::new();
        for (i, lamp) in rig.lamps.iter().enumerate() {
            if !lamp.is_usable() {
                continue;
            }
            let olat = olat(i)?;
            if olat.size() == matte.size() {
                lamps.push(LampResponse::new((i, lamp), matte, &olat));
            }
        }
        Ok(Self { matte: matte.clone(), lamps })
    }

    /// Unit direction from the subject to the light that is brightest in column `x` and row `y`.
    ///
    /// The direction is the densest spot of squared lamp scores on the sphere. It may lie between lamps and follows
    /// the point smoothly. A lamp's score is the brightness of the point, times its ratio to the brightest point of
    /// the subject under the same lamp.
    ///
    /// # Errors
    /// The reason for a missing direction, as [`NoAim`].
    pub fn aim(&self, at: [usize; 2]) -> Result<Vec3, NoAim> {
        let scores = self.scores(at)?;
        let weighed: Vec<(Vec3, f32)> =
            (self.lamps.iter()).map(|lamp| lamp.direction).zip(scores.map(|score| score * score)).collect();
        Ok(densest(&weighed, spacing(&weighed)))
    }

    /// Rig index of the lamp with the highest score, as in [`Self::aim`].
    ///
    /// # Errors
    /// The same as [`Self::aim`].
    pub fn lamp(&self, at: [usize; 2]) -> Result<usize, NoAim> {
        let scored = self.lamps.iter().zip(self.scores(at)?);
        let best = scored.max_by(|a, b| a.1.total_cmp(&b.1));
        best.map_or(Err(NoAim::FewLamps), |(lamp, _)| Ok(lamp.index))
    }

    /// Score of each lamp in column `x` and row `y`; finite and not negative.
    fn scores(&self, [x, y]: [usize; 2]) -> Result<impl Iterator<Item = f32>, NoAim> {
        let (width, height) = self.matte.size();
        // NaN does not count as the subject.
        let covered = x < width && y < height && self.matte.at(x, y) >= LEAST_MATTE;
        if !covered {
            return Err(NoAim::Outside);
        }
        if self.lamps.len() < 2 {
            return Err(NoAim::FewLamps);
        }
        let near = self.neighbourhood([x, y]);
        let here: Vec<f32> =
            (self.lamps.iter()).map(|lamp| near.iter().map(|&(i, share)| share * lamp.light.pixels[i]).sum()).collect();
        let brightest = here.iter().copied().fold(0.0, f32::max);
        let peak = self.lamps.iter().map(|lamp| lamp.peak).fold(0.0, f32::max);
        let lit = brightest.is_finite() && brightest > LEAST_LIGHT * peak;
        if !lit {
            return Err(NoAim::Dark);
        }
        if brightest * here.len() as f32 <= LEAST_LEAD * here.iter().sum::<f32>() {
            return Err(NoAim::Alike);
        }
        Ok(self.lamps.iter().zip(here).map(move |(lamp, here)| {
            let share = if lamp.peak > here { here / lamp.peak } else { 1.0 };
            here / brightest * share
        }))
    }

    /// Width and height of the pictures.
    pub fn size(&self) -> (usize, usize) {
        self.matte.size()
    }

    /// Median angle in radians from a lamp to its nearest neighbour.
    pub fn spacing(&self) -> f32 {
        let lamps: Vec<(Vec3, f32)> = self.lamps.iter().map(|l| (l.direction, 1.0)).collect();
        spacing(&lamps)
    }

    /// Indices of the subject's pixels around a covered pixel, with Gaussian weights.
    fn neighbourhood(&self, [x, y]: [usize; 2]) -> Vec<(usize, f32)> {
        let (width, height) = self.matte.size();
        let mut near = Vec::new();
        for row in y.saturating_sub(REACH)..(y + REACH + 1).min(height) {
            for column in x.saturating_sub(REACH)..(x + REACH + 1).min(width) {
                let matte = self.matte.at(column, row);
                if matte > 0.0 {
                    let far = (column.abs_diff(x).pow(2) + row.abs_diff(y).pow(2)) as f32;
                    let share = matte.min(1.0) * (-0.5 * far / (SIGMA * SIGMA)).exp();
                    near.push((row * width + column, share));
                }
            }
        }
        let total: f32 = near.iter().map(|(_, share)| share).sum();
        near.iter_mut().for_each(|(_, share)| *share /= total);
        near
    }
}

impl LampResponse {
    fn new((index, lamp): (usize, &Lamp), matte: &Mask, olat: &Image) -> Self {
        let light = olat.map(|pixel| {
            let light = luminance(std::array::from_fn(|c| pixel[c] / lamp.energy[c]));
            if light.is_finite() { light.max(0.0) } else { 0.0 }
        });
        let covered = light.pixels.iter().zip(&matte.pixels);
        let mut covered: Vec<f32> =
            covered.filter(|(_, matte)| **matte >= LEAST_MATTE).map(|(light, _)| *light).collect();
        let rank = covered.len() / BRIGHTEST;
        let peak =
            if covered.is_empty() { 0.0 } else { *covered.select_nth_unstable_by(rank, |a, b| b.total_cmp(a)).1 };
        Self { index, direction: lamp.direction.normalize(), light, peak }
    }
}

/// Median angle in radians from a direction to its nearest neighbour.
fn spacing(weighed: &[(Vec3, f32)]) -> f32 {
    let cosine = |i: usize| {
        let others = weighed.iter().enumerate().filter(|(j, _)| *j != i);
        let cosines = others.map(|(_, (direction, _))| direction.dot(weighed[i].0));
        cosines.fold(-1.0, f32::max)
    };
    let mut nearest: Vec<f32> = (0..weighed.len()).map(cosine).collect();
    nearest.sort_unstable_by(f32::total_cmp);
    let middle = nearest.get(nearest.len() / 2).copied().unwrap_or(-1.0);
    // Duplicate lamps have zero spacing.
    middle.clamp(-1.0, 1.0).acos().max(0.05)
}

/// Direction with the highest density of weights within about `spread` radians: mean shift from the largest weight,
/// with a von Mises–Fisher kernel.
fn densest(weighed: &[(Vec3, f32)], spread: f32) -> Vec3 {
    let most = weighed.iter().max_by(|a, b| a.1.total_cmp(&b.1));
    let mut middle = most.map_or(Vec3::Y, |(direction, _)| *direction);
    for _ in 0..STEPS {
        let near = |&(direction, weight): &(Vec3, f32)| {
            let cosine = direction.dot(middle);
            direction * weight * ((cosine - 1.0) / (spread * spread)).exp()
        };
        let sum: Vec3 = weighed.iter().map(near).sum();
        middle = sum.try_normalize().unwrap_or(middle);
    }
    middle
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 96;

    /// Surface of a sphere: diffuse share, specular share and sharpness of the highlight.
    #[derive(Clone, Copy)]
    struct Surface {
        matt: f32,
        gloss: f32,
        sharpness: i32,
    }

    /// Lamps all around, as a Fibonacci lattice; every third has four times the energy.
    fn rig(lamps: usize) -> Rig {
        let lamp = |i: usize| {
            let y = 1.0 - (2 * i + 1) as f32 / lamps as f32;
            let (turn, across) = (2.399_963 * i as f32, (1.0 - y * y).sqrt());
            let energy = if i.is_multiple_of(3) { 2.0 } else { 0.5 };
            let direction = Vec3::new(across * turn.cos(), y, across * turn.sin());
            let energy = [energy, 0.8 * energy, 0.6 * energy];
            Lamp { energy, ..Lamp::new(format!("olat_{i:02}"), direction) }
        };
        Rig { lamps: (0..lamps).map(lamp).collect() }
    }

    /// The sphere's normal; the camera looks along −z.
    fn normal(x: usize, y: usize) -> Option<Vec3> {
        let across = |i: usize| (2 * i + 1) as f32 / SIDE as f32 - 1.0;
        let (x, y) = (1.05 * across(x), -1.05 * across(y));
        let depth = 1.0 - x * x - y * y;
        (depth > 0.0).then(|| Vec3::new(x, y, depth.sqrt()))
    }

    fn mirrored(normal: Vec3) -> Vec3 {
        2.0 * normal.z * normal - Vec3::Z
    }

    fn matte() -> Mask {
        Raster::from_fn(SIDE, SIDE, |x, y| f32::from(u8::from(normal(x, y).is_some())))
    }

    /// The sphere under a lamp: Lambert's law and Phong's highlight.
    fn olat(surface: Surface, lamp: &Lamp) -> Image {
        Raster::from_fn(SIDE, SIDE, |x, y| {
            let Some(normal) = normal(x, y) else {
                return [0.0; 3];
            };
            let facing = normal.dot(lamp.direction);
            if facing <= 0.0 {
                return [0.0; 3];
            }
            let glint = mirrored(normal).dot(lamp.direction).max(0.0);
            let light = surface.matt * facing + surface.gloss * glint.powi(surface.sharpness);
            [0.6, 0.4, 0.3].map(|albedo| albedo * light * lamp.energy[0])
        })
    }

    fn responses(rig: &Rig, olat: impl Fn(&Lamp) -> Image) -> LampResponses {
        let olat = |i: usize| Ok::<_, ()>(olat(&rig.lamps[i]));
        LampResponses::new(rig, &matte(), olat).unwrap()
    }

    fn spacing_deg(rig: &Rig) -> f32 {
        let lamps: Vec<_> = rig.lamps.iter().map(|l| (l.direction, 1.0)).collect();
        spacing(&lamps).to_degrees()
    }

    fn off_deg(a: Vec3, b: Vec3) -> f32 {
        a.dot(b).clamp(-1.0, 1.0).acos().to_degrees()
    }

    const CLAY: Surface = Surface { matt: 1.0, gloss: 0.0, sharpness: 1 };

    #[test]
    fn the_light_comes_from_between_the_normal_and_the_mirror_direction_all_over_a_sphere() {
        let skin = Surface { matt: 1.0, gloss: 0.5, sharpness: 20 };
        let wet = Surface { matt: 1.0, gloss: 3.0, sharpness: 60 };
        for lamps in [24, 41, 96] {
            let rig = rig(lamps);
            for surface in [CLAY, skin, wet] {
                let responses = responses(&rig, |lamp| olat(surface, lamp));
                for (x, y) in (0..SIDE * SIDE).step_by(13).map(|i| (i % SIDE, i / SIDE)) {
                    let Some(normal) = normal(x, y) else {
                        assert_eq!(responses.aim([x, y]), Err(NoAim::Outside));
                        continue;
                    };
                    let to = responses.aim([x, y]).unwrap();
                    // A matt sphere has no mirror direction.
                    let mirror = if surface.gloss > 0.0 { mirrored(normal) } else { normal };
                    let between = (0..=20).map(|i| normal.lerp(mirror, i as f32 / 20.0));
                    let off = between.map(|d| off_deg(to, d.normalize()));
                    let off = off.fold(180.0, f32::min);
                    assert!(off <= spacing_deg(&rig), "{off}° at {x}, {y} of {lamps} lamps");
                }
            }
        }
    }

    #[test]
    fn the_light_follows_the_point_without_jumps() {
        let rig = rig(41);
        let responses = responses(&rig, |lamp| olat(CLAY, lamp));
        let row: Vec<Vec3> = (4..SIDE - 4).map(|x| responses.aim([x, SIDE / 2]).unwrap()).collect();
        assert!(row[0].x < -0.6 && row[row.len() - 1].x > 0.6);
        for pair in row.windows(2) {
            let step = off_deg(pair[0], pair[1]);
            assert!(step < 10.0, "{step}°");
        }
    }

    #[test]
    fn a_bright_lamp_does_not_win_by_its_energy() {
        let mut bright = rig(41);
        let plain = responses(&bright, |lamp| olat(CLAY, lamp));
        for lamp in bright.lamps.iter_mut().step_by(2) {
            lamp.energy = lamp.energy.map(|e| 50.0 * e);
        }
        let bright = responses(&bright, |lamp| olat(CLAY, lamp));
        for at in [[30, 40], [48, 48], [60, 70]] {
            let (a, b) = (plain.aim(at).unwrap(), bright.aim(at).unwrap());
            assert!(off_deg(a, b) < 0.1, "{a} {b}");
        }
    }

    #[test]
    fn nothing_is_made_up_where_nothing_is_known() {
        let middle = [SIDE / 2; 2];
        let all = rig(41);
        let filled = |value: f32| responses(&all, move |_| Image::filled(SIDE, SIDE, [value; 3]));
        assert_eq!(filled(0.0).aim(middle), Err(NoAim::Dark));
        assert_eq!(filled(f32::NAN).aim(middle), Err(NoAim::Dark));
        assert_eq!(filled(f32::NEG_INFINITY).aim(middle), Err(NoAim::Dark));
        let even = |lamp: &Lamp| Image::filled(SIDE, SIDE, lamp.energy);
        assert_eq!(responses(&all, even).aim(middle), Err(NoAim::Alike));
        let sized = responses(&all, |_| Image::filled(3, 3, [1.0; 3]));
        assert_eq!(sized.aim(middle), Err(NoAim::FewLamps));
        let clay = |lamp: &Lamp| olat(CLAY, lamp);
        assert_eq!(responses(&rig(1), clay).aim(middle), Err(NoAim::FewLamps));
        assert_eq!(responses(&Rig::default(), clay).aim(middle), Err(NoAim::FewLamps));
        let mut unseen = rig(41);
        unseen.lamps.iter_mut().for_each(|lamp| lamp.confidence = 0.0);
        assert_eq!(responses(&unseen, clay).aim(middle), Err(NoAim::FewLamps));
        let clay = responses(&all, clay);
        assert_eq!(clay.aim([0, 0]), Err(NoAim::Outside));
        assert_eq!(clay.aim([usize::MAX, 0]), Err(NoAim::Outside));
        assert_eq!(clay.aim([0, SIDE]), Err(NoAim::Outside));
    }

    #[test]
    fn damaged_pixels_beside_the_point_do_not_count() {
        let all = rig(41);
        let at = [40, 36];
        let whole = responses(&all, |lamp| olat(CLAY, lamp)).aim(at).unwrap();
        let damaged = responses(&all, |lamp| {
            let mut olat = olat(CLAY, lamp);
            olat.pixels[36 * SIDE + 41] = [f32::NAN; 3];
            olat.pixels[35 * SIDE + 40] = [f32::INFINITY, 0.0, -1e30];
            olat
        });
        let damaged = damaged.aim(at).unwrap();
        assert!(damaged.is_normalized() && off_deg(whole, damaged) < 3.0);
    }

    #[test]
    fn without_a_matte_there_is_no_subject() {
        let rig = rig(4);
        let olat = |_| Ok::<_, ()>(Image::filled(2, 2, [1.0; 3]));
        for matte in [0.0, 0.49, f32::NAN] {
            let matte = Mask::filled(2, 2, matte);
            let responses = LampResponses::new(&rig, &matte, olat).unwrap();
            assert_eq!(responses.aim([0, 0]), Err(NoAim::Outside));
        }
    }
}

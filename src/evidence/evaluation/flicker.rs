//! Flicker: jumps of the light on the subject from frame to frame that motion does not explain.
//!
//! Motion between frames is estimated in the plates, and the frames before and after are warped to the current one.
//! With L a block's light, its jump is j = (L − ½ (L before + L after)) / L: even changes cancel, such as shading on a
//! turning head. If each frame's light is off by a random share σ, j has the standard deviation σ·√1.5. So flicker is
//! the root mean square of j / √1.5, weighted by the relit light, in per cent.
//!
//! The plate jumps too: it has noise, a lamp may hum, and motion of texture is never found exactly. The relit clip
//! shows the same jumps times β, from 0 if the network evens them out to 1 if it passes them on, as texture always is.
//! So the network's own flicker is the part of j in the relit clip beyond β times j of the plate, with β by least
//! squares over the clip.

use base::error::{Error, Result};
use base::progress::Progress;
use calibration::Calibration;
use compositor::{EnvironmentLight, Extra, Field, Identity, Series};
use footage::Frame;
use imaging::color::srgb_from_linear;
use imaging::{Encoded, Image, Mask};
use light::Environment;
use matte::{Flow, flow_picture};
use project::Project;
use reflectance::ReflectanceField;
use scene::{Background, Effects, Output, Scene};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::sync::Arc;

/// Least coverage of a subject pixel, in all three frames.
const SOLID: f32 = 0.95;
/// Least confidence of usable motion.
const TRUSTED: f32 = 0.3;
/// Number of blocks along the longer side.
const BLOCKS: usize = 24;
/// Standard deviation of L − ½ (before + after) if each term has 1.
const SECOND_DIFFERENCE: f64 = 1.5;
/// Largest number of measured frames of a clip.
pub const MOST_FRAMES: usize = 16;

/// A frame of a clip.
#[derive(Clone, Debug)]
pub struct Moment {
    /// Plate and relit picture, linear, with one size for the whole clip.
    pub plate: Image,
    pub relit: Image,
    pub mask: Mask,
}

/// Flicker of a clip in per cent of the light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Flicker {
    /// Plate, including the effect of moving texture.
    pub plate: f64,
    /// Relit clip, including the effect of moving texture.
    pub relit: f64,
    /// Relit clip beyond the plate's own flicker.
    pub beyond: f64,
}

/// Jump of a block in one channel, and its weight.
struct Jump {
    relit: f64,
    plate: f64,
    /// Square of the relit light.
    weight: f64,
}

/// Flicker of consecutive frames; None for fewer than three, or where the subject cannot be tracked.
pub fn flicker(frames: &[Moment]) -> Option<Flicker> {
    let pictures: Vec<Encoded> = frames.iter().map(to_follow).collect();
    let mut all: Vec<Jump> = Vec::new();
    for (three, pictures) in frames.windows(3).zip(pictures.windows(3)) {
        let [before, now, after] = three else { continue };
        let back = Flow::between(&pictures[1], &pictures[0]);
        let on = Flow::between(&pictures[1], &pictures[2]);
        let solid = followed(now, [(&back, before), (&on, after)]);
        let plates = [&now.plate, &back.warped(&before.plate), &on.warped(&after.plate)];
        let relit = [&now.relit, &back.warped(&before.relit), &on.warped(&after.relit)];
        all.extend(jumps(plates, relit, &solid));
    }
    let sum = |term: &dyn Fn(&Jump) -> f64| all.iter().map(|jump| jump.weight * term(jump)).sum::<f64>();
    let shared = sum(&|j| j.relit * j.plate) / sum(&|j| j.plate * j.plate);
    let shared = if shared.is_finite() { shared.clamp(0.0, 1.0) } else { 0.0 };
    let weight = sum(&|_| 1.0);
    let percent = |term: &dyn Fn(&Jump) -> f64| 100.0 * (sum(&|j| term(j).powi(2)) / weight / SECOND_DIFFERENCE).sqrt();
    (weight > 0.0).then(|| Flicker {
        plate: percent(&|j| j.plate),
        relit: percent(&|j| j.relit),
        beyond: percent(&|j| j.relit - shared * j.plate),
    })
}

/// The plate prepared for motion estimation.
fn to_follow(moment: &Moment) -> Encoded {
    let brightest = moment.plate.pixels.iter().zip(&moment.mask.pixels);
    let brightest = brightest.filter(|&(_, &alpha)| alpha > SOLID);
    let mut values: Vec<f32> = (brightest.flat_map(|(pixel, _)| *pixel)).filter(|v| v.is_finite()).collect();
    values.sort_unstable_by(f32::total_cmp);
    let white = values.get(values.len() * 98 / 100).copied().unwrap_or(1.0);
    let gain = 1.0 / white.max(f32::MIN_POSITIVE);
    let code = |v: f32| srgb_from_linear((gain * v).clamp(0.0, 1.0));
    let code = |v: f32| if v.is_finite() { code(v) } else { 0.0 };
    flow_picture(&Encoded(moment.plate.map(|pixel| pixel.map(code))))
}

/// Pixels where the subject is solid now and, by reliable motion, before and after.
fn followed(now: &Moment, others: [(&Flow, &Moment); 2]) -> Vec<bool> {
    let (width, height) = now.mask.size();
    let mut solid: Vec<bool> = now.mask.pixels.iter().map(|&alpha| alpha > SOLID).collect();
    for (flow, other) in others {
        // Beyond its border the other frame shows nothing, so its outermost pixels are read instead.
        let mut inside = other.mask.clone();
        for (i, alpha) in inside.pixels.iter_mut().enumerate() {
            let (x, y) = (i % width, i / width);
            if x == 0 || y == 0 || x + 1 == width || y + 1 == height {
                *alpha = 0.0;
            }
        }
        let mask = flow.warped_mask(&inside);
        let trust = flow.trust();
        for (i, solid) in solid.iter_mut().enumerate() {
            let (x, y) = (i % width, i / width);
            let at = trust.at(x * trust.width / width, y * trust.height / height);
            *solid &= mask.pixels[i] > SOLID && at > TRUSTED;
        }
    }
    solid
}

/// Jumps of the mostly solid blocks. Pictures are in the order now, before, after.
fn jumps(plates: [&Image; 3], relit: [&Image; 3], solid: &[bool]) -> Vec<Jump> {
    let (width, height) = plates[0].size();
    let side = (width.max(height) / BLOCKS).max(2);
    let columns = width.div_ceil(side);
    let pictures = [plates, relit].concat();
    // Per block, the light of the six pictures and the number of added pixels.
    let mut blocks = vec![([[0f64; 3]; 6], 0usize); columns * height.div_ceil(side)];
    for (i, _) in solid.iter().enumerate().filter(|(_, solid)| **solid) {
        let is_light = |picture: &&Image| picture.pixels[i].iter().all(|v| v.is_finite());
        if !pictures.iter().all(is_light) {
            continue;
        }
        let (light, count) = &mut blocks[i / width / side * columns + i % width / side];
        for (light, picture) in light.iter_mut().zip(&pictures) {
            for (light, value) in light.iter_mut().zip(picture.pixels[i]) {
                *light += f64::from(value);
            }
        }
        *count += 1;
    }
    let mut found = Vec::new();
    for (light, _) in blocks.iter().filter(|(_, count)| 2 * count >= side * side) {
        for channel in (0..3).map(|c| light.map(|picture| picture[c])) {
            let jump = |[now, before, after]: [f64; 3]| (now - 0.5 * (before + after)) / now;
            let [p, p_before, p_after, r, r_before, r_after] = channel;
            let (plate, relit) = (jump([p, p_before, p_after]), jump([r, r_before, r_after]));
            if plate.is_finite() && relit.is_finite() && r > 0.0 {
                found.push(Jump { plate, relit, weight: r * r });
            }
        }
    }
    found
}

/// Flicker of an interview under an environment, without and with smoothing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClipFlicker {
    /// Measured frames: the first, and the one after the last.
    pub frames: (usize, usize),
    #[serde(flatten)]
    pub plain: Flicker,
    /// [`Flicker::beyond`] with the pass `smoothing` at its full strength.
    pub beyond_smoothed: f64,
}

impl ClipFlicker {
    /// Summary in one sentence.
    pub fn sentence(&self) -> String {
        let Flicker { plate, relit, beyond } = self.plain;
        let smoothed = self.beyond_smoothed;
        let (first, end) = self.frames;
        let last = end.saturating_sub(1);
        let rest = if beyond < 0.2 {
            "too little to see".to_owned()
        } else if smoothed < 0.8 * beyond {
            format!("{smoothed:.2} % with smoothing at 1")
        } else {
            format!("still {smoothed:.2} % with smoothing at 1")
        };
        format!(
            "The prediction adds {beyond:.2} % flicker, {rest} (frames {first} to {last}: plate {plate:.2} %, relit {relit:.2} %)"
        )
    }
}

/// The middle frames of an interview, at most [`MOST_FRAMES`].
pub fn middle(project: &Project) -> Range<usize> {
    let all = project.settings.shoot.frames.len();
    let count = all.min(MOST_FRAMES);
    let first = (all - count) / 2;
    first..first + count
}

/// Result of [`clip_flicker`] as an extra figure: an unreadable frame is reported and leaves the flicker unknown.
///
/// # Errors
/// When the user stops it, or the GPU is lost.
pub fn if_possible(found: Result<Option<ClipFlicker>>, progress: &Progress) -> Result<Option<ClipFlicker>> {
    match found {
        Err(e @ (Error::Cancelled { .. } | Error::GpuLost)) => Err(e),
        Err(e) => {
            progress.report(format!("The flicker was not measured: {e}"), &e);
            Ok(None)
        }
        found => found,
    }
}

/// Measures consecutive interview frames at the working size, predicted by `predict` and lit by `environment`, whose
/// front `yaw_deg` turns to the front. None where [`flicker`] gives None.
///
/// # Errors
/// When a frame cannot be read or predicted, or the user stops it.
pub fn clip_flicker(
    project: &Project,
    calibration: &Calibration,
    (environment, yaw_deg): (&Arc<Environment>, f32),
    frames: Range<usize>,
    predict: &mut dyn FnMut(&Frame) -> Result<ReflectanceField>,
    progress: &Progress,
) -> Result<Option<ClipFlicker>> {
    let scene = |index: usize, smoothing: f32| Scene {
        frame: index,
        yaw_deg,
        background: Background::None,
        output: Output::Linear,
        effects: Effects { smoothing, ..Effects::default() },
        ..Scene::default()
    };
    let mut light: Option<EnvironmentLight> = None;
    let mut series = [Series::default(), Series::default()];
    let mut moments: [Vec<Moment>; 2] = [Vec::new(), Vec::new()];
    let total = frames.len() as u64;
    for (done, index) in frames.clone().enumerate() {
        progress.check("Nothing was written")?;
        progress.step("flicker", done as u64, total, format!("frame {index}"));
        let frame = Frame::load(project, &calibration.response, index)?;
        let field = Field::from(predict(&frame)?);
        for ((series, moments), smoothing) in series.iter_mut().zip(&mut moments).zip([0.0, 1.0]) {
            let scene = scene(index, smoothing);
            let (light, _) =
                EnvironmentLight::update(&mut light, environment, &calibration.rig, &scene, (&field, &frame.mask))?;
            let mut ingredients = light.on(&field, &frame.mask);
            ingredients.extra =
                Extra { identity: Identity { frame: index as u64, ..Identity::default() }, ..Extra::default() };
            let picture = series.compose(&scene, (&frame.plate, &frame.mask), &ingredients)?;
            let Some(relit) = picture.linear else { continue };
            moments.push(Moment { plate: frame.plate.clone(), relit, mask: frame.mask.clone() });
        }
    }
    progress.step("flicker", total, total, "");
    let [plain, smoothed] = moments.map(|moments| flicker(&moments));
    Ok(plain.zip(smoothed).map(|(plain, smoothed)| ClipFlicker {
        frames: (frames.start, frames.end),
        plain,
        beyond_smoothed: smoothed.beyond,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::Raster;
    use test_support::shown;

    /// A textured disc with motion and turning shading; the relit light of each frame is multiplied by `gain`.
    fn clip(gains: &[[f32; 2]], moves: f32, noise: f32) -> Vec<Moment> {
        const SIDE: usize = 96;
        let moment = |(t, [left, right]): (usize, &[f32; 2])| {
            let (dx, dy) = (moves * t as f32, 0.6 * moves * t as f32);
            let at = |x: usize, y: usize| (x as f32 - dx, y as f32 - dy);
            let mask = Mask::from_fn(SIDE, SIDE, |x, y| {
                let (x, y) = at(x, y);
                let r = (x - 40.0).hypot(y - 44.0);
                (34.0 - r).clamp(0.0, 1.0)
            });
            let plate = Raster::from_fn(SIDE, SIDE, |px, py| {
                let (x, y) = at(px, py);
                // Waves of 16 to 100 pixels, stronger with length, as in natural pictures.
                let octave = |k: i32| {
                    let (f, turn) = (0.0625 * 1.6f32.powi(k), 2.4 * k as f32);
                    0.12 / 1.6f32.powi(k) * (f * (x * turn.cos() + y * turn.sin()) + turn).sin()
                };
                let texture = 0.45 + (0..5).map(octave).sum::<f32>();
                let hash = ((px * 7919 + py * 104_729 + t * 15_485_863) % 1000) as f32 / 1000.0;
                [texture * (1.0 + noise * (hash - 0.5)), 0.8 * texture, 0.6 * texture]
            });
            let mut relit = plate.clone();
            for (i, pixel) in relit.pixels.iter_mut().enumerate() {
                let (x, _) = at(i % SIDE, i / SIDE);
                let shade = 0.6 + 0.3 * (0.03 * x + 0.5 * (0.15 * t as f32).sin()).sin();
                let gain = if x < 40.0 { left } else { right };
                *pixel = pixel.map(|v| 2.0 * v * shade * gain);
            }
            Moment { plate, relit, mask }
        };
        gains.iter().enumerate().map(moment).collect()
    }

    /// Random gains with a deviation of σ per cent.
    fn gains(percent: f32, count: usize) -> Vec<f32> {
        let mut state = 7u64;
        let mut draw = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        let normal = |draw: &mut dyn FnMut() -> f32| (0..12).map(|_| draw()).sum::<f32>() - 6.0;
        (0..count).map(|_| 1.0 + 0.01 * percent * normal(&mut draw)).collect()
    }

    #[test]
    fn flicker_that_is_added_is_found_and_motion_is_not_counted() {
        let still = vec![[1.0; 2]; 40];
        let mut worst_motion = 0f64;
        for moves in [0.0, 0.7, 1.5] {
            let found = flicker(&clip(&still, moves, 0.0)).unwrap();
            println!("motion of {moves} pixels a frame: {found:?}");
            worst_motion = worst_motion.max(found.beyond);
        }
        shown!(Pictures, "A relit clip whose subject moves and turns without flicker",
            bound: "0.3 % of the light",
            measured: format!("{worst_motion:.2} %"));
        assert!(worst_motion < 0.3, "{worst_motion}");
        let mut worst = 0f64;
        for percent in [1.0f32, 3.0, 8.0] {
            for moves in [0.0, 0.9] {
                let all: Vec<[f32; 2]> = gains(percent, 60).into_iter().map(|g| [g, g]).collect();
                // Measured on the gains as drawn.
                let mean = all.iter().map(|g| f64::from(g[0])).sum::<f64>() / 60.0;
                let drawn = all.windows(3).map(|g| (f64::from(g[1][0]) - 0.5 * f64::from(g[0][0] + g[2][0])).powi(2));
                let drawn = 100.0 * (drawn.sum::<f64>() / 58.0 / 1.5).sqrt() / mean;
                let found = flicker(&clip(&all, moves, 0.0)).unwrap().beyond;
                println!("{percent} % drawn as {drawn:.2} %, motion {moves}: {found:.2} %");
                worst = worst.max((found / drawn - 1.0).abs());
            }
        }
        shown!(Pictures, "Flicker of 1 to 8 % is added to a clip with and without motion",
            bound: "12 % of it",
            measured: format!("off by at most {:.1} % of it", 100.0 * worst));
        assert!(worst < 0.12, "{worst}");
    }

    #[test]
    fn flicker_of_one_side_counts_less_and_the_plates_own_does_not() {
        let off = gains(4.0, 60);
        let both: Vec<[f32; 2]> = off.iter().map(|&g| [g, g]).collect();
        let left: Vec<[f32; 2]> = off.iter().map(|&g| [g, 1.0]).collect();
        let [both, left] = [both, left].map(|g| flicker(&clip(&g, 0.5, 0.0)).unwrap().beyond);
        assert!(left < 0.85 * both && left > 0.4 * both, "{left} of {both}");
        // If the plate flickers as much, the prediction adds nothing.
        let mut shared = clip(&[[1.0; 2]; 40], 0.5, 0.02);
        for (moment, gain) in shared.iter_mut().zip(&off) {
            for picture in [&mut moment.plate, &mut moment.relit] {
                *picture = picture.map(|pixel| pixel.map(|v| v * gain));
            }
        }
        let found = flicker(&shared).unwrap();
        assert!(found.plate > 3.0 && found.beyond < 0.8, "{found:?}");
    }

    #[test]
    fn a_frame_that_cannot_be_read_leaves_the_flicker_unknown_and_a_stop_stops() {
        let unread = Err(Error::missing("frame 7 is missing", "Bring it"));
        let (known, said) = Progress::heard(|progress| if_possible(unread, progress).unwrap());
        assert_eq!(known, None);
        assert!(said.contains("frame 7 is missing"), "{said}");
        let stopped = Err(Error::Cancelled { kept: String::new() });
        assert!(if_possible(stopped, &Progress::silent()).is_err());
    }

    #[test]
    fn a_clip_without_light_or_with_two_frames_has_no_figure_and_nan_no_say() {
        let mut dark = clip(&[[1.0; 2]; 5], 0.5, 0.0);
        assert_eq!(flicker(&dark[..2]), None);
        dark[2].relit.pixels[40 * 96 + 40] = [f32::NAN; 3];
        dark[3].plate.pixels[41 * 96 + 41] = [f32::INFINITY; 3];
        let found = flicker(&dark).unwrap();
        assert!(found.plate.is_finite() && found.beyond < 1.0, "{found:?}");
        for moment in &mut dark {
            moment.plate = moment.plate.map(|_| [0.0; 3]);
            moment.relit = moment.relit.map(|_| [0.0; 3]);
        }
        assert_eq!(flicker(&dark), None);
        dark[0].mask = Mask::filled(96, 96, 0.0);
        assert_eq!(flicker(&dark[..3]), None);
    }
}

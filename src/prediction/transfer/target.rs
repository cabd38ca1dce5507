//! A frame that exemplars are carried over to.

use crate::blur::blur;
use crate::contrast::{WINDOW, bright_level, matched_contrast};
use crate::flow::{FlowSettings, flow};
use crate::lamps::Lamps;
use crate::matching::Match;
use crate::pose::Pose;
use crate::pose_turns::PoseTurns;
use crate::shape::{inside, quantile};
use crate::turn::{SeenPoint, head_turn, turn_of_normals};
use footage::Frame;
use footage::motion::head_share;
use glam::{Mat3, Vec3};
use imaging::color::luminance;
use imaging::resample::resize;
use imaging::{Image, Mask, Raster};

/// Windows of the local contrast of pictures under one light, and of the likeness, as shares of the picture's side.
const SAME_LIGHT: f32 = 40.0 / 160.0;
const LIKENESS_BLUR: f32 = 4.0 / 160.0;
/// Light below this share of the subject's bright level says nothing.
const DARK: f32 = 2e-3 / 0.7;
/// Pixels from one point to the next of those that decide the turn of the head.
const POINTS: usize = 2;
/// Least coverage in the pose, and least share of the head, of a point that decides the turn of the head.
const COVERED: f32 = 0.95;
const HEAD: f32 = 0.5;

/// A frame that exemplars are carried over to.
pub struct Target<'a> {
    pub frame: &'a Frame,
    /// Lamps of the exemplars' OLATs.
    pub lamps: &'a Lamps,
    /// The interview's light as a sum of the lamps, exposure included.
    pub weights: &'a [[f32; 3]],
    turns: &'a PoseTurns,
    inside: Raster<bool>,
    /// 1 inside, else 0.
    pub matte: Mask,
    /// Share of the head.
    pub head: Mask,
    /// Numbers of the pixels that the matte covers at all.
    pub pixels: Vec<usize>,
    /// Luminance of the plate.
    pub plate: Raster<f32>,
    /// Its local contrast, to be matched with plates of poses, and with predictions.
    pub contrast: Raster<f32>,
    same_light: Raster<f32>,
    /// Light that says nothing.
    pub dark: f32,
}

impl<'a> Target<'a> {
    pub fn new(frame: &'a Frame, lamps: &'a Lamps, weights: &'a [[f32; 3]], turns: &'a PoseTurns) -> Self {
        let plate = frame.plate.map(luminance);
        let bright = bright_level(&plate, &frame.mask);
        let inside = inside(&frame.mask);
        let matte = inside.map(|inside| f32::from(u8::from(inside)));
        Self {
            contrast: matched_contrast(&plate, &matte, WINDOW),
            same_light: matched_contrast(&plate, &matte, SAME_LIGHT),
            pixels: (0..plate.pixels.len()).filter(|&p| frame.mask.pixels[p] > 0.0).collect(),
            dark: (DARK * bright).max(f32::MIN_POSITIVE),
            matte,
            head: head_share(&frame.mask),
            frame,
            lamps,
            weights,
            turns,
            inside,
            plate,
        }
    }

    /// Offsets of the frame in one exemplar. It is matched twice: under the interview's light, and by its first prediction,
    /// which has the light of the frame itself.
    pub fn found(&self, pose: &Pose) -> Vec<[f32; 2]> {
        let first = self.matched(pose, self.offsets(&self.contrast, &pose.contrast));
        let coverage = first.pulled(&pose.mask);
        let turned = [first.turn, first.body].map(|turn| self.lamps.turned(&turn, &pose.missing));
        let (_, lit) = self.predicted(pose, &turned, &first);
        let relit = self.spread(&lit).map(luminance);
        // What the frame cuts off is missing from its prediction, too.
        let mut covered = inside(&coverage).map(|inside| f32::from(u8::from(inside)));
        covered.pixels.iter_mut().zip(&self.matte.pixels).for_each(|(covered, matte)| *covered *= matte);
        let more = self.offsets(&self.same_light, &matched_contrast(&relit, &covered, SAME_LIGHT));
        self.moved(more).then(&first.offsets)
    }

    /// Offsets between two pictures of local contrast, at the working size.
    pub fn offsets(&self, from: &Raster<f32>, to: &Raster<f32>) -> Vec<[f32; 2]> {
        let (width, height) = self.plate.size();
        let (w, h) = from.size();
        let large = flow(from, to, None, &FlowSettings::default());
        let scale = [width as f32 / w as f32, height as f32 / h as f32];
        let axis = |c: usize| {
            let plane = Raster { width: w, height: h, pixels: large.iter().map(|o| o[c] * scale[c]).collect() };
            blur(&resize(&plane, width, height), 1.0)
        };
        axis(0).pixels.into_iter().zip(axis(1).pixels).map(|(x, y)| [x, y]).collect()
    }

    /// Offsets without a turn of the head.
    pub fn moved(&self, offsets: Vec<[f32; 2]>) -> Match {
        Match { offsets, size: self.plate.size(), turn: Mat3::IDENTITY, body: Mat3::IDENTITY }
    }

    /// A match with its turn of the head.
    pub fn matched(&self, pose: &Pose, offsets: Vec<[f32; 2]>) -> Match {
        let (width, height) = self.plate.size();
        let mut found = self.moved(offsets);
        let coverage = found.pulled(&pose.mask);
        let depth = found.pulled(&pose.depth);
        let middle = [width as f32 / 2.0, height as f32 / 2.0];
        let points: Vec<(SeenPoint, bool)> = (0..width * height)
            .filter(|&p| (p % width).is_multiple_of(POINTS) && (p / width).is_multiple_of(POINTS))
            .filter(|&p| self.inside.pixels[p] && coverage.pixels[p] > COVERED)
            .map(|p| {
                let (x, y) = ((p % width) as f32, (p / width) as f32);
                let [dx, dy] = found.offsets[p];
                let point = SeenPoint {
                    place: Vec3::new(x + dx - middle[0], middle[1] - y - dy, depth.pixels[p]),
                    seen: [x - middle[0], middle[1] - y],
                };
                (point, self.head.pixels[p] > HEAD)
            })
            .collect();
        let points_turn = |head: bool| {
            let points = points.iter().filter(|(_, is_head)| *is_head || !head);
            head_turn(&points.map(|(point, _)| *point).collect::<Vec<_>>())
        };
        found.body = points_turn(false).map_or(Mat3::IDENTITY, |turn| self.turns.scaled(&turn));
        found.turn = points_turn(true).map_or(found.body, |turn| self.turns.scaled(&turn));
        found
    }

    /// Turn of the head from a matched pose to this frame, if the frame is a pose whose `normals` are known.
    pub fn turn_of_normals(&self, pose: &Pose, found: &Match, normals: &[Vec3]) -> Mat3 {
        let (coverage, width) = (found.pulled(&pose.mask), found.size.0);
        let pairs: Vec<[Vec3; 2]> = (self.pixels.iter())
            .filter(|&&p| self.inside.pixels[p] && coverage.pixels[p] > COVERED)
            .filter(|&&p| self.head.pixels[p] > HEAD)
            .map(|&p| [pose.normal(found.place((p % width, p / width))), normals[p]])
            .collect();
        turn_of_normals(&pairs, found.turn)
    }

    /// A picture of values of [`Self::pixels`]; black elsewhere.
    pub fn spread(&self, values: &[[f32; 3]]) -> Image {
        let (width, height) = self.plate.size();
        let mut picture = Image::filled(width, height, [0.0; 3]);
        for (&p, value) in self.pixels.iter().zip(values) {
            picture.pixels[p] = *value;
        }
        picture
    }

    /// Distance from the frame of a picture under the interview's light: root mean square of the ratio's logarithm, less its
    /// median, in a small window, and the share of a pixel that is not covered.
    pub fn unlike(&self, lit: &Raster<f32>, coverage: &Mask) -> Mask {
        let ratio = |(a, b): (&f32, &f32)| a.max(self.dark).ln() - b.max(self.dark).ln();
        let ratio: Vec<f32> = self.plate.pixels.iter().zip(&lit.pixels).map(ratio).collect();
        let within = ratio.iter().zip(&self.inside.pixels).filter(|(_, inside)| **inside).map(|(r, _)| *r).collect();
        let median = quantile(within, 0.5);
        let (width, height) = self.plate.size();
        let squares = ratio.iter().zip(&self.matte.pixels).map(|(r, inside)| ((r - median) * inside).powi(2)).collect();
        let radius = LIKENESS_BLUR * width.max(height) as f32;
        let squares = blur(&Raster { width, height, pixels: squares }, radius);
        let share = blur(&self.matte, radius);
        let unlike = |((square, share), coverage): ((&f32, &f32), &f32)| {
            (square.max(0.0) / (share + 1e-3)).sqrt() + 1.0 - coverage
        };
        let pixels = squares.pixels.iter().zip(&share.pixels).zip(&coverage.pixels).map(unlike).collect();
        Raster { width, height, pixels }
    }
}

//! Active effects with their share of the samples, and the reason for skipping the rest.

use serde::Serialize;

/// Report on one effect over a whole shoot.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Effect {
    pub name: &'static str,
    /// Share of the samples with this effect, from 0 to 1.
    pub share: f64,
    /// Unit of the samples.
    pub of: &'static str,
    /// Reason for skipping the rest.
    pub skipped: &'static str,
}

/// Counts of traced items.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Pixels traced, covered by the subject, and split because of a change inside them.
    pub pixels: u64,
    pub covered: u64,
    pub split: u64,
    pub silhouette: u64,
    /// Lit surface points, and the number of them in a crease.
    pub points: u64,
    pub creases: u64,
    /// Pairs of a lit point and a lamp, and the work done for them.
    pub lamp_samples: u64,
    pub shadow_rays: u64,
    pub highlights: u64,
    pub sheen: u64,
    pub subsurface: u64,
    /// Pixels of the mirror ball's photograph, and those that show the ball.
    pub probe_pixels: u64,
    pub ball: u64,
}

impl Tally {
    /// Adds another count to this one.
    pub fn add(&mut self, other: &Self) {
        self.pixels += other.pixels;
        self.covered += other.covered;
        self.split += other.split;
        self.silhouette += other.silhouette;
        self.points += other.points;
        self.creases += other.creases;
        self.lamp_samples += other.lamp_samples;
        self.shadow_rays += other.shadow_rays;
        self.highlights += other.highlights;
        self.sheen += other.sheen;
        self.subsurface += other.subsurface;
        self.probe_pixels += other.probe_pixels;
        self.ball += other.ball;
    }

    /// The counts as shares, with reasons for what was skipped.
    pub fn effects(&self) -> Vec<Effect> {
        let effect = |name, part: u64, whole: u64, of, skipped| Effect {
            name,
            share: part as f64 / whole.max(1) as f64,
            of,
            skipped,
        };
        let (pixels, covered, samples) = ("pixels", "pixels of the subject", "pairs of a lit point and a lamp");
        vec![
            effect("primary hits", self.covered, self.pixels, pixels, "the ray misses the subject"),
            effect(
                "silhouette refinement",
                self.silhouette,
                self.covered,
                covered,
                "the subject covers the whole pixel",
            ),
            effect(
                "split shading",
                self.split,
                self.covered,
                covered,
                "one material and one smooth surface fill the pixel",
            ),
            effect("crease shading", self.creases, self.points, "lit points", "the surface is open all round"),
            effect("shadow rays", self.shadow_rays, self.lamp_samples, samples, "the lamp is behind the surface"),
            effect("specular", self.highlights, self.lamp_samples, samples, "the lamp is behind the surface or hidden"),
            effect(
                "sheen",
                self.sheen,
                self.lamp_samples,
                samples,
                "the material has no fibres, or the lamp is hidden",
            ),
            effect(
                "subsurface",
                self.subsurface,
                self.lamp_samples,
                samples,
                "not skin, or far from the terminator and from any shadow's edge",
            ),
            effect("mirror reflection", self.ball, self.probe_pixels, "pixels of the probe", "the ray misses the ball"),
            effect(
                "ambient light",
                self.ball,
                self.probe_pixels,
                "pixels of the probe",
                "it lights only the mirror ball",
            ),
        ]
    }
}

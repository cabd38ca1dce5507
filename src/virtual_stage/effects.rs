//! Which effects ran, for which share of the samples, and why not for the others.

use serde::Serialize;

/// What one effect did over a whole shoot.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Effect {
    pub name: &'static str,
    /// Share of the samples it ran for, from 0 to 1.
    pub share: f64,
    /// What a sample is.
    pub of: &'static str,
    /// Why it was left out for the others.
    pub skipped: &'static str,
}

/// Counts of what was traced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Pixels looked at, covered by the subject, and split because something changes inside them.
    pub pixels: u64,
    pub covered: u64,
    pub split: u64,
    pub silhouette: u64,
    /// Points of the surface that were lit.
    pub points: u64,
    /// Pairs of a lit point and a lamp, and what was done for them.
    pub lamp_samples: u64,
    pub shadow_rays: u64,
    pub highlights: u64,
    pub sheen: u64,
    pub subsurface: u64,
}

impl Tally {
    /// Adds another count to this one.
    pub fn add(&mut self, other: &Self) {
        self.pixels += other.pixels;
        self.covered += other.covered;
        self.split += other.split;
        self.silhouette += other.silhouette;
        self.points += other.points;
        self.lamp_samples += other.lamp_samples;
        self.shadow_rays += other.shadow_rays;
        self.highlights += other.highlights;
        self.sheen += other.sheen;
        self.subsurface += other.subsurface;
    }

    /// The counts as shares, with reasons.
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
            effect("silhouette refinement", self.silhouette, self.covered, covered, "the subject covers the pixel whole"),
            effect("split shading", self.split, self.covered, covered, "one material and one smooth surface fill the pixel"),
            effect("shadow rays", self.shadow_rays, self.lamp_samples, samples, "the lamp is behind the surface"),
            effect("specular", self.highlights, self.lamp_samples, samples, "the lamp is behind the surface or hidden"),
            effect("sheen", self.sheen, self.lamp_samples, samples, "the material has no fibres, or the lamp is hidden"),
            effect(
                "subsurface",
                self.subsurface,
                self.lamp_samples,
                samples,
                "not skin, or far from the terminator and from any shadow's edge",
            ),
        ]
    }
}

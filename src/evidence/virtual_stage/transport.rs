//! Light transport from every lamp to the camera by one surface point.

use super::dome::Dome;
use super::dome::{LAMP_RADIUS_M, RADIUS_M};
use super::effects::Tally;
use super::grid::{CELL_M, Grid};
use super::material::{BELOW_SKIN_M, Surface};
use super::shape::ramp;
use super::subject::Subject;
use glam::Vec3;
use std::f32::consts::PI;

/// Reach of diffuse light past the terminator of skin, as a cosine per channel.
const BLEED: Vec3 = Vec3::new(0.20, 0.11, 0.08);
/// Share of the light that skin transmits at the very edge of a cast shadow, per channel.
const LEAK: Vec3 = Vec3::new(0.27, 0.18, 0.14);
/// Mean free paths after which less than 1 % of the light is left.
const DEEP: f32 = 5.0;

/// Work that cannot change the picture: skipped (default) or done (to test this).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    Needed,
    Everything,
}

/// A surface point visible to the camera.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    pub place: Vec3,
    pub normal: Vec3,
    /// Unit direction towards the camera.
    pub view: Vec3,
    pub surface: Surface,
}

/// A small disc of uniform radiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Source {
    pub place: Vec3,
    pub radius_m: f32,
    /// Solid angle of its light in steradians, seen from the stage's middle, and the distance from there in metres.
    pub solid_angle: f32,
    pub distance_m: f32,
}

impl Source {
    /// Lamps of the dome, each with its share of the sphere.
    pub fn lamps(dome: &Dome) -> impl Iterator<Item = Self> {
        let solid_angle = dome.lamp_solid_angle();
        dome.lamps.iter().map(move |lamp| Self {
            place: *lamp * RADIUS_M,
            radius_m: LAMP_RADIUS_M,
            solid_angle,
            distance_m: RADIUS_M,
        })
    }
}

/// Everything that light can hit.
pub struct Transport<'a> {
    pub sources: &'a [Source],
    pub subject: &'a Subject,
    pub grid: &'a Grid,
    pub effort: Effort,
}

impl Transport<'_> {
    /// Adds, for every source, `share` of the radiance that `point` sends to the camera while the source has unit
    /// radiance over its part of the sphere. Sources that are not `wanted` are skipped.
    pub fn add(&self, point: &Point, share: f32, wanted: &[bool], out: &mut [Vec3], tally: &mut Tally) {
        let everything = self.effort == Effort::Everything;
        let surface = &point.surface;
        let skin = surface.below.x > 0.0;
        let reach = if skin { BLEED.x } else { 0.0 };
        let open = self.openness(point);
        tally.creases += u64::from(open < 1.0);
        let start = point.place + point.normal * (0.8 * CELL_M);
        let enough = if skin { DEEP * surface.below.x } else { CELL_M };
        let scale = share * open;
        let gloss = Gloss::new(point);
        let (mut facing_lamps, mut directions, mut passages) = (Vec::new(), Vec::new(), Vec::new());
        for (i, source) in self.sources.iter().enumerate().filter(|(i, _)| wanted[*i]) {
            tally.lamp_samples += 1;
            let towards = source.place - point.place;
            let distance = towards.length();
            let light = towards / distance;
            let facing = point.normal.dot(light);
            if facing > -reach || everything {
                facing_lamps.push((i, distance, facing));
                directions.push(light);
            }
        }
        self.grid.pass(start, &directions, enough, &mut passages);
        tally.points += 1;
        tally.shadow_rays += directions.len() as u64;
        for ((&(lamp, distance, facing), &light), passage) in facing_lamps.iter().zip(&directions).zip(&passages) {
            let source = &self.sources[lamp];
            let penumbra = source.radius_m / distance;
            let visible = ramp(-penumbra, penumbra, passage.clearance);
            let mut lit = Vec3::splat(facing.max(0.0) * visible);
            if (skin && (visible < 1.0 || facing < BLEED.x)) || everything {
                tally.subsurface += 1;
                lit = bleed(facing, visible, passage.depth_m, surface.below);
            }
            let mut radiance = surface.albedo * lit / PI;
            if (facing > 0.0 && visible > 0.0) || everything {
                tally.highlights += 1;
                radiance += gloss.highlight(light, facing) * (facing.max(0.0) * visible);
                if surface.sheen > 0.0 || everything {
                    tally.sheen += 1;
                    radiance += gloss.sheen(light) * (facing.max(0.0) * visible);
                }
            }
            let falloff = (source.distance_m / distance).powi(2);
            out[lamp] += radiance * (scale * source.solid_angle * falloff);
        }
    }

    /// Share of light that reaches into creases finer than the grid, from three samples along the normal.
    fn openness(&self, point: &Point) -> f32 {
        let missing: f32 = [(0.0016, 0.55), (0.0035, 0.30), (0.0070, 0.15)]
            .iter()
            .map(|&(height, weight)| {
                let clear = self.subject.distance(point.place + point.normal * height);
                weight * (1.0 - clear / height).clamp(0.0, 1.0)
            })
            .sum();
        1.0 - 0.85 * missing
    }
}

/// Cosine and shadow of skin: light that enters beside a shadow's edge or just before the terminator exits beyond it,
/// red farthest.
fn bleed(facing: f32, visible: f32, depth_m: f32, below: Vec3) -> Vec3 {
    if below.x <= 0.0 {
        return Vec3::splat(facing.max(0.0) * visible);
    }
    // Hair over skin lets less light in, and it exits closer.
    let bare = below.x / BELOW_SKIN_M.x;
    let reach = BLEED * bare;
    // A parabola that leaves 0 at −reach and meets the cosine, in value and slope, at +reach, so that skipping it
    // beyond is exact.
    let rise = ((Vec3::splat(facing) + reach) / (2.0 * reach)).clamp(Vec3::ZERO, Vec3::ONE);
    let soft = reach * rise * rise;
    let cosine = Vec3::select(Vec3::splat(facing).cmpge(reach), Vec3::splat(facing.max(0.0)), soft);
    let through = LEAK * bare * (-depth_m / below).exp();
    cosine * through.max(Vec3::splat(visible))
}

/// Terms of a highlight that depend only on the point.
struct Gloss<'a> {
    point: &'a Point,
    alpha2: f32,
    /// Cosine between normal and view, clamped above 0 at the silhouette.
    seen: f32,
}

impl<'a> Gloss<'a> {
    fn new(point: &'a Point) -> Self {
        let alpha = point.surface.roughness;
        Self { point, alpha2: alpha * alpha, seen: point.normal.dot(point.view).max(0.02) }
    }

    /// Microfacet reflectance: GGX with Smith's height-correlated shadowing and Schlick's Fresnel
    /// (Heitz 2014). `facing` is the cosine between normal and light.
    fn highlight(&self, light: Vec3, facing: f32) -> Vec3 {
        let facing = facing.max(0.0);
        let half = (light + self.point.view).normalize_or(self.point.normal);
        let (nh, vh) = (self.point.normal.dot(half), self.point.view.dot(half).max(0.0));
        let spread = nh * nh * (self.alpha2 - 1.0) + 1.0;
        let facets = self.alpha2 / (PI * spread * spread);
        let smith = |a: f32, b: f32| a * (b * b * (1.0 - self.alpha2) + self.alpha2).sqrt();
        let shadowing = 0.5 / (smith(facing, self.seen) + smith(self.seen, facing)).max(1e-6);
        let mirror = self.point.surface.mirror;
        (mirror + (Vec3::ONE - mirror) * (1.0 - vh).powi(5)) * (facets * shadowing)
    }

    /// Fibres standing off the cloth: Disney's sheen (Burley 2012).
    fn sheen(&self, light: Vec3) -> Vec3 {
        let half = (light + self.point.view).normalize_or(self.point.normal);
        Vec3::splat(self.point.surface.sheen * (1.0 - self.point.view.dot(half).max(0.0)).powi(5))
    }
}

//! Pictures of the subject under many lights at once. Visible points are found once per pose, the light of every lamp
//! is traced once, and every picture is a weighted sum of the results.

use super::camera::{self, FRAME_HEIGHT_M};
use super::dome::Dome;
use super::effects::Tally;
use super::grid::{CELL_M, Grid};
use super::material::{self, Surface, surface};
use super::motion::Pose;
use super::subject::{Part, Subject};
use super::transport::{Effort, Point, Source, Transport};
use super::trouble::Look;
use glam::{Mat3, Vec3};
use imaging::{Image, Mask, Raster};
use rayon::prelude::*;

/// Pictures to make of a pose.
#[derive(Clone, Copy, Default)]
pub struct Request<'a> {
    /// True to make every bank's own picture.
    pub banks: bool,
    /// Light sources other than the dome's lamps.
    pub others: &'a [Source],
    /// Sums of light: for each, a weight per channel for every lamp and then for the other sources, if any.
    pub sums: &'a [&'a [[f32; 3]]],
    pub look: Look,
}

/// Linear pictures of one pose before black, premultiplied by the subject's coverage.
pub struct Pictures {
    pub coverage: Mask,
    /// Mean normals of the covered part; zero elsewhere.
    pub normals: Image,
    /// One per bank, in units where all lamps together are a sphere of radiance 1; empty if not requested.
    pub banks: Vec<Image>,
    /// One per requested sum.
    pub sums: Vec<Image>,
    pub tally: Tally,
}

/// First traced sample positions inside a pixel, no two in one row or column.
const FIRST: [[f32; 2]; 4] = [[0.375, 0.125], [0.875, 0.375], [0.125, 0.625], [0.625, 0.875]];
/// Rows and columns of samples in a pixel on the silhouette.
const SILHOUETTE: usize = 4;
/// Points whose normals are within this cosine and whose depths are within this length in metres are lit as one.
const SMOOTH_COSINE: f32 = 0.94;
const SMOOTH_DEPTH_M: f32 = 0.006;

/// Pictures of the subject in `pose`, `size × size`; `grid` holds the subject's distances.
pub fn take(
    dome: &Dome,
    pose: &Pose,
    grid: &Grid,
    size: (usize, usize),
    request: &Request,
    effort: Effort,
) -> Pictures {
    let subject = Subject::new(pose, &request.look);
    let seat = &pose.seat;
    let mut sources: Vec<Source> = Source::lamps(dome).chain(request.others.iter().copied()).collect();
    let mut eye = camera::POSITION;
    if !seat.is_usual() {
        // The subject stays in its own axes; the stage moves around it.
        eye = seat.subject_place(eye);
        sources.iter_mut().for_each(|s| s.place = seat.subject_place(s.place));
    }
    let camera =
        Camera { eye, subject_from_stage: (!seat.is_usual()).then(|| seat.stage_from_subject().transpose()), size };
    let transport = Transport { sources: &sources, subject: &subject, grid, effort };
    let is_summed = |source: usize| {
        let weight = |sum: &&[[f32; 3]]| sum.get(source).is_some_and(|w| *w != [0.0; 3]);
        request.sums.iter().any(weight)
    };
    let wanted: Vec<bool> =
        (0..sources.len()).map(|source| (request.banks && source < dome.lamps.len()) || is_summed(source)).collect();
    let bank_count = if request.banks { dome.banks.len() } else { 0 };
    let layers = bank_count + request.sums.len();
    let (width, height) = size;
    let rows: Vec<Row> = (0..height)
        .into_par_iter()
        .map(|y| {
            let mut row = Row::new(width, layers);
            let mut lamps = vec![Vec3::ZERO; sources.len()];
            for x in 0..width {
                let points = visible_points(&subject, grid, &camera, x, y, &mut row.tally);
                if points.is_empty() {
                    continue;
                }
                lamps.fill(Vec3::ZERO);
                for (point, share) in &points {
                    row.coverage[x] += share;
                    row.normals[x] += point.normal * *share;
                    transport.add(point, *share, &wanted, &mut lamps, &mut row.tally);
                }
                for (point, share) in lens_points(&subject, &camera, x, y) {
                    transport.add(&point, share, &wanted, &mut lamps, &mut row.tally);
                }
                let out = &mut row.light[x * layers..][..layers];
                if request.banks {
                    for (light, &bank) in lamps.iter().zip(&dome.bank_of_lamp) {
                        out[bank] += *light;
                    }
                }
                for (out, weights) in out[bank_count..].iter_mut().zip(request.sums) {
                    *out = lamps.iter().zip(*weights).map(|(light, &w)| *light * Vec3::from(w)).sum();
                }
            }
            row
        })
        .collect();
    let mut tally = Tally::default();
    rows.iter().for_each(|row| tally.add(&row.tally));
    let layer = |i: usize| Raster::from_fn(width, height, |x, y| rows[y].light[x * layers + i].to_array());
    Pictures {
        coverage: Raster::from_fn(width, height, |x, y| rows[y].coverage[x].min(1.0)),
        normals: Raster::from_fn(width, height, |x, y| {
            let normal = rows[y].normals[x].normalize_or_zero();
            let turned = camera.subject_from_stage.map_or(normal, |turn| turn.transpose() * normal);
            turned.to_array()
        }),
        banks: (0..bank_count).map(layer).collect(),
        sums: (bank_count..layers).map(layer).collect(),
        tally,
    }
}

struct Row {
    coverage: Vec<f32>,
    normals: Vec<Vec3>,
    /// Image with `layers` values per pixel.
    light: Vec<Vec3>,
    tally: Tally,
}

impl Row {
    fn new(size: usize, layers: usize) -> Self {
        Self {
            coverage: vec![0.0; size],
            normals: vec![Vec3::ZERO; size],
            light: vec![Vec3::ZERO; size * layers],
            tally: Tally::default(),
        }
    }
}

/// Position of the camera in the subject's axes.
struct Camera {
    eye: Vec3,
    /// `None` if both have the same axes.
    subject_from_stage: Option<Mat3>,
    /// Columns and rows.
    size: (usize, usize),
}

impl Camera {
    /// Ray through a place of the picture.
    fn ray(&self, x: f32, y: f32) -> Vec3 {
        let ray = camera::ray(x, y, self.size, FRAME_HEIGHT_M);
        self.subject_from_stage.map_or(ray, |turn| turn * ray)
    }
}

/// Hit of a ray from the camera.
struct Hit {
    part: Part,
    point: Point,
}

/// Points that fill pixel (`x`, `y`), each with its share of the pixel.
fn visible_points(
    subject: &Subject,
    grid: &Grid,
    camera: &Camera,
    x: usize,
    y: usize,
    tally: &mut Tally,
) -> Vec<(Point, f32)> {
    let look = |[dx, dy]: [f32; 2]| {
        let ray = camera.ray(x as f32 + dx, y as f32 + dy);
        hit(subject, grid, camera.eye, ray)
    };
    tally.pixels += 1;
    let mut hits: Vec<Hit> = FIRST.into_iter().filter_map(look).collect();
    let mut samples = FIRST.len();
    if hits.is_empty() {
        return Vec::new();
    }
    tally.covered += 1;
    if hits.len() < FIRST.len() {
        tally.silhouette += 1;
        samples = SILHOUETTE * SILHOUETTE;
        let inside = |i: usize| (i as f32 + 0.5) / SILHOUETTE as f32;
        hits = (0..samples).filter_map(|i| look([inside(i % SILHOUETTE), inside(i / SILHOUETTE)])).collect();
    }
    let groups = group(hits);
    if groups.len() > 1 {
        tally.split += 1;
    }
    groups.into_iter().map(|g| (mean(&g), g.len() as f32 / samples as f32)).collect()
}

/// Reflections in the lenses of glasses at pixel (`x`, `y`), with each sample's share of the pixel. They add to the
/// view through the lenses.
fn lens_points(subject: &Subject, camera: &Camera, x: usize, y: usize) -> Vec<(Point, f32)> {
    let share = 1.0 / FIRST.len() as f32;
    let look = |[dx, dy]: [f32; 2]| {
        let ray = camera.ray(x as f32 + dx, y as f32 + dy);
        let (t, normal) = subject.lens(camera.eye, ray)?;
        let point = Point { place: camera.eye + ray * t, normal, view: -ray, surface: material::LENS };
        Some((point, share))
    };
    FIRST.into_iter().filter_map(look).collect()
}

/// Groups hits on one smooth surface of one part.
fn group(hits: Vec<Hit>) -> Vec<Vec<Point>> {
    let mut groups: Vec<(Part, Vec<Point>)> = Vec::new();
    for hit in hits {
        let alike = |(part, points): &&mut (Part, Vec<Point>)| {
            *part == hit.part
                && points[0].normal.dot(hit.point.normal) > SMOOTH_COSINE
                && (points[0].place.z - hit.point.place.z).abs() < SMOOTH_DEPTH_M
        };
        match groups.iter_mut().find(alike) {
            Some((_, points)) => points.push(hit.point),
            None => groups.push((hit.part, vec![hit.point])),
        }
    }
    groups.into_iter().map(|(_, points)| points).collect()
}

/// One point for several on a smooth surface: the means of place, normal and surface.
fn mean(points: &[Point]) -> Point {
    let share = 1.0 / points.len() as f32;
    let vector = |f: fn(&Point) -> Vec3| points.iter().map(f).sum::<Vec3>() * share;
    let number = |f: fn(&Point) -> f32| points.iter().map(f).sum::<f32>() * share;
    Point {
        place: vector(|p| p.place),
        normal: vector(|p| p.normal).normalize(),
        view: vector(|p| p.view).normalize(),
        surface: Surface {
            albedo: vector(|p| p.surface.albedo),
            mirror: vector(|p| p.surface.mirror),
            roughness: number(|p| p.surface.roughness),
            sheen: number(|p| p.surface.sheen),
            below: vector(|p| p.surface.below),
        },
    }
}

/// First hit on the subject of the camera ray from `eye` along `direction`.
fn hit(subject: &Subject, grid: &Grid, eye: Vec3, direction: Vec3) -> Option<Hit> {
    const NEAR_M: f32 = 1.5 * CELL_M;
    let mut t = grid.approach(eye, direction, 0.0, NEAR_M)?;
    // The grid leads to the surface; the last steps use the subject's exact distance. Pleats and blends distort
    // distances, hence the shorter step.
    for _ in 0..160 {
        let place = eye + direction * t;
        let (part, distance) = subject.parts(place);
        if distance < 1.5e-4 {
            let normal = subject.normal(place);
            let surface = surface(subject, part, place, eye);
            return Some(Hit { part, point: Point { place, normal, view: -direction, surface } });
        }
        t += 0.75 * distance;
        if distance > 2.0 * NEAR_M {
            t = grid.approach(eye, direction, t, NEAR_M)?;
        }
    }
    None
}

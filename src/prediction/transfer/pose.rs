//! Poses of the OLAT session.

use crate::contrast::{WINDOW, matched_contrast};
use crate::half_rows::HalfRows;
use crate::lamps::{Lamps, shading};
use crate::shape::{depth, inside, normals};
use footage::Exemplar;
use glam::Vec3;
use imaging::color::luminance;
use imaging::{Image, Mask, Raster};

/// A pose under the interview's light beside its OLATs.
#[derive(Clone, Debug)]
pub struct PlatePose {
    pub exemplar: Exemplar,
    /// The pose under the interview's light, linear, exposure included.
    pub plate: Image,
}

/// A pose, ready to be matched and carried over.
#[derive(Clone, Debug)]
pub struct Pose {
    /// Number of the pose in the project.
    pub number: usize,
    /// Local contrast of the plate, at the size at which pictures are matched.
    pub contrast: Raster<f32>,
    pub mask: Mask,
    /// Heights towards the camera in pixels.
    pub depth: Raster<f32>,
    pub normals: Vec<Vec3>,
    /// Lamps whose OLATs the pose lacks.
    pub missing: Vec<usize>,
    /// Roots of the OLATs over their lamps' energy and shading, `[3, stride]` a pixel.
    pub bare: HalfRows,
}

impl Pose {
    /// The normal at a place that a match found, not of unit length between pixels.
    #[inline(always)]
    pub fn normal(&self, places: [(usize, f32); 4]) -> Vec3 {
        places.iter().map(|&(p, share)| self.normals[p] * share).sum()
    }

    /// Prepares a pose whose OLATs are those of `lamps`.
    pub fn new(pose: &PlatePose, lamps: &Lamps) -> Self {
        let PlatePose { exemplar, plate } = pose;
        let plate = plate.map(luminance);
        let inside = inside(&exemplar.mask);
        let matte = inside.map(|inside| f32::from(u8::from(inside)));
        let known: Vec<(usize, Vec3)> = lamps
            .directions
            .iter()
            .enumerate()
            .filter_map(|(m, direction)| Some((m, (*direction)?)))
            .filter(|(m, _)| !exemplar.missing.contains(m))
            .collect();
        let pixels = exemplar.mask.pixels.len();
        let even: Vec<f32> = (0..pixels)
            .flat_map(|p| {
                known.iter().map(move |&(m, _)| luminance(exemplar.olats[m].pixels[p]) / luminance(lamps.energies[m]))
            })
            .collect();
        let directions: Vec<Vec3> = known.iter().map(|(_, direction)| *direction).collect();
        let normals = if known.is_empty() { vec![Vec3::ZERO; pixels] } else { normals(&even, &directions) };
        let stride = lamps.stride;
        let bare = HalfRows::new(&exemplar.mask, 3 * stride, |p, bare| {
            for (m, (olat, direction)) in exemplar.olats.iter().zip(&lamps.directions).enumerate() {
                let shading = shading(normals[p], *direction);
                for c in 0..3 {
                    bare[c * stride + m] = (olat.pixels[p][c].max(0.0) / (lamps.energies[m][c] * shading)).sqrt();
                }
            }
        });
        Self {
            number: exemplar.pose,
            missing: exemplar.missing.clone(),
            contrast: matched_contrast(&plate, &matte, WINDOW),
            mask: exemplar.mask.clone(),
            depth: depth(&normals, &inside),
            normals,
            bare,
        }
    }
}

//! The mirror ball's silhouette: which circle of the photographs is the ball.
//!
//! All balls of a shoot were photographed by one fixed camera, so their photographs are averaged
//! first ([`Photographs`]): what one of them hides in the dark, another shows. In the average, reduced
//! to a few hundred pixels, circles are searched (`edges`, `search`); the best are then measured along
//! rays at the full size (`rim`), where the circle that most of the rim agrees on is fitted
//! (`circle`). A circle that too little of a rim supports is not returned.

mod circle;
mod edges;
mod photographs;
mod rim;
#[cfg(test)]
mod scene;
mod search;
#[cfg(test)]
mod tests;

pub use circle::Circle;
pub use photographs::Photographs;

use crate::error::{Error, Result};
use crate::imaging::Raster;
use edges::Edges;
use glam::DVec2;
use rim::Rim;
use serde::{Deserialize, Serialize};

/// A circle and how well the photographs show a rim there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Silhouette {
    /// Where the ball's outline is.
    #[serde(flatten)]
    pub circle: Circle,
    /// Root-mean-square distance in pixels of the rim, where it was seen, from the circle. Means
    /// nothing (0) where `rim_share` is 0.
    pub residual_px: f64,
    /// Share of the whole circumference where the rim was seen, beyond what chance gives: 0 to 1.
    pub rim_share: f64,
    /// Share of the circumference that lies within the photographs: 1 for a ball in full view.
    pub framed_share: f64,
    /// Median change of the averaged encoded values across the rim where it was seen: 0 to 1.
    pub contrast: f64,
}

/// A ball of fewer pixels shows directions too coarsely: a pixel would span over five degrees.
pub const LEAST_RADIUS_PX: f64 = 10.0;
/// Of the part of the circumference that the photographs hold, this share must show a rim.
const LEAST_RIM: f64 = 0.35;
/// Of the whole circumference, this share must.
const LEAST_ARC: f64 = 0.2;
/// A circle too small to be used is spoken of when this much of its rim is seen.
const CLEAR_RIM: f64 = 0.8;
/// Small circles need nearly all of their rim, large ones less: a ball of 12 pixels in full view has 16.
const LEAST_EVIDENCE: f64 = 8.0;
/// A rim is off its circle by no more (root mean square) than this many pixels …
const BLUNT_PX: f64 = 0.2;
/// … and this share of the radius, as of a ball 10° off the optical axis, whose outline is an ellipse;
/// round things grown or made by hand are worse.
const OUT_OF_ROUND: f64 = 0.006;
/// The picture that is searched for large circles has at most this many pixels on its longer side.
const COARSE_PX: usize = 320;
/// Small circles are searched in pictures of up to this many.
const FINE_PX: usize = 1280;
/// Circles that are looked at more closely.
const PROMISING: usize = 5;
/// Radius in pixels at which the rim and reflections close to it are told apart well enough.
const AMPLE_PX: f64 = 110.0;
/// Least radius in pixels of a searched picture that shows a circle well; below, the next finer
/// picture is searched.
const WELL_SHOWN_PX: f32 = 10.0;
/// Least radius that is searched at all, so that a ball too small is recognised as such.
const BARELY_SHOWN_PX: f32 = 4.0;

/// Finds the ball's silhouette.
///
/// # Errors
/// When the photographs are all black, clipped throughout, or show no circle of which enough can be
/// seen; when the ball is smaller than [`LEAST_RADIUS_PX`].
pub fn find(photographs: &Photographs) -> Result<Silhouette> {
    photographs.check_exposure()?;
    let pyramid = pyramid(photographs.average());
    let rims = anywhere(&pyramid);
    let place = &photographs.place();
    let Some(best) = outermost(&rims) else {
        if let Some(small) = rims.first().filter(|rim| rim.share > CLEAR_RIM) {
            large_enough(&small.circle, place)?;
        }
        return Err(Error::unexpected(
            place,
            "a mirror ball whose rim can be seen",
            match rims.first() {
                Some(rim) => format!(
                    "no circle with enough of a rim (the likeliest, about {:.0}, {:.0} with radius {:.0} pixels, \
                     shows {:.0} % of one)",
                    rim.circle.center_px[0],
                    rim.circle.center_px[1],
                    rim.circle.radius_px,
                    100.0 * rim.share
                ),
                None => "no circle".to_owned(),
            },
            "Check that these are the mirror ball's photographs, add ones in which its rim stands out from the \
             background, or give the circle by hand",
        ));
    };
    Ok(best.into())
}

/// Snaps a rough circle, off by up to a fifth of its radius, to the rim nearby.
///
/// # Errors
/// When no rim is near the circle, or it is no ball in the photographs (see [`measure`]).
pub fn refine(photographs: &Photographs, rough: &Circle) -> Result<Silhouette> {
    check_by_hand(photographs, rough)?;
    let pyramid = pyramid(photographs.average());
    let rims = distinct(nearby(&pyramid, rough, 0.2));
    let best = rims.iter().find(|rim| is_ball(rim)).ok_or_else(|| {
        Error::unexpected(
            photographs.place(),
            format!(
                "a rim near the circle about {:.1}, {:.1} with radius {:.1} pixels",
                rough.center_px[0], rough.center_px[1], rough.radius_px
            ),
            "none",
            "Place the circle closer to the ball's outline, or keep it as it is",
        )
    })?;
    Ok(best.into())
}

/// How well the photographs show a rim at a circle, which is returned as it is: for circles made by
/// hand. The residual is that of the rim points nearby, up to a fiftieth of the radius away.
///
/// # Errors
/// When the circle is none, lies outside the photographs, is larger than twice their longer side or
/// smaller than [`LEAST_RADIUS_PX`].
pub fn measure(photographs: &Photographs, circle: &Circle) -> Result<Silhouette> {
    check_by_hand(photographs, circle)?;
    let tolerance = 2.5 * rim::widest_tolerance(circle);
    Ok((&rim::measured(photographs.average(), circle, tolerance)).into())
}

impl From<&Rim> for Silhouette {
    fn from(rim: &Rim) -> Self {
        Self {
            circle: rim.circle,
            residual_px: rim.residual,
            rim_share: rim.share,
            framed_share: rim.framed,
            contrast: rim.contrast,
        }
    }
}

/// Refuses a circle that cannot be a ball in these photographs.
fn check_by_hand(photographs: &Photographs, circle: &Circle) -> Result<()> {
    let Circle {
        center_px: [x, y],
        radius_px,
    } = Circle::new(circle.center_px, circle.radius_px)?;
    large_enough(circle, &photographs.place())?;
    let (width, height) = photographs.average().size();
    let outside = |at: f64, size: usize| (-at).max(at - size as f64).max(0.0);
    if outside(x, width).hypot(outside(y, height)) < radius_px
        && radius_px <= 2.0 * width.max(height) as f64
    {
        return Ok(());
    }
    Err(Error::unexpected(
        photographs.place(),
        format!("a circle within its {width}×{height} pixels"),
        format!("centre {x:.1}, {y:.1}, radius {radius_px:.1}"),
        "Give the ball's circle in pixels of these photographs",
    ))
}

fn large_enough(circle: &Circle, place: &str) -> Result<()> {
    if circle.radius_px >= LEAST_RADIUS_PX {
        return Ok(());
    }
    Err(Error::unexpected(
        place,
        format!("a ball of at least {LEAST_RADIUS_PX} pixels' radius"),
        format!("one of {:.1} pixels", circle.radius_px),
        "Give the photographs at their full size, or photograph the ball from closer",
    ))
}

fn is_ball(rim: &Rim) -> bool {
    rim.share_within_frame() >= LEAST_RIM
        && rim.share >= LEAST_ARC
        && rim.evidence() >= LEAST_EVIDENCE
        && rim.residual <= BLUNT_PX + OUT_OF_ROUND * rim.circle.radius_px
}

/// A rim and by what it is preferred to others.
type Ranked = (Rim, f64);

/// Circles with a rim, found anywhere, best first.
fn anywhere(pyramid: &[Raster<[f32; 3]>]) -> Vec<Rim> {
    let mut found = Vec::new();
    let coarsest = pyramid.len() - 1;
    for (level, picture) in pyramid.iter().enumerate().rev() {
        let longer = picture.width.max(picture.height);
        if level != coarsest && longer > FINE_PX {
            break;
        }
        let is_finest = level == 0 || 2 * longer > FINE_PX;
        let least = if is_finest {
            BARELY_SHOWN_PX
        } else {
            WELL_SHOWN_PX
        };
        let most = if level == coarsest {
            0.75 * longer as f32
        } else {
            2.2 * WELL_SHOWN_PX
        };
        let edges = Edges::find(picture);
        let circles = search::circles(&edges, least..most, None);
        found.extend(measured(pyramid, &edges, &circles, level, DVec2::ZERO));
    }
    // What is taken for one edge in a small picture may be two in a larger one: the rim, and a
    // reflection close to it.
    let promising = distinct(found.clone());
    for rim in promising.iter().take(PROMISING) {
        found.extend(nearby(pyramid, &rim.circle, 0.1));
    }
    distinct(found)
}

/// Circles with a rim near a given one: centres and radii off by up to `share` of the radius.
fn nearby(pyramid: &[Raster<[f32; 3]>], circle: &Circle, share: f64) -> Vec<Ranked> {
    let finest_needed = (circle.radius_px / AMPLE_PX).log2().ceil().max(0.0) as usize;
    let level = finest_needed.min(pyramid.len() - 1);
    let picture = &pyramid[level];
    let local = circle.scaled(1.0 / (1 << level) as f64);
    // The part of the picture that can hold the circle.
    let reach = DVec2::splat((1.0 + 2.5 * share) * local.radius_px + 4.0);
    let size = DVec2::new(picture.width as f64, picture.height as f64);
    let from = (local.center() - reach).floor().clamp(DVec2::ZERO, size);
    let to = (local.center() + reach).ceil().clamp(DVec2::ZERO, size);
    let part = Raster::from_fn(
        (to.x - from.x) as usize,
        (to.y - from.y) as usize,
        |x, y| picture.at(x + from.x as usize, y + from.y as usize),
    );
    if part.width < 8 || part.height < 8 {
        return Vec::new();
    }
    let edges = Edges::find(&part);
    let here = Circle {
        center_px: (local.center() - from).to_array(),
        ..local
    };
    let radii = (1.0 - share) * local.radius_px..(1.0 + 1.2 * share) * local.radius_px;
    let circles = search::circles(
        &edges,
        radii.start as f32..radii.end as f32,
        Some((here, share)),
    );
    measured(pyramid, &edges, &circles, level, from)
}

/// The rims of `circles`, which were found among `edges` of the picture at `level` from place `from` on.
fn measured(
    pyramid: &[Raster<[f32; 3]>],
    edges: &Edges,
    circles: &[Circle],
    level: usize,
    from: DVec2,
) -> Vec<Ranked> {
    let scale = (1 << level) as f64;
    let moved = |circle: &Circle, by: DVec2| Circle {
        center_px: (circle.center() + by).to_array(),
        ..*circle
    };
    circles
        .iter()
        .filter_map(|circle| {
            let rim = rim::fit(pyramid, &moved(circle, from).scaled(scale), level)?;
            let rank = rank(&rim, edges, &moved(&rim.circle.scaled(1.0 / scale), -from));
            Some((rim, rank))
        })
        .collect()
}

/// Best first, each circle once.
fn distinct(mut found: Vec<Ranked>) -> Vec<Rim> {
    found.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut rims: Vec<Rim> = Vec::new();
    for (rim, _) in found {
        if !rims
            .iter()
            .any(|r| search::same_circle(&r.circle, &rim.circle))
        {
            rims.push(rim);
        }
    }
    rims
}

/// By what a circle is preferred to others: the evidence for its rim, lessened for steps as faint as
/// those between codes (whose contours in a lamp's glare are circles too), and up to doubled where there
/// are clear edges within, as a mirror shows and a grey ball or a disc does not.
fn rank(rim: &Rim, edges: &Edges, circle: &Circle) -> f64 {
    /// About two codes of eight bits.
    const FAINT: f64 = 0.0087;
    /// Edges per pixel: a few windows' worth in a ball of 30 pixels.
    const BUSY: f64 = 0.03;
    let within = 0.85 * circle.radius_px;
    let clear = (edges.list.iter())
        .filter(|e| e.weight > 0.5 && e.place.as_dvec2().distance(circle.center()) < within)
        .count();
    let density = clear as f64 / (std::f64::consts::PI * within * within);
    rim.evidence() * rim.contrast / (rim.contrast + FAINT) * (1.0 + (density / BUSY).min(1.0))
}

/// The best of `rims` (best first) that can be a ball; where that is a ring within a larger circle,
/// as reflections about the camera's axis are, the outermost.
fn outermost(rims: &[Rim]) -> Option<&Rim> {
    let mut balls = (rims.iter()).filter(|r| is_ball(r) && r.circle.radius_px >= LEAST_RADIUS_PX);
    let mut best = balls.next()?;
    for rim in balls {
        let (inner, outer) = (&best.circle, &rim.circle);
        let apart = inner.center().distance(outer.center());
        let is_around = apart + inner.radius_px < 1.01 * outer.radius_px
            && apart < 0.1 * outer.radius_px
            && outer.radius_px < 1.6 * inner.radius_px
            && outer.radius_px > 1.01 * inner.radius_px;
        if is_around {
            best = rim;
        }
    }
    Some(best)
}

/// The picture, and halves of it until its longer side is at most [`COARSE_PX`].
fn pyramid(picture: &Raster<[f32; 3]>) -> Vec<Raster<[f32; 3]>> {
    let mut levels = vec![picture.clone()];
    while let Some(last) = levels.last().filter(|l| l.width.max(l.height) > COARSE_PX) {
        let half = halved(last);
        levels.push(half);
    }
    levels
}

/// Means of 2×2 pixels; an odd last row or column is left out, so that places scale by exactly two.
fn halved(picture: &Raster<[f32; 3]>) -> Raster<[f32; 3]> {
    use rayon::prelude::*;
    let (width, height) = ((picture.width / 2).max(1), (picture.height / 2).max(1));
    let below = |i: usize, n: usize| (2 * i + 1).min(n - 1);
    let pixels = (0..height)
        .into_par_iter()
        .flat_map_iter(|y| {
            (0..width).map(move |x| {
                let four = [
                    picture.at(2 * x, 2 * y),
                    picture.at(below(x, picture.width), 2 * y),
                    picture.at(2 * x, below(y, picture.height)),
                    picture.at(below(x, picture.width), below(y, picture.height)),
                ];
                [0, 1, 2].map(|c| 0.25 * four.iter().map(|p| p[c]).sum::<f32>())
            })
        })
        .collect();
    Raster {
        width,
        height,
        pixels,
    }
}

//! The mirror ball's silhouette: detection of the ball's circle in the photographs.
//!
//! All balls of a shoot were photographed by one fixed camera, so their photographs are averaged first
//! ([`Photographs`]): a rim lost in the dark in one is visible in another. Circles are searched in the average,
//! reduced to a few hundred pixels (`candidates`, `edges`, `search`). The best are measured along rays at full size
//! (`rim`), and a circle is fitted to the largest consistent part of the rim (`circle`). A circle with too little
//! rim is rejected.

mod candidates;
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
pub(super) use photographs::same_size;

use super::mirror_ball::LARGEST;
use base::error::{Error, Result};
use candidates::{anywhere, distinct, nearby, pyramid};
use rim::Rim;
use serde::{Deserialize, Serialize};

/// A circle and the quality of its rim in the photographs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Silhouette {
    /// Outline of the ball.
    #[serde(flatten)]
    pub circle: Circle,
    /// Root-mean-square distance in pixels of the visible rim from the circle; 0 and meaningless if `rim_share` is
    /// 0.
    pub residual_px: f64,
    /// Share of the full circumference with a rim beyond chance, 0 to 1.
    pub rim_share: f64,
    /// Share of the circumference inside the photographs; 1 for a ball in full view.
    pub framed_share: f64,
    /// Median change of the averaged encoded values across the visible rim, 0 to 1.
    pub contrast: f64,
}

impl Silhouette {
    /// Check to make before trusting the circle, as a sentence; `None` if the rim is clear all around. The search
    /// accepts anything round, even the crown of a head as the visible part of a ball, and warns of such parts.
    pub fn warning(&self) -> Option<String> {
        let seen = self.rim_share / self.framed_share.max(1e-9);
        let seen_percent = 100.0 * seen;
        let cut_percent = 100.0 * (1.0 - self.framed_share);
        if seen < TRUSTED_RIM {
            return Some(format!(
                "only {seen_percent:.0} % of the mirror ball's rim stands out from the background. Check that the \
                 circle is the ball's outline"
            ));
        }
        (self.framed_share < WHOLE).then(|| {
            format!(
                "the frame cuts off {cut_percent:.0} % of the mirror ball's rim: lamps that only this part \
                 reflects are missing"
            )
        })
    }
}

/// Smallest visible share of the rim inside the photographs that needs no check by the user.
const TRUSTED_RIM: f64 = 0.6;
/// Smallest share of the rim inside the photographs of an uncut ball; a ray or two may end at the frame.
const WHOLE: f64 = 0.98;
/// Smallest usable radius. In a smaller ball a pixel would span over five degrees.
pub const MIN_RADIUS_PX: f64 = 10.0;
/// Smallest visible share of the circumference inside the photographs.
const MIN_RIM: f64 = 0.35;
/// Smallest visible share of the full circumference.
const MIN_ARC: f64 = 0.2;
/// Smallest visible share of a circle that is reported as too small.
const CLEAR_RIM: f64 = 0.8;
/// Smallest evidence. Small circles need nearly all of their rim, large ones less: a ball of 12 pixels in full view
/// has 16.
const MIN_EVIDENCE: f64 = 8.0;
/// Largest root-mean-square distance of a rim from its circle in pixels: a single lamp right behind the ball lights a
/// sliver of the rim up to half a pixel off, 0.24 in the worst of 6000 drawn at random …
const BLUNT_PX: f64 = 0.25;
/// … and relative to the radius, enough for a ball 10° off the optical axis, whose outline is an ellipse. Fruit and
/// handmade objects are less round.
const OUT_OF_ROUND: f64 = 0.006;
/// Finds the ball's silhouette.
///
/// # Errors
/// When the photographs are all black, clipped everywhere, or show no circle with enough rim; when the ball is
/// smaller than [`MIN_RADIUS_PX`].
pub fn find(photographs: &Photographs) -> Result<Silhouette> {
    photographs.check_exposure()?;
    let pyramid = pyramid(photographs.average());
    let rims = anywhere(&pyramid);
    let place = &photographs.place();
    let Some(best) = outermost(&rims, photographs) else {
        if let Some(small) = rims.first().filter(|rim| rim.share > CLEAR_RIM) {
            large_enough(&small.circle, place)?;
        }
        return Err(Error::invalid(
            match rims.first() {
                Some(rim) => format!(
                    "{place}: no mirror ball with enough rim found (best circle: centre {:.0}, {:.0}, \
                     radius {:.0} pixels, {:.0} % of its rim)",
                    rim.circle.center_px[0],
                    rim.circle.center_px[1],
                    rim.circle.radius_px,
                    100.0 * rim.share
                ),
                None => format!("{place}: no mirror ball found"),
            },
            "Check that these are the mirror ball's photographs, add photographs in which its rim stands out from \
             the background, or set the circle by hand",
        ));
    };
    Ok(best.into())
}

/// Snaps a rough circle, up to a fifth of its radius off, to the rim nearby.
///
/// # Errors
/// When no rim is near the circle, or it cannot be a ball in the photographs (see [`measure`]).
pub fn refine(photographs: &Photographs, rough: &Circle) -> Result<Silhouette> {
    check_by_hand(photographs, rough)?;
    let pyramid = pyramid(photographs.average());
    let rims = distinct(nearby(&pyramid, rough, 0.2));
    let best = rims.iter().find(|rim| is_ball(rim, photographs)).ok_or_else(|| {
        Error::invalid(
            format!(
                "{}: no rim found near the circle with centre {:.1}, {:.1} and radius {:.1} pixels",
                photographs.place(),
                rough.center_px[0],
                rough.center_px[1],
                rough.radius_px
            ),
            "Place the circle closer to the ball's outline, or keep it unchanged",
        )
    })?;
    Ok(best.into())
}

/// Measures the rim at a circle set by hand, which is returned unchanged. The residual is that of nearby rim
/// points, up to a fiftieth of the radius away.
///
/// # Errors
/// When the circle is invalid, lies outside the photographs, is larger than twice their longer side or smaller than
/// [`MIN_RADIUS_PX`].
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

/// Refuses a circle that is invalid for these photographs.
fn check_by_hand(photographs: &Photographs, circle: &Circle) -> Result<()> {
    let Circle { center_px: [x, y], radius_px } = Circle::new(circle.center_px, circle.radius_px)?;
    large_enough(circle, &photographs.place())?;
    let (width, height) = photographs.average().size();
    let outside = |at: f64, size: usize| (-at).max(at - size as f64).max(0.0);
    if outside(x, width).hypot(outside(y, height)) < radius_px
        && radius_px <= f64::from(LARGEST) * width.max(height) as f64
    {
        return Ok(());
    }
    Err(Error::invalid(
        format!(
            "the circle with centre {x:.1}, {y:.1} and radius {radius_px:.1} is outside the {width} × {height} pixels \
             of {}",
            photographs.place()
        ),
        "Give the ball's circle in pixels of these photographs",
    ))
}

/// Refuses a ball too small to resolve lamps; `place` names its photographs.
pub(super) fn large_enough(circle: &Circle, place: &str) -> Result<()> {
    if circle.radius_px >= MIN_RADIUS_PX {
        return Ok(());
    }
    Err(Error::invalid(
        format!(
            "{place}: the ball's radius is {:.1} pixels; a radius of {MIN_RADIUS_PX} pixels or more is needed",
            circle.radius_px
        ),
        "Use the photographs at their full size, or photograph the ball from closer",
    ))
}

fn is_ball(rim: &Rim, photographs: &Photographs) -> bool {
    rim.contrast >= photographs.faintest_step()
        && rim.share_within_frame() >= MIN_RIM
        && rim.share >= MIN_ARC
        && rim.evidence() >= MIN_EVIDENCE
        && rim.residual <= BLUNT_PX + OUT_OF_ROUND * rim.circle.radius_px
}

/// Best valid ball among `rims` (best first). If it lies inside larger concentric rings, such as reflections around
/// the camera's axis, the outermost.
fn outermost<'a>(rims: &'a [Rim], photographs: &Photographs) -> Option<&'a Rim> {
    let mut balls = (rims.iter()).filter(|rim| is_ball(rim, photographs) && rim.circle.radius_px >= MIN_RADIUS_PX);
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
